// SPDX-License-Identifier: Apache-2.0
//
// The page in Chromium, as a person uses it: TENDON_BROWSER names the program.
import assert from "node:assert/strict";
import { copyFileSync, truncateSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, it } from "node:test";
import { packageOf, Program, scratch, startDash, startServer, until } from "./support.mjs";

const { chromium } = packageOf("clients/dashboard/page", "playwright-core");
let browser;
before(async () => {
  browser = await chromium.launch({ executablePath: process.env.TENDON_BROWSER, args: ["--no-sandbox", "--disable-gpu"] });
});
after(() => browser?.close());

/** A page that has looked nowhere but at tendon-dash, and against whose policy nothing was done. */
async function visit(test, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !/WebSocket|status of 404/.test(message.text()) && wrong.push(message.text()));
  page.on("request", (request) => !request.url().startsWith(url) && !request.url().startsWith("data:") && wrong.push(request.url()));
  test.after(async () => {
    await context.close();
    assert.deepEqual(wrong, []);
  });
  await page.goto(url);
  return page;
}

const shown = (page) => page.locator("main.live").getAttribute("data-states").then(Number);
const says = (page, selector, text) => page.locator(selector, { hasText: text }).first().waitFor();
/** Pixels of a plot that are not empty. */
const painted = (page, selector) =>
  page.locator(selector).first().evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
    return count;
  });
/** What the plots look like: a text that is another one when a pixel is. */
const picture = (page, selector) => page.locator(selector).first().evaluate((canvas) => canvas.toDataURL());

it("shows live what the server does, stands still when it is told to, and goes on", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "/dev/null");
  new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "200"]);
  const { url } = await startDash(test, server.address, "--recordings", folder);
  const page = await visit(test, url);
  await says(page, ".contact", `connected to ${server.address}`);
  await until("states come", async () => (await shown(page)) > 500);
  await says(page, "[data-tile=state] .value", "Gives forces");
  await says(page, "[data-tile=mode] .value", "Active");
  await says(page, ".engine", "virtual_wall");
  await says(page, ".lateness .words", "99\u00a0% within");
  assert.match(await page.locator("[data-tile=delay] .value").textContent(), /ms$/);
  assert.match(await page.locator(".why").textContent(), /^(For|In these) /);
  for (const chart of ["force", "position", "energy"]) assert.ok((await painted(page, `[data-chart=${chart}] canvas`)) > 2000, chart);

  await page.click("#pause");
  await page.locator("#pause[aria-pressed=true]").waitFor();
  await page.locator(".scrubber").waitFor();
  const coming = await shown(page);
  const still = await picture(page, "[data-chart=position] canvas");
  await until("states come all the same", async () => (await shown(page)) > coming + 200);
  assert.equal(await picture(page, "[data-chart=position] canvas"), still);
  await page.click("#zoom-in");
  await until("the picture is another one", async () => (await picture(page, "[data-chart=position] canvas")) !== still);
  await page.click("#pause");
  await page.locator(".scrubber").waitFor({ state: "hidden" });
  const moving = await picture(page, "[data-chart=position] canvas");
  await until("the picture moves again", async () => (await picture(page, "[data-chart=position] canvas")) !== moving);

  await server.program.stop();
  await says(page, ".contact[data-level=bad]", "lost");
  await says(page, "[data-tile=state] .value", "Not connected");
});

it("shows the device that was chosen", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["left", "right"], "--record", "/dev/null");
  const { url } = await startDash(test, server.address);
  const page = await visit(test, url);
  await page.locator("#device option").nth(1).waitFor({ state: "attached" });
  assert.deepEqual(await page.locator("#device option").allTextContents(), ["left", "right"]);
  await until("states of the first come", async () => (await shown(page)) > 100);
  const x = () => page.locator("[data-chart=position] .legend .value").nth(1).textContent();
  await page.selectOption("#device", "1");
  await until("there are fewer again: those of the second", async () => (await shown(page)) > 50);
  assert.ok(await x());
  assert.equal(await page.locator("nav a", { hasText: "Recordings" }).isVisible(), false, "there is no folder");
});

it("says in words that nobody answers, and finds the server when it comes", async (test) => {
  const folder = scratch(test);
  const first = await startServer(test, folder, ["minimal"], "--record", "/dev/null");
  await first.program.stop();
  const { url } = await startDash(test, first.address);
  const page = await visit(test, url, { viewport: { width: 390, height: 844 }, colorScheme: "dark" });
  await says(page, ".contact[data-level=bad]", "is tendond running there?");
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true, "a phone scrolls down, not sideways");
  const back = (colour) => page.evaluate(() => getComputedStyle(document.body).backgroundColor).then((found) => assert.equal(found, colour));
  await back("rgb(14, 18, 23)");
  await page.click("#theme");
  await back("rgb(243, 245, 247)");
  await startServer(test, folder, ["minimal"], "--record", "/dev/null", "--listen", first.address);
  await says(page, ".contact[data-level=good]", "connected");
  await until("states come", async () => (await shown(page)) > 50);
});

it("opens recordings, scrubs them, and shows two side by side", async (test) => {
  const folder = scratch(test);
  for (const [name, more] of [["one", []], ["two", ["--without-limiter"]]]) {
    const server = await startServer(test, folder, ["demo"], "--record", `${name}.mcap`, "--duration-s", "2", ...more);
    const wall = new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "100"]);
    await server.program.ended;
    await wall.stop();
  }
  // The server was killed: no index, and half of a piece at the end.
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
  assert.match(await page.locator(".run .head .quiet").textContent(), /· \d+(\.\d+)?\ss · [\d\u202f]+ steps · /);
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
  // Without a limiter nothing is limited by energy; with it something is.
  const [left, right] = ["one", "two"].map((name) => page.locator(`[data-run='${name}.mcap']`));
  await page.click("#whole");
  await left.locator("[data-reason='0']").waitFor();
  assert.equal(await right.locator("[data-reason='0']").count(), 0);
  assert.match(await right.locator("[data-tile=force] .note").textContent(), /no bound/);

  await page.goto(`${url}/#/recordings/torn.mcap`);
  await says(page, ".run .alert", "It has no end");
  assert.ok((await painted(page, "[data-chart=position] canvas")) > 500);
  await page.goto(`${url}/#/recordings/noise.mcap`);
  await says(page, "[role=alert]", "noise.mcap is no recording");
  await page.goto(`${url}/#/recordings/nothing.mcap`);
  await says(page, "[role=alert]", "There is no such recording.");
});
