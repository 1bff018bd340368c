// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { engage, painted, picture, says, shown, visit } from "./browser.mjs";
import { Program, makeKeys, metric, scratch, startDash, startPair, startServer, until } from "./support.mjs";

it("shows the server live, pauses when told to, and goes on", async (test) => {
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
  assert.match(await page.locator(".why").textContent(), /^(For .* N \(median\)|In these .*felt)/);
  for (const chart of ["force", "position", "energy"]) assert.ok((await painted(page, `[data-chart=${chart}] canvas`)) > 2000, chart);

  await page.click("#pause");
  await page.locator("#pause[aria-pressed=true]").waitFor();
  await page.locator(".scrubber").waitFor();
  const coming = await shown(page);
  let still = "";
  await until("the last frame is drawn", async () => still === (still = await picture(page, "[data-chart=position] canvas")));
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
  assert.equal(await page.locator(".coupling").isVisible(), false, "there is no coupling");
});

it("shows both ends of a coupling, engages and disengages them", async (test) => {
  const folder = scratch(test);
  const { leader, follower } = await startPair(test, folder);
  const { url, operatorUrl } = await startDash(test, leader.address, "--key", join(folder, "operator.key"), "--arm", "main");
  const page = await visit(test, url, { at: operatorUrl });
  await says(page, "[data-tile=port-own]", "This end (leader)Coupled");
  await says(page, "[data-tile=port-peer]", "Other end (follower)Coupled");
  assert.equal(await page.locator("#disengage").isDisabled(), true);
  await engage(page);
  await says(page, ".coupling .result[data-level=good]", "Engaged: the two handles are coupled.");
  for (const end of ["own", "peer"]) await says(page, `[data-tile=port-${end}][data-level=good] .value`, "Engaged");
  await says(page, "[data-tile=port-pair] .value", "mJ");
  assert.match(await page.locator("[data-tile=port-trip] .value").textContent(), /^[\d.]+\sms$/);
  for (const chart of ["ends", "touch", "accounts"]) await until(chart, async () => (await painted(page, `[data-chart=${chart}] canvas`)) > 2000);
  const newest = (chart, name) => page.locator(`[data-chart=${chart}] .key`, { hasText: name }).locator(".value").textContent();
  await until("the wall is felt", async () => Number(await newest("touch", "contact of the follower")) > 0.2 && Number(await newest("touch", "felt at the leader")) > 0.2);
  assert.equal(await metric(url, 'tendon_port_phase{device="leader",end="peer",phase="engaged"}'), 1);
  assert.ok((await metric(url, 'tendon_port_pair_joules{device="leader"}')) > 0);
  const { url: other } = await startDash(test, follower.address);
  const phone = await visit(test, other, { viewport: { width: 390, height: 844 } });
  await says(phone, "[data-tile=port-own]", "This end (follower)Engaged");
  assert.equal(await phone.locator("#engage").isVisible(), false, "it only looks on");
  assert.equal(await phone.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true, "a phone scrolls down, not sideways");
  await page.click("#disengage");
  await says(page, "[data-tile=port-own] .value", "Coupled");
  await says(page, ".coupling .result[data-level=good]", "Disengaged");
  await follower.program.stop();
  await says(page, "[data-tile=port-peer] .note", "nothing is heard of it");
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

it("says that there is no such page, and shows the pages there are", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  const page = await visit(test, url, { at: `${url}/#/nonsense` });
  await says(page, "[role=alert]", "There is no page at #/nonsense.");
  assert.equal(await page.locator("main.live").count(), 0);
  await page.goto(`${url}/#/recordings/%zz`);
  await says(page, "[role=alert]", "There is no page at #/recordings/%zz.");
  await page.click("main a:has-text('Live')");
  await page.locator("main.live").waitFor();
});

/** The hand is 8 mm deep in a wall. A request armed the device, and the operator has its own channel. */
const kGuarded = `
[device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 8
mass_kg = 0.05
[device.hand.motion]
kind = "ramp-hold"
from_mm = [7.9, 0, 0]
to_mm = [8, 0, 0]
ramp_ms = 100
[safety]
arm = "by request"
[[channel]]
name = "wall"
lease_ms = 500
[[channel]]
name = "operator"
[network]
keys = "keys"
`;

async function guarded(test) {
  const folder = scratch(test);
  await makeKeys(test, folder, ["engine", "operator", "colleague"]);
  await makeKeys(test, folder, ["screen"], "--observer");
  writeFileSync(join(folder, "guarded.toml"), kGuarded);
  const server = await startServer(test, folder, [join(folder, "guarded.toml")], "--record", "/dev/null");
  const key = (name) => ["--key", join(folder, `${name}.key`)];
  new Program(test, "virtual_wall", ["--server", server.address, "--device", "guarded", "--channel", "wall", "--rate-hz", "200", "--stiffness-n-per-m", "300", ...key("engine")]);
  return { server, key };
}
const applied = async (page) => parseFloat(await page.locator("[data-tile=force] .value").textContent());
const result = (page, level, text) => says(page, `.arming .result[data-level=${level}]`, text);

it("two buttons arm and disarm beside a running engine and say the result", async (test) => {
  const { server, key } = await guarded(test);
  const { url, operatorUrl, program } = await startDash(test, server.address, ...key("operator"), "--arm", "operator");
  const page = await visit(test, url, { at: operatorUrl });
  assert.equal(page.url(), `${url}/#/live`, "nobody reads the pass off the screen, or in the history");
  await says(page, ".engine", "virtual_wall");
  await says(page, ".arming", "Ready, not armed: gives no force until it is armed.");
  await until("no force is given", async () => (await applied(page)) === 0);
  await page.click("#arm");
  await result(page, "good", "Armed: the device exerts forces.");
  await says(page, "[data-tile=state] .value", "Armed");
  await until("force is given", async () => (await applied(page)) > 0);

  await page.click("#disarm");
  await result(page, "good", "Disarmed: no force until the device is armed again.");
  await says(page, ".arming", "Disarmed: gives no force until it is armed again.");
  await until("no force is given", async () => (await applied(page)) === 0);
  await says(page, ".reasons", "Disarmed");
  const before = await shown(page);
  await until("time passes", async () => (await shown(page)) > before + 500);
  assert.equal(await applied(page), 0, "though the engine goes on");

  await page.click("#arm");
  await result(page, "good", "Armed: the device exerts forces.");
  await until("force is given again", async () => (await applied(page)) > 0);

  // When another operator disarms the device, the result of the previous press disappears.
  const { url: elsewhere, operatorUrl: colleagues } = await startDash(test, server.address, ...key("colleague"), "--arm", "operator");
  const authorization = `Bearer ${colleagues.split("/").at(-1)}`;
  await until("the colleague has disarmed it", async () => {
    await fetch(`${elsewhere}/api/disarm?device=0`, { method: "POST", headers: { origin: elsewhere, authorization } });
    return page.locator(".arming", { hasText: "Disarmed: gives no force until it is armed again." }).isVisible();
  });
  assert.equal(await page.locator(".arming .result").isVisible(), false);
  assert.equal(server.program.lines.filter((line) => /refused|denied/.test(line)).length, 0);
  assert.ok(program.process.exitCode === null);
});

it("arms nothing by a channel that an engine holds, and says who holds it", async (test) => {
  const { server, key } = await guarded(test);
  const { url, operatorUrl } = await startDash(test, server.address, ...key("operator"), "--arm", "wall");
  const page = await visit(test, url, { at: operatorUrl });
  await says(page, ".arming .needs", '"virtual_wall" holds the channel "wall", until 500 ms after its last force. It is not taken over.');
  for (const button of ["#arm", "#disarm"]) assert.equal(await page.locator(button).isDisabled(), true, button);
  const authorization = `Bearer ${operatorUrl.split("/").at(-1)}`;
  const answer = await fetch(`${url}/api/disarm?device=0`, { method: "POST", headers: { origin: url, authorization } });
  assert.equal(answer.status, 409);
  assert.match(await answer.text(), /^"virtual_wall" holds the channel/);
});

it("without leave to arm: no button, how to get one, closed to other pages", async (test) => {
  const { server, key } = await guarded(test);
  const { url } = await startDash(test, server.address, ...key("screen"));
  const page = await visit(test, url);
  await says(page, ".arming .needs", "start tendon-dash with --key FILE (a controller's key) and --arm CHANNEL");
  for (const button of ["#arm", "#disarm"]) assert.equal(await page.locator(button).isVisible(), false, button);
  const post = async (where, headers) => (await fetch(`${where}/api/arm?device=0`, { method: "POST", headers })).status;
  assert.equal(await post(url, { origin: url }), 403);
  const { url: open, operatorUrl } = await startDash(test, server.address, ...key("operator"), "--arm", "operator");
  const authorization = `Bearer ${operatorUrl.split("/").at(-1)}`;
  assert.equal(await post(open, { authorization }), 403);
  assert.equal(await post(open, { authorization, origin: "http://evil.example" }), 403);
  assert.equal(await post(open, { authorization, origin: url }), 403, "a page of another program on this machine");
  assert.equal(await post(open, { authorization, origin: open, "x-forwarded-for": "192.0.2.7" }), 403);
  assert.equal(await post(open, { origin: open }), 403, "somebody else who uses this machine");
  const onlooker = await visit(test, open);
  await says(onlooker, ".arming .needs", "open the address that tendon-dash printed when it started");
  for (const button of ["#arm", "#disarm"]) assert.equal(await onlooker.locator(button).isVisible(), false, button);
  const late = await visit(test, open, { at: `${open}/#/operator/${"0".repeat(32)}` });
  await late.click("#arm");
  await says(late, ".arming .result[data-level=bad]", "the token is missing, or from another run");
  assert.equal((await fetch(`${open}/api/arm?device=0`)).status, 405);
  const observer = new Program(test, "tendon-dash", ["--server", server.address, "--listen", "127.0.0.1:0", ...key("screen"), "--arm", "operator"]);
  assert.equal(await observer.ended, 1);
  assert.match(observer.lines.join("\n"), /expected a controller's key for --arm, found an observer's key/);
  const keyless = new Program(test, "tendon-dash", ["--server", server.address, "--listen", "127.0.0.1:0", "--arm", "operator"]);
  assert.equal(await keyless.ended, 2);
});
