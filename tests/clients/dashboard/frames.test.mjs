// SPDX-License-Identifier: Apache-2.0
// Measures the 3-D view of four devices. The results depend on the machine, so it is not part of CI:
//
//   tests/clients/dashboard/run frames
//
// Measures the cost of a frame, and the wake-up lateness of the server's haptic threads with and without the open
// page, in alternation. Chromium computes WebGL on the CPU here.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { it } from "node:test";
import { visit } from "./browser.mjs";
import { scratch, startDash, startServer } from "./support.mjs";

const kSeconds = Number(process.env.TENDON_SECONDS ?? 10);
const kRounds = Number(process.env.TENDON_ROUNDS ?? 6);

const kScene = (name, frequency) => `
[device]
kind = "simulated"
name = "${name}"
profile = "touch"
axes = "right=x up=y user=z"
[device.rotation]
inertia_kg_m2 = 2e-5
viscous_friction_nm_s_per_rad = 2e-4
coulomb_friction_nm = 1e-3
max_torque_nm = 0.2
[device.rotation.hand]
stiffness_nm_per_rad = 0.3
damping_nm_s_per_rad = 2e-3
[device.rotation.hand.motion]
kind = "sine"
amplitude_deg = 30
frequency_hz = ${frequency}
direction = [0, 0, 1]
[device.hand]
profile = "stylus"
[device.hand.motion]
kind = "sine"
amplitude_mm = 20
frequency_hz = ${frequency}
direction = [1, 0.5, 0]
[limiter.rotation]
coulomb_friction_nm = 5e-4
viscous_friction_nm_s_per_rad = 1e-4
`;

/** Returns the cumulative counts of the lateness histogram in /metrics by upper bound, summed over all devices. */
async function lateness(url) {
  const text = await (await fetch(`${url}/metrics`)).text();
  const counts = new Map();
  for (const [, le, count] of text.matchAll(/^tendon_device_wakeup_lateness_seconds_bucket\{[^}]*le="([^"]+)"[^}]*\} (\S+)$/gm)) {
    counts.set(Number(le.replace("+Inf", "Infinity")), (counts.get(Number(le.replace("+Inf", "Infinity"))) ?? 0) + Number(count));
  }
  return counts;
}
const since = (before, now) => new Map([...now].map(([le, count]) => [le, count - (before.get(le) ?? 0)]));
/** Returns the smallest bound that includes this share of the samples, µs. */
function quantile(counts, share) {
  const bounds = [...counts.keys()].sort((a, b) => a - b);
  const all = counts.get(Infinity);
  return 1e6 * bounds.find((le) => counts.get(le) >= share * all);
}
const pause = (seconds) => new Promise((resolve) => setTimeout(resolve, 1000 * seconds));

/** Measures the frame intervals and the time in scripts and on the main thread. */
async function frames(page) {
  const client = await page.context().newCDPSession(page);
  await client.send("Performance.enable");
  const worked = async () => Object.fromEntries((await client.send("Performance.getMetrics")).metrics.map(({ name, value }) => [name, value]));
  const before = await worked();
  const times = await page.evaluate((seconds) => new Promise((resolve) => {
    const at = [];
    const next = (now) => (at.push(now), now - at[0] < 1000 * seconds ? requestAnimationFrame(next) : resolve(at));
    requestAnimationFrame(next);
  }), kSeconds);
  const after = await worked();
  const gaps = times.slice(1).map((t, i) => t - times[i]).sort((a, b) => a - b);
  const per = (name) => (1000 * (after[name] - before[name])) / gaps.length;
  return { frames: gaps.length, p50_ms: gaps[Math.floor(gaps.length / 2)], p99_ms: gaps[Math.floor(0.99 * gaps.length)], script_ms: per("ScriptDuration"), main_thread_ms: per("TaskDuration") };
}

it("the 3-D view of four devices", { timeout: 600_000 }, async (test) => {
  const folder = scratch(test);
  const scenes = [0.7, 0.9, 1.1, 1.3].map((frequency, i) => {
    const path = join(folder, `${i}.toml`);
    writeFileSync(path, kScene(`d${i}`, frequency));
    return path;
  });
  const server = await startServer(test, folder, scenes);
  const { url } = await startDash(test, server.address);
  await pause(3);
  for (let round = 0; round < kRounds; ++round) {
    const alone = await lateness(url);
    await pause(kSeconds);
    const without = since(alone, await lateness(url));
    const page = await visit(test, url);
    await page.click("#space");
    await page.locator(".handle").nth(3).waitFor();
    await pause(2);
    const open = await lateness(url);
    const seen = await frames(page);
    const beside = since(open, await lateness(url));
    await page.close();
    const told = (counts) => `p50 ${quantile(counts, 0.5)} p99 ${quantile(counts, 0.99)} p99.9 ${quantile(counts, 0.999)} µs of ${counts.get(Infinity)}`;
    console.log(JSON.stringify(seen));
    console.log(`late without: ${told(without)}; with the page: ${told(beside)}`);
    await pause(1);
  }
});
