// SPDX-License-Identifier: Apache-2.0
// Uses the page in Chromium.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join } from "node:path";
import { after, test } from "node:test";
import { painted, picture, visit } from "../../clients/dashboard/browser.mjs";
import { kRoot, until } from "../../clients/dashboard/support.mjs";

const kTypes = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm" };
const server = createServer(async ({ url }, answer) => {
  const name = url === "/" ? "/index.html" : url;
  answer.setHeader("Content-Type", kTypes[extname(name)]);
  answer.end(await readFile(join(process.env.TENDON_PLAYGROUND, name)));
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
after(() => server.close());
const url = `http://127.0.0.1:${server.address().port}/`;

async function open(t, hash = "", more = {}) {
  const page = await visit(t, url, { at: url + hash, permissions: ["clipboard-read", "clipboard-write"], ...more });
  await page.locator("#stage[data-t]").waitFor();
  return page;
}
const time = (page) => page.locator("#stage").getAttribute("data-t").then(Number);
const wish = async (page) => (await page.locator("#stage").getAttribute("data-wish")).split(" ").map(Number);
const values = (page) => page.locator("input[type=range], select").evaluateAll((all) => all.map(({ id, value }) => `${id}=${value}`).join("&"));

test("the wall generates energy without a limiter and none with one", async (t) => {
  const page = await open(t);
  await page.locator("#verdict.bad").waitFor();
  for (const canvas of ["#stage", "#positions", "#forces", "#energies"]) assert.ok((await painted(page, canvas)) > 100, canvas);
  const before = await picture(page, "#positions");
  await until("the picture moves", async () => (await picture(page, "#positions")) !== before);
  await page.locator("#law").selectOption("feel");
  await page.locator("#verdict.good").waitFor();
  await until("two seconds", async () => (await time(page)) > 2);
  assert.equal(await page.locator("#verdict.good").count(), 1);
});

test("everything works with the keyboard, and has a name", async (t) => {
  const page = await open(t);
  const named = [];
  for (let i = 0; i < 13; ++i) {
    await page.keyboard.press("Tab");
    const { id, name } = await page.evaluate(() => {
      const { id, ariaLabel, labels, textContent } = document.activeElement;
      return { id, name: ariaLabel || labels?.[0]?.textContent || textContent };
    });
    if (id) named.push(id);
    assert.ok(!id || name.trim() !== "", id);
  }
  const expected = ["stage", "law", "delay", "jitter", "loss", "stiffness", "seed", "alone", "share", "copy", "reset", "command"];
  assert.deepEqual(named, expected);

  await page.locator("#stage").focus();
  await page.keyboard.down("ArrowRight");
  await until("the hand moves", async () => (await wish(page))[0] > 0.01);
  await page.keyboard.up("ArrowRight");
  assert.equal(await page.locator("#alone").isChecked(), false);
  await page.locator("#delay").focus();
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.locator("#delay-value").textContent(), "21 ms");
  await page.locator("#law").focus();
  await page.keyboard.type("feel");
  assert.match(await values(page), /law=feel/);
});

test("the mouse is the hand", async (t) => {
  const page = await open(t);
  const box = await page.locator("#stage").boundingBox();
  await page.mouse.move(box.x + box.width / 2 + 30, box.y + box.height / 2 - 20);
  const [x, y] = await until("the hand follows", async () => (await wish(page))[1] !== 0 && wish(page));
  assert.ok(x > 0.003 && y > 0.002);
});

test("the address keeps the settings, and says what is wrong with others", async (t) => {
  const page = await open(t, "#delay=80&jitter=0&loss=3&stiffness=500&seed=9&law=aol");
  assert.equal(await values(page), "law=aol&delay=80&jitter=0&loss=3&stiffness=500&seed=9");
  await page.locator("#delay").fill("60");
  await page.locator("#share").click();
  const shared = await page.evaluate(() => navigator.clipboard.readText());
  assert.equal(shared, page.url());
  const other = await open(t, shared.slice(url.length));
  assert.equal(await values(other), "law=aol&delay=60&jitter=0&loss=3&stiffness=500&seed=9");
  const wrong = await open(t, "#delay=200&law=best&speed=1");
  const said = await wrong.locator("#said").textContent();
  for (const word of ['delay: expected 0 to 150 in steps of 1, found "200"', 'law: expected one of the list, found "best"', '"speed" is not']) assert.ok(said.includes(word), said);
  assert.match(await values(wrong), /delay=20&/);
});

test("tendon-lab accepts the command of each law", async (t) => {
  const page = await open(t, "#delay=31&jitter=40&loss=7&stiffness=150&seed=12");
  for (const law of await page.locator("#law option").allTextContents()) {
    await page.locator("#law").selectOption(law);
    await page.locator("#command", { hasText: `--law ${law} ` }).waitFor();
    await page.locator("#copy").click();
    await page.locator("#said", { hasText: "Command copied." }).waitFor();
    const line = await page.evaluate(() => navigator.clipboard.readText());
    assert.match(line, /delay=uniform\(0ms,71ms\) memory=20ms loss=7%' --stiffness 150 .* --first-seed 12$/);
    const command = line.replace("build/release/bin", process.env.TENDON_PROGRAMS);
    const done = spawnSync("sh", ["-c", `${command} --for-s 1.01`], { cwd: kRoot, encoding: "utf8" });
    assert.equal(done.status, 0, line + done.stderr);
  }
});

test("the page fits a phone, light and dark", async (t) => {
  const papers = [];
  for (const colorScheme of ["light", "dark"]) {
    const page = await open(t, "", { viewport: { width: 390, height: 844 }, colorScheme });
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
    for (const control of await page.locator("input, select, button").all()) {
      const { x, width, height } = await control.boundingBox();
      assert.ok(x >= 0 && x + width <= 390 && height >= 19, await control.getAttribute("id"));
    }
    papers.push(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
  }
  assert.notEqual(papers[0], papers[1]);
});

test("the worker is faster than real time", async (t) => {
  const page = await open(t);
  const speeds = await page.evaluate(async () => {
    const worker = new Worker("worker.js");
    const answer = (key) => new Promise((resolve) => worker.addEventListener("message", ({ data }) => key in data && resolve()));
    worker.postMessage({ settings: [20, 5, 2, 2000, 7, 0], x: -0.015, y: 0 });
    await answer("command");
    const speeds = [];
    for (let i = 0; i < 3; ++i) {
      const before = performance.now();
      worker.postMessage({ count: 10_000, x: i % 2 ? 0.015 : -0.015, y: 0, columns: 10 });
      await answer("rows");
      speeds.push(10_000 / (performance.now() - before));
    }
    return speeds;
  });
  t.diagnostic(`${speeds.map(Math.round)} times real time`);
  assert.ok(Math.max(...speeds) > 1, speeds.join());
});
