// SPDX-License-Identifier: Apache-2.0
//
// The page on a live server, as a person uses it.
import assert from "node:assert/strict";
import { it } from "node:test";
import { painted, picture, says, shown, visit } from "./browser.mjs";
import { Program, scratch, startDash, startServer, until } from "./support.mjs";

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
  assert.match(await page.locator("[data-tile=delay] .value").textContent(), /^[\d.]+\s[mµ]s$/);
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
