// SPDX-License-Identifier: Apache-2.0
// Measures the time from the sample of a state until it arrives at the client of Foxglove. The reference is half of the
// round trip of a WebSocket ping on the same connection. This test is not part of CI: use foxglove-latency to run it.
import { readFileSync } from "node:fs";
import { it } from "node:test";
import { Viewer } from "./foxglove_client.mjs";
import { scratch, startDash, startServer, until } from "./support.mjs";

const kSteps = 20_000;

const quantile = (sorted, q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))].toFixed(2);
const summary = (values) => {
  const sorted = values.toSorted((a, b) => a - b);
  return `p50 ${quantile(sorted, 0.5)} ms, p99 ${quantile(sorted, 0.99)} ms, n = ${sorted.length}`;
};

/** Returns the CPU time of a process, from fields of /proc/PID/stat in units of 10 ms. */
function usedMs(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ");
  return 10 * (Number(fields[11]) + Number(fields[12]));
}

it("measures", { timeout: 120_000 }, async (test) => {
  const server = await startServer(test, scratch(test), ["demo"], "--record", "/dev/null");
  const { address, program } = await startDash(test, server.address);
  const viewer = new Viewer(test, address);
  const { messages: reports } = await viewer.subscribe("/demo/device");
  const { messages: steps } = await viewer.subscribe("/haptic/step");
  // The first time stamps precede a good estimate of the clock offset.
  await until("a few reports come", () => reports.length >= 5);
  steps.length = 0;
  const began = { at: performance.now(), used: usedMs(program.process.pid) };
  const pings = [];
  let asked = 0n;
  viewer.socket.on("pong", () => pings.push(Number(process.hrtime.bigint() - asked) / 2e6));
  const pinging = setInterval(() => {
    asked = process.hrtime.bigint();
    viewer.socket.ping();
  }, 20);
  await until("enough steps come", () => steps.length >= kSteps);
  clearInterval(pinging);
  // A report has the same time on the server's clock (CLOCK_MONOTONIC, like hrtime) and in Foxglove.
  const report = reports.at(-1);
  const offset = report.time - BigInt(report.until_ns);
  const late = steps.map((step) => Number(step.now - (step.time - offset)) / 1e6);
  test.diagnostic(`sample → message: ${summary(late)}`);
  test.diagnostic(`floor, half a ping: ${summary(pings)}`);
  const share = (usedMs(program.process.pid) - began.used) / (performance.now() - began.at);
  test.diagnostic(`tendon-dash used ${(100 * share).toFixed(1)} % of a processor`);
});
