// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { closeSync, copyFileSync, openSync, readFileSync, statSync, truncateSync, writeFileSync, writeSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { pathToFileURL } from "node:url";
import { painted, picture, says, visit } from "./browser.mjs";
import { kRoot, packageOf, Program, scratch, startDash, startServer, until } from "./support.mjs";

const { McapStreamReader, McapWriter } = packageOf("clients/dashboard/page", "@mcap/core");

async function salvageModule(test) {
  const ts = packageOf("clients/dashboard/page", "typescript");
  const folder = scratch(test);
  const compilerOptions = { target: ts.ScriptTarget.ES2022, module: ts.ModuleKind.ESNext, verbatimModuleSyntax: true };
  const text = readFileSync(join(kRoot, "clients/dashboard/page/src/salvage.ts"), "utf8");
  const mcap = pathToFileURL(join(kRoot, "clients/dashboard/page/node_modules/@mcap/core/dist/esm/index.js")).href;
  writeFileSync(join(folder, "package.json"), '{"type":"module"}');
  writeFileSync(join(folder, "salvage.js"), ts.transpileModule(text, { compilerOptions }).outputText.replace('"@mcap/core"', JSON.stringify(mcap)));
  return import(join(folder, "salvage.js"));
}

function middleOfThirdChunk(bytes) {
  const kChunk = 6;
  const lengthAt = (at) => Number(bytes.readBigUInt64LE(at + 1));
  let chunks = 0;
  for (let at = 8; ; at += 9 + lengthAt(at)) {
    if (bytes[at] === kChunk && ++chunks === 3) return at + Math.floor(lengthAt(at) / 2);
  }
}

it("reads all chunks of a damaged recording that are whole", async (test) => {
  const { Salvage } = await salvageModule(test);
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "run.mcap", "--duration-s", "1");
  await server.program.ended;
  const whole = readFileSync(join(folder, "run.mcap"));
  const read = async (bytes) => {
    const file = { size: async () => BigInt(bytes.length), read: async (at, size) => bytes.subarray(Number(at), Number(at + size)) };
    const salvage = new Salvage(file);
    const messages = [];
    for await (const record of salvage.records()) if (record.type === "Message") messages.push(`${record.channelId} ${record.sequence} ${record.logTime}`);
    return { messages, damaged: salvage.damaged, ended: salvage.ended };
  };
  const before = await read(whole);
  assert.ok(before.messages.length > 900);
  assert.deepEqual([before.damaged, before.ended], [0, true]);
  const middle = middleOfThirdChunk(whole);
  const flipped = Buffer.from(whole);
  flipped[middle] ^= 0x40;
  const zeroed = Buffer.from(whole);
  zeroed.fill(0, middle, middle + 4096);
  const tail = Buffer.from(whole);
  tail.fill(0, middle);
  const gone = Buffer.concat([whole.subarray(0, middle), whole.subarray(middle + 5000)]);
  for (const [what, bytes, damaged, ended] of [["a flipped bit", flipped, 1, true], ["a lost sector", zeroed, 1, true],
    ["an end of zeros", tail, 0, false], ["a piece that is gone", gone, 1, true]]) {
    const after = await read(bytes);
    assert.deepEqual([after.damaged > 0 ? 1 : 0, after.ended], [damaged, ended], what);
    const known = new Set(before.messages);
    for (const message of after.messages) assert.ok(known.has(message), what);
    assert.ok(after.messages.length >= before.messages.length * (ended ? 0.4 : 0.2), `${what}: ${after.messages.length} of ${before.messages.length}`);
  }
});

it("opens recordings, scrubs them, and shows two side by side", async (test) => {
  const folder = scratch(test);
  const record = async (name, ...more) => {
    const server = await startServer(test, folder, ["demo"], "--record", `${name}.mcap`, "--duration-s", "2", ...more);
    const wall = new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "100"]);
    await server.program.ended;
    await wall.stop();
  };
  await Promise.all([record("one"), record("two", "--without-limiter")]);
  // This is what remains after a crash of the server: there is no index, and the last chunk is incomplete.
  copyFileSync(join(folder, "one.mcap"), join(folder, "torn.mcap"));
  truncateSync(join(folder, "torn.mcap"), 400_000);
  writeFileSync(join(folder, "noise.mcap"), "this is no recording");
  const { url } = await startDash(test, "127.0.0.1:9", "--recordings", folder);
  const page = await visit(test, url);
  await page.click("nav a:has-text('Recordings')");
  await page.locator(".list tbody tr").nth(3).waitFor();
  assert.deepEqual((await page.locator(".list tbody a").allTextContents()).sort(), ["noise.mcap", "one.mcap", "torn.mcap", "two.mcap"]);

  await page.click("a:has-text('one.mcap')");
  await page.locator(".run h2", { hasText: "one.mcap" }).waitFor();
  assert.match(await page.locator(".run .head .quiet").textContent(), /^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC.* · \d+(\.\d+)?\ss · [\d\u202f]+ steps · /);
  assert.ok((await painted(page, "[data-chart=position] canvas")) > 2000);
  await says(page, ".lateness .words", "99\u00a0% within");
  const whole = await picture(page, "[data-chart=position] canvas");
  const sentence = await page.locator("[data-tile=state] .note").textContent();
  await page.click("#zoom-in");
  await until("fewer steps are shown", async () => (await page.locator("[data-tile=state] .note").textContent()) !== sentence);
  const zoomed = await picture(page, "[data-chart=position] canvas");
  assert.notEqual(zoomed, whole);
  const before = Number(await page.locator(".scrubber .window").getAttribute("aria-valuenow"));
  const box = await page.locator(".scrubber").boundingBox();
  const window_ = await page.locator(".scrubber .window").boundingBox();
  await page.mouse.move(window_.x + window_.width / 2, window_.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 4, window_.y + 20, { steps: 4 });
  await page.mouse.up();
  await until("it shows an earlier time", async () => Number(await page.locator(".scrubber .window").getAttribute("aria-valuenow")) < before);
  await until("the picture is of another time", async () => (await picture(page, "[data-chart=position] canvas")) !== zoomed);
  const early = Number(await page.locator(".scrubber .window").getAttribute("aria-valuenow"));
  await page.locator(".scrubber .window").focus();
  await page.keyboard.press("ArrowRight");
  await until("the arrow key goes on", async () => Number(await page.locator(".scrubber .window").getAttribute("aria-valuenow")) > early);
  await page.locator("summary").click();
  await says(page, "details pre", 'profile = "falcon"');

  await page.click("a:has-text('All recordings')");
  for (const name of ["one", "two"]) await page.check(`[aria-label='Compare ${name}.mcap']`);
  await page.click("#compare");
  await page.locator(".runs.two .run").nth(1).waitFor();
  assert.deepEqual(await page.locator(".run h2").allTextContents(), ["one.mcap", "two.mcap"]);
  // Only the recording with a limiter has samples that are limited by energy.
  const [left, right] = ["one", "two"].map((name) => page.locator(`[data-run='${name}.mcap']`));
  await page.click("#whole");
  await left.locator("[data-reason='0']").waitFor();
  assert.equal(await right.locator("[data-reason='0']").count(), 0);
  assert.match(await right.locator("[data-tile=force] .note").textContent(), /no bound/);

  await page.goto(`${url}/#/recordings/torn.mcap`);
  await says(page, ".run .alert", "The recording has no end");
  assert.ok((await painted(page, "[data-chart=position] canvas")) > 500);
  await page.goto(`${url}/#/recordings/noise.mcap`);
  await says(page, "[role=alert]", "noise.mcap is no recording");
  await page.goto(`${url}/#/recordings/nothing.mcap`);
  await says(page, "[role=alert]", "There is no such recording.");
});

it("opens a recording at its first instant, and says one number of steps", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "off.mcap", "--without-limiter", "--duration-s", "3");
  const wall = new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "20"]);
  await server.program.ended;
  await wall.stop();
  const { url } = await startDash(test, "127.0.0.1:9", "--recordings", folder);
  const page = await visit(test, url, { at: `${url}/#/recordings/off.mcap` });
  const tile = (name, part) => page.locator(`[data-tile=${name}] .${part}`).textContent();
  await says(page, "[data-tile=mode] .name", "Force at 0\u00a0s");
  assert.equal(await tile("mode", "value"), "Idle", "no engine is there yet, and the end is not told as if it were all");
  assert.equal(await tile("energy", "name"), "Energy at 0\u00a0s");
  const steps = (await page.locator(".run .head .quiet").textContent()).match(/([\d\u202f]+) steps/)[1];
  assert.equal(await tile("state", "note"), `all ${steps} steps are shown`);
  assert.doesNotMatch(await tile("loss", "note"), /\d{3}/, "no third number of steps");

  // At the end, the force is zero. Without a limiter, the energy account of the device is negative.
  const box = await page.locator("[data-chart=force] .u-over").boundingBox();
  await page.mouse.move(box.x + box.width - 2, box.y + 20);
  await until("the tiles tell of the end", async () => Number((await tile("energy", "name")).match(/at ([\d.]+)/)?.[1]) > 2.5);
  assert.equal(await tile("energy", "value"), "0 mJ");
  assert.match(await tile("energy", "note"), /^may be given out: [\d.]+ mJ more came out than was put in$/);
});

it("shows the force by its components when the legend is told to", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "one.mcap", "--duration-s", "2");
  const wall = new Program(test, "virtual_wall", ["--server", server.address]);
  await server.program.ended;
  await wall.stop();
  const { url } = await startDash(test, "127.0.0.1:9", "--recordings", folder);
  const page = await visit(test, url, { at: `${url}/#/recordings/one.mcap` });
  await says(page, "[data-chart=force] .key", "applied");
  const keys = () => page.locator("[data-chart=force] .key:visible").count();
  assert.equal(await keys(), 3);
  const norms = await picture(page, "[data-chart=force] canvas");
  await page.click("[data-chart=force] .toggle:has-text('applied x y z')");
  await until("the picture is another one", async () => (await picture(page, "[data-chart=force] canvas")) !== norms);
  assert.equal(await keys(), 6);
  const box = await page.locator("[data-chart=force] .u-over").boundingBox();
  const value = async (name) => parseFloat((await page.locator("[data-chart=force] .key", { hasText: name }).locator(".value").textContent()).replace("−", "-"));
  let x = 0;
  for (let at = 2; at < box.width && !(x < 0); at += 8) {
    await page.mouse.move(box.x + at, box.y + 20);
    await new Promise((resolve) => setTimeout(resolve, 30));
    x = await value("applied x");
  }
  assert.ok(x < 0, "the wall pushes the hand towards -x");
  assert.ok(Math.abs(Math.hypot(x, await value("applied y"), await value("applied z")) - parseFloat(await page.locator("[data-chart=force] .key .value").nth(2).textContent())) < 0.02);
  await page.click("[data-chart=force] .toggle:has-text('applied x y z')");
  await until("they are gone again", async () => (await keys()) === 3);
});

/** Writes a recording with `count` steps at 1 kHz. This is done by repeating the steps of another recording. */
async function lengthen(from, to, count) {
  const reader = new McapStreamReader();
  reader.append(readFileSync(from));
  const [steps, schemas] = [[], new Map()];
  let channel;
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    if (record.type === "Schema") schemas.set(record.id, record);
    else if (record.type === "Channel" && record.topic.endsWith("haptic/step")) channel = record;
    else if (record.type === "Message" && record.channelId === channel?.id) steps.push(record);
  }
  const file = openSync(to, "w");
  let written = 0n;
  const writer = new McapWriter({
    writable: { position: () => written, write: async (bytes) => { written += BigInt(writeSync(file, bytes)); } },
    chunkSize: 1 << 20,
  });
  await writer.start({ profile: "", library: "" });
  const schemaId = await writer.registerSchema(schemas.get(channel.schemaId));
  const channelId = await writer.registerChannel({ ...channel, schemaId });
  const began = steps[0].logTime;
  for (let i = 0; i < count; ++i) {
    const at = began + BigInt(i) * 1_000_000n;
    await writer.addMessage({ channelId, sequence: i, logTime: at, publishTime: at, data: steps[i % steps.length].data });
  }
  await writer.end();
  closeSync(file);
}

it("reads a recording over ten minutes in parts, only those that it shows", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "short.mcap", "--duration-s", "1");
  await server.program.ended;
  await lengthen(join(folder, "short.mcap"), join(folder, "long.mcap"), 660_000);
  const size = statSync(join(folder, "long.mcap")).size;
  assert.ok(size > 48 * 1024 * 1024, "else it would be fetched whole");
  const { url } = await startDash(test, "127.0.0.1:9", "--recordings", folder);
  const page = await visit(test, url);
  let fetched = 0;
  page.on("response", (answer) => { fetched += answer.url().endsWith("/long.mcap") && answer.status() === 206 ? Number(answer.headers()["content-length"]) : 0; });
  const shown = () => page.locator(".run .head .quiet").textContent();

  await page.goto(`${url}/#/recordings/long.mcap`);
  await says(page, ".run .part", "This part: 0\u00a0s to 9\u00a0min 59\u00a0s");
  assert.match(await shown(), /· 600\ss · 600\u202f000 steps/);
  const began = (await shown()).split(" · ")[0];

  fetched = 0;
  await page.click("a:has-text('Go on from 10\u00a0min 0\u00a0s')");
  await says(page, ".run .part", "This part: 10\u00a0min 0\u00a0s to 10\u00a0min 59\u00a0s");
  assert.match(await shown(), /· 60\ss · 60\u202f000 steps/);
  assert.equal((await shown()).split(" · ")[0], began, "it is the same recording");
  assert.ok(fetched < size / 3, `${fetched} of ${size} bytes for an eleventh of the steps`);
  assert.ok((await painted(page, "[data-chart=position] canvas")) > 2000);
  assert.equal(Number(await page.locator(".scrubber .window").getAttribute("aria-valuenow")), 600);
  await page.click("#whole");
  await until("all of the part is shown", async () => Number((await page.locator("[data-tile=state] .note").textContent()).replace(/\D/g, "")) > 59_000);

  await page.click("a:has-text('From the beginning')");
  await says(page, ".run .part", "This part: 0\u00a0s");
  await page.goto(`${url}/#/recordings/long.mcap?from=3600`);
  await says(page, "[role=alert]", "long.mcap ends before 60\u00a0min 0\u00a0s.");
});
