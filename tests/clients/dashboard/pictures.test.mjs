// SPDX-License-Identifier: Apache-2.0
// Updates the pictures in deploy/screenshots, which a person should check after changes of the page:
//
//   tests/clients/dashboard/run pictures
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { engage, says, shown, visit } from "./browser.mjs";
import { fakeFeed } from "./fake_feed.mjs";
import { Program, kRoot, makeKeys, scratch, startDash, startPair, startServer, until } from "./support.mjs";

const shoot = (page, name, more = {}) => page.screenshot({ path: join(kRoot, "deploy/screenshots", `${name}.png`), ...more });
const kDark = { colorScheme: "dark", viewport: { width: 1280, height: 960 } };
const kLight = { colorScheme: "light", viewport: { width: 1280, height: 960 } };
const kPhone = { colorScheme: "light", viewport: { width: 390, height: 844 } };

/** Starts a simulated bad network in front of the server. Returns the address for clients. */
async function inject(test, server, profile) {
  const program = new Program(test, "tendon-inject", ["--listen", "127.0.0.1:0", "--to", server, "--profile", profile, "--seed", "8", "--json"]);
  return JSON.parse(await program.line('"start"')).listen;
}

const kScene = (fastest) => `
[device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05
[device.hand.motion]
kind = "ramp-hold"
from_mm = [-10, 0, 0]
to_mm = [15, 0, 0]
ramp_ms = 400
hold_ms = 900
[limiter]
kind = "aol+"
[limiter.energy_cap]
[limiter.robust_ledger]
[limiter.knee]
[safety]
arm = "by request"
[safety.speed_trip]
max_m_per_s = ${fastest}
[[channel]]
name = "main"
lease_ms = 500
[[channel]]
name = "operator"
[network]
keys = "keys"
`;

/** Starts a device that is armed from the page, and an engine behind a network with a delay of 20 ms. */
async function armed(test, name, fastest) {
  const folder = scratch(test);
  await makeKeys(test, folder, ["engine", "operator"]);
  writeFileSync(join(folder, `${name}.toml`), kScene(fastest));
  const server = await startServer(test, folder, [join(folder, `${name}.toml`)], "--record", "run.mcap");
  const near = await inject(test, server.address, "delay=20ms loss=1%");
  new Program(test, "virtual_wall", ["--server", near, "--device", name, "--channel", "main", "--key", join(folder, "engine.key")]);
  const { url, operatorUrl } = await startDash(test, server.address, "--key", join(folder, "operator.key"), "--arm", "operator", "--recordings", folder);
  const page = await visit(test, url, { ...kLight, at: operatorUrl });
  await says(page, ".engine", "virtual_wall");
  await page.click("#arm");
  return { page, url, operatorUrl };
}

it("live, paused, on a phone", async (test) => {
  const { page, url, operatorUrl } = await armed(test, "falcon-right", 3);
  await says(page, ".arming .result[data-level=good]", "Armed: the device exerts forces.");
  await until("ten seconds are shown", async () => (await shown(page)) > 10_000);
  await shoot(page, "live-light");
  const dark = await visit(test, url, { ...kDark, at: operatorUrl });
  const phone = await visit(test, url, { ...kPhone, at: operatorUrl });
  await until("seconds are shown", async () => (await shown(dark)) > 8000 && (await shown(phone)) > 8000);
  await dark.click("#pause");
  await dark.locator(".scrubber").waitFor();
  await shoot(dark, "paused-dark");
  await shoot(phone, "phone", { fullPage: true });
});

it("in a fault", async (test) => {
  const { page } = await armed(test, "falcon-right", 0.03);
  await says(page, "[data-tile=state] .value", "Fault");
  await until("five seconds are shown", async () => (await shown(page)) > 8000);
  await shoot(page, "fault");
});

it("a recording, and two side by side", async (test) => {
  const folder = scratch(test);
  for (const [name, ...more] of [["far"], ["far-off", "--without-limiter"]]) {
    const server = await startServer(test, folder, ["demo"], "--record", `${name}.mcap`, "--duration-s", "12", ...more);
    const near = await inject(test, server.address, "delay=30ms");
    const wall = new Program(test, "virtual_wall", ["--server", near]);
    await server.program.ended;
    await wall.stop();
  }
  const server = await startServer(test, folder, ["demo"], "--record", "/dev/null");
  const { url } = await startDash(test, server.address, "--recordings", folder);
  const page = await visit(test, url, { ...kLight, at: `${url}/#/recordings/far.mcap` });
  await says(page, ".contact", "connected");
  await says(page, ".lateness .words", "within");
  await page.click("#zoom-in");
  await shoot(page, "recording");
  const dark = await visit(test, url, { ...kDark, viewport: { width: 1600, height: 1200 } });
  await dark.click("nav a:has-text('Recordings')");
  for (const name of ["far-off", "far"]) await dark.check(`[aria-label='Compare ${name}.mcap']`);
  await dark.click("#compare");
  await dark.locator(".runs.two .run .lateness").nth(1).waitFor();
  await shoot(dark, "side-by-side-dark");
});

it("four devices in 3-D, on a desk and on a phone", async (test) => {
  const { url } = await startDash(test, "127.0.0.1:9");
  for (const [name, options] of [["space-dark", kDark], ["space-phone", { ...kPhone, hasTouch: true, isMobile: true, deviceScaleFactor: 2 }]]) {
    const page = await visit(test, url, { ...options, before: (made) => fakeFeed(made, { until: 9200 }) });
    await page.click("#space");
    await page.locator(".handle").nth(3).waitFor();
    await until("its states are drawn", async () => (await shown(page)) >= 9200);
    await page.waitForTimeout(500);
    await shoot(page, name);
  }
});

it("a recording in 3-D: pressed into a wall", async (test) => {
  const folder = scratch(test);
  const server = await startServer(test, folder, ["demo"], "--record", "wall.mcap", "--duration-s", "5");
  const wall = new Program(test, "virtual_wall", ["--server", server.address, "--local-model", "--stiffness-n-per-m", "800"]);
  await server.program.ended;
  await wall.stop();
  const next = await startServer(test, folder, ["demo"], "--record", "/dev/null");
  const { url } = await startDash(test, next.address, "--recordings", folder);
  const page = await visit(test, url, { ...kLight, at: `${url}/#/recordings/wall.mcap` });
  await says(page, ".contact", "connected");
  await page.locator("[data-chart=position]").waitFor();
  await page.click("#space");
  await page.locator(".handle").waitFor();
  const values = () => page.locator(".handle .values").textContent();
  for (let share = 350; share < 1000 && !/ [2-9]\.\d+ mm in the surface/.test(await values()); share += 10) {
    await page.locator(".seek input").fill(String(share));
    await page.waitForTimeout(150);
  }
  await shoot(page, "space-recording");
});

it("both ends of a coupling", async (test) => {
  const folder = scratch(test);
  const { leader } = await startPair(test, folder, "delay=uniform(15ms,25ms) loss=2%");
  const { url, operatorUrl } = await startDash(test, leader.address, "--key", join(folder, "operator.key"), "--arm", "main");
  const page = await visit(test, url, { ...kLight, viewport: { width: 1280, height: 650 }, at: operatorUrl });
  await engage(page);
  await says(page, "[data-tile=port-peer] .value", "Engaged");
  await until("twelve seconds are shown", async () => (await shown(page)) > 12_000);
  await shoot(page, "coupling");
});
