// SPDX-License-Identifier: Apache-2.0
// This test runs real processes: a simulated stylus with six motors, and the peg in MuJoCo behind a network with a
// delay of 20 ± 5 ms and a loss of 2 %. TENDON_PROGRAMS is the folder of tendond, tendon-inject and tendon-report, and
// TENDON_TOUCH_MJCF the engine in C++.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { it, type TestContext } from "node:test";
import { kRoot } from "../typescript/support/paths.js";
import { findTendond, Program, scene } from "../typescript/support/program.js";

const kTypeScript = [process.execPath, join(kRoot, "clients/mujoco/dist/examples/peg_in_hole.js")];
const kTouchMjcf = process.env["TENDON_TOUCH_MJCF"];
const kCpp = kTouchMjcf ? [kTouchMjcf, join(kRoot, "clients/mujoco/cpp/peg.xml"), "--z-up"] : undefined;
const kNetwork = "delay=uniform(15ms,25ms) loss=2%";

/** Returns the output of tendon-report for a run of 4 s, or skips the test if the programs are missing. */
async function run(test: TestContext, command: readonly string[] | undefined, ...options: readonly string[]) {
  const tendond = findTendond(test);
  if (!tendond) return undefined;
  if (!command) {
    test.skip("the engine in C++ was not built, because libmujoco-dev is missing");
    return undefined;
  }
  const folder = mkdtempSync(join(tmpdir(), "peg-"));
  test.after(() => rmSync(folder, { recursive: true }));
  const [recording, programs] = [join(folder, "run.mcap"), join(tendond, "..")];
  const server = new Program(test, tendond,
    [scene("peg"), "--listen", "127.0.0.1:0", "--record", recording, "--duration-s", "4", "--json", ...options]);
  const { address } = JSON.parse(await server.line((line) => line.includes('"listening"')));
  const network = new Program(test, join(programs, "tendon-inject"),
    ["--listen", "127.0.0.1:0", "--to", address, "--profile", kNetwork, "--seed", "7", "--json"]);
  const { listen } = JSON.parse(await network.line((line) => line.includes('"listen"')));
  const engine = new Program(test, command[0]!, [...command.slice(1), "--server", listen, "--json"]);
  assert.equal(await server.end(), 0);
  assert.equal(await engine.end("SIGINT"), 0);
  await network.end("SIGINT"); // it may fail, because the network is worse than requested if the machine is busy
  const { summary } = JSON.parse(engine.lines.find((line) => line.startsWith('{"summary"'))!);
  assert.ok(summary.forces > 100 && summary.forces_unusable === 0, JSON.stringify(summary));
  // torque and stiffness were sent
  assert.ok(!engine.lines.some((line) => line.includes("is not sent")), engine.lines.join("\n"));
  const report = JSON.parse(execFileSync(join(programs, "tendon-report"), [recording, "--json"], { encoding: "utf8" }));
  test.diagnostic(`torques did ${report.torque_work_j.toFixed(3)} J, least energy ${report.least_energy_j.toExponential(2)} J, ` +
    `${report.forces_per_s.toFixed(0)} forces/s, ${report.loop_age_p50_ms.toFixed(0)} ms from the hand to the force, ` +
    `${report.overruns} overruns`);
  assert.ok(report.loop_age_p50_ms > 35 && report.lost_steps === 0);
  return report;
}

for (const [language, command] of [["TypeScript", kTypeScript], ["C++", kCpp]] as const) {
  it(`${language}: without the limiter the far peg shakes the hand`, async (test) => {
    const report = await run(test, command, "--without-limiter");
    if (!report) return;
    // energy_given_out_j is the complete ledger, including friction. torque_work_j is the work of the torques alone.
    assert.ok(report.energy_given_out_j > 0.3 && report.torque_work_j > 0.3, JSON.stringify(report));
  });

  it(`${language}: with the limiter it gives out nothing, at least −1 nJ`, async (test) => {
    const report = await run(test, command);
    if (!report) return;
    assert.ok(report.limiter_on && report.least_energy_j >= -1e-9, JSON.stringify(report));
    assert.ok(report.torque_work_j < 0.1, `torques did ${report.torque_work_j} J`);
    assert.ok(report.limited_percent_by_reason.energy > 5, "it had something to limit");
  });
}
