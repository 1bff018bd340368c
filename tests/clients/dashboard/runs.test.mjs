// SPDX-License-Identifier: Apache-2.0
//
// The page on recordings, as a person uses it.
import assert from "node:assert/strict";
import { copyFileSync, truncateSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { painted, picture, says, visit } from "./browser.mjs";
import { Program, scratch, startDash, startServer, until } from "./support.mjs";

it("opens recordings, scrubs them, and shows two side by side", async (test) => {
  const folder = scratch(test);
  const record = async (name, ...more) => {
    const server = await startServer(test, folder, ["demo"], "--record", `${name}.mcap`, "--duration-s", "2", ...more);
    const wall = new Program(test, "virtual_wall", ["--server", server.address, "--rate-hz", "100"]);
    await server.program.ended;
    await wall.stop();
  };
  await Promise.all([record("one"), record("two", "--without-limiter")]);
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
