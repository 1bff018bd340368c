// SPDX-License-Identifier: Apache-2.0
// Compares the engine in C++ (clients/mujoco/cpp) with this client on the same states, and tests its errors.
// TENDON_TOUCH_STATES is the engine with states from stdin, and TENDON_TOUCH_MJCF the engine itself.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import type { Touch, Vec3 } from "tendon-client/node";
import { TouchableScene, zUp } from "../../../clients/mujoco/src/index.js";
import { kRoot } from "../typescript/support/paths.js";

interface State {
  readonly t: number;
  readonly at: readonly [number, number, number];
  /** w, x, y, z */
  readonly turn?: readonly [number, number, number, number];
}
interface Answer {
  /** The time of the processor, µs. */
  readonly us: number;
  readonly force: readonly number[];
  readonly stiffness?: readonly number[];
  readonly valid_radius?: number;
  readonly normal?: readonly number[];
  readonly gap?: number;
  readonly torque?: readonly number[];
  readonly angular_stiffness?: readonly number[];
}

const file = (name: string): string => join(kRoot, "clients/mujoco/cpp", `${name}.xml`);
const xyz = ({ x, y, z }: Vec3): readonly number[] => [x, y, z];
const norm = (v: readonly number[]): number => Math.hypot(...v);
const apart = (a: readonly number[], b: readonly number[]): number => norm(a.map((value, i) => value - b[i]!));
const kIdentity = [1, 0, 0, 0] as const;

const kNotBuilt = "the engine in C++ was not built, because libmujoco-dev is missing";

/** Writes a scene to a file that is removed after the test. */
function write(test: TestContext, mjcf: string): string {
  const folder = mkdtempSync(join(tmpdir(), "touch-mjcf-"));
  test.after(() => rmSync(folder, { recursive: true }));
  writeFileSync(join(folder, "scene.xml"), mjcf);
  return join(folder, "scene.xml");
}

/** Returns the answers of the engine in C++, or skips the test if it was not built. */
function inCpp(test: TestContext, mjcf: string, states: readonly State[], ...options: readonly string[]): Answer[] | undefined {
  const program = process.env["TENDON_TOUCH_STATES"];
  if (program) return run(program, mjcf, states, ...options).answers;
  test.skip(kNotBuilt);
  return undefined;
}

function run(program: string, mjcf: string, states: readonly State[], ...options: readonly string[]) {
  const input = states.map(({ t, at, turn }) => [t, ...at, ...(turn ?? [0, 0, 0, 0])].join(" ")).join("\n");
  const { status, stdout, stderr } = spawnSync(program, [mjcf, ...options], { input, encoding: "utf8", maxBuffer: 2 ** 28 });
  assert.equal(status, 0, stderr);
  const answers = stdout.trim().split("\n").map((line) => JSON.parse(line) as Answer);
  assert.equal(answers.length, states.length);
  return { answers, said: stderr };
}

async function inTypeScript(test: TestContext, mjcf: string, states: readonly State[]) {
  // MuJoCo 2.2.2 has no gravcomp. The engine in C++ compensates the weight itself.
  const text = readFileSync(mjcf, "utf8").replace('<body name="tool">', '<body name="tool" gravcomp="1">');
  const scene = await TouchableScene.load(text, { tool: "tool", rotation: zUp(), onWarning: assert.fail });
  test.after(() => scene.delete());
  let before = states[0]!.t;
  return states.map(({ t, at: [x, y, z], turn }) => {
    const [w, i, j, k] = turn ?? kIdentity;
    const touch = scene.touch({ x, y, z }, t - before, turn && { w, x: i, y: j, z: k })!;
    before = t;
    return touch;
  });
}

/** States at 1 kHz. Each row is a pose and the time at which it is reached, at constant speed. */
function path(rows: readonly { readonly t: number; readonly at: readonly number[]; readonly tilt?: number }[]): State[] {
  return Array.from({ length: Math.round(1000 * rows.at(-1)!.t) + 1 }, (_, i) => {
    const t = i / 1000;
    const next = Math.max(1, rows.findIndex((row) => row.t >= t));
    const [a, b] = [rows[next - 1]!, rows[next]!];
    const share = (t - a.t) / (b.t - a.t);
    const mix = (from: number, to: number) => from + share * (to - from);
    const tilt = mix(a.tilt ?? 0, b.tilt ?? 0) / 2;
    return { t, at: [0, 1, 2].map((axis) => mix(a.at[axis]!, b.at[axis]!)) as never, turn: [Math.cos(tilt), 0, 0, Math.sin(tilt)] };
  });
}

const kPress = path([
  { t: 0, at: [0, 0, 0] }, { t: 2, at: [0, -0.013, 0] }, { t: 2.5, at: [0, -0.013, 0] }, { t: 3.5, at: [0.004, -0.015, 0] },
  { t: 4, at: [0.004, -0.015, 0] }, { t: 6, at: [0, 0, 0] },
]);
const kWedge = path([
  { t: 0, at: [0, 0, 0] }, { t: 2, at: [0, -0.018, 0] }, { t: 3, at: [0, -0.018, 0], tilt: 0.15 },
  { t: 3.5, at: [0, -0.018, 0], tilt: 0.15 }, { t: 4.5, at: [0.001, -0.018, 0], tilt: 0.15 },
  { t: 5, at: [0.001, -0.018, 0], tilt: 0.15 },
]);

interface Compared {
  readonly is: readonly number[];
  readonly expected: readonly number[];
}

/** Returns the largest difference, divided by the largest expected value. */
function off(all: readonly Compared[]): number {
  return Math.max(...all.map(({ is, expected }) => apart(is, expected))) / Math.max(...all.map(({ expected }) => norm(expected)));
}

describe("the engine in C++ agrees with this client within 2 %", () => {
  for (const [name, states] of [["plane", kPress], ["peg", kWedge]] as const) {
    it(name, async (test) => {
      const answers = inCpp(test, file(name), states, "--z-up");
      if (!answers) return;
      const expected = await inTypeScript(test, file(name), states);
      const compare = (is: (answer: Answer) => readonly number[], of: (touch: Touch) => readonly number[]) =>
        off(answers.map((answer, i) => ({ is: is(answer), expected: of(expected[i]!) })));
      const found = {
        force: compare(({ force }) => force, ({ force }) => xyz(force)),
        torque: compare(({ torque }) => torque!, ({ torque }) => xyz(torque!)),
      };
      const most = Math.max(...answers.map(({ force }) => norm(force)));
      test.diagnostic(`n = ${states.length}, up to ${most.toFixed(2)} N; force ${(100 * found.force).toFixed(2)} %, ` +
        `torque ${(100 * found.torque).toFixed(2)} %`);
      assert.ok(found.force < 0.02, JSON.stringify(found));
      if (name === "peg") assert.ok(found.torque < 0.02, JSON.stringify(found)); // a ball only has 15 mN·m
      assert.ok(most > 2);
      for (const t of name === "plane" ? [2.5, 4] : [3.5, 5]) { // at rest
        const [is, other] = [answers[1000 * t]!, expected[1000 * t]!];
        assert.ok(apart(is.force, xyz(other.force)) < 0.02 * norm(is.force), `${is.force} ${xyz(other.force)}`);
        assert.ok(apart(is.stiffness!, other.stiffness!) < 0.02 * norm(is.stiffness!), `${is.stiffness} ${other.stiffness}`);
        assert.ok(Math.abs(is.valid_radius! - other.validRadius!) < 0.02 * is.valid_radius!);
        assert.ok(apart(is.angular_stiffness!, other.angularStiffness!) < 0.02 * norm(is.angular_stiffness!));
      }
    });
  }
});

describe("the engine in C++", () => {
  it("sends the surface in the axes of the device", (test) => {
    const answers = inCpp(test, file("plane"), kPress, "--z-up");
    if (!answers) return;
    const { normal, gap, stiffness } = answers[2500]!;
    assert.ok(apart(normal!, [0, 1, 0]) < 1e-9, `${normal}`); // z of the scene is y of the device
    assert.ok(Math.abs(gap! + 0.003) < 1e-5, `${gap}`); // the ball would touch the plane 10 mm below the origin
    assert.ok(Math.abs(stiffness![4]! - 1000) < 20);
    assert.equal(answers[1000]!.normal, undefined, "in free space");
    assert.deepEqual(answers[1000]!.stiffness, Array(9).fill(0));
  });

  it("does not let the hand carry the tool", (test) => {
    const answers = inCpp(test, file("plane"), kPress.slice(0, 1000), "--z-up");
    if (answers) assert.ok(norm(answers.at(-1)!.force) < 1e-3, `${answers.at(-1)!.force}`);
  });

  it("has no torque if the device does not measure its orientation", (test) => {
    const answers = inCpp(test, file("peg"), kWedge.slice(0, 100).map(({ t, at }) => ({ t, at })), "--z-up");
    if (answers) assert.ok(answers.every(({ torque, angular_stiffness }) => torque === undefined && angular_stiffness === undefined));
  });

  it("steps as often as time has passed", (test) => {
    const slow = kPress.filter((_, i) => i % 10 === 0); // 100 Hz
    const answers = inCpp(test, file("plane"), slow, "--z-up");
    if (!answers) return;
    const all = inCpp(test, file("plane"), kPress, "--z-up")!;
    for (const t of [2.5, 4]) assert.ok(apart(answers[100 * t]!.force, all[1000 * t]!.force) < 0.02 * norm(all[1000 * t]!.force), `${t} s`);
  });

  it("sends no force if the simulation diverges, and is felt again", (test) => {
    const program = process.env["TENDON_TOUCH_STATES"];
    if (!program) return test.skip(kNotBuilt);
    // MuJoCo integrates this spring with k T²/m = 4.1, and more than 4 is unstable. The solution is lost after about 100 steps.
    const spring = `<body><joint type="slide" stiffness="410000" springref="0.001"/>
      <geom size="0.01" mass="0.1" contype="0" conaffinity="0"/></body>`;
    const scene = write(test, readFileSync(file("plane"), "utf8").replace("</worldbody>", `${spring}</worldbody>`));
    const { answers, said } = run(program, scene, kPress, "--z-up");
    const lost = answers.filter(({ force }) => force.includes(null as never));
    test.diagnostic(`${lost.length} of ${answers.length} answers without a force`);
    assert.ok(lost.length > 1 && lost.length < answers.length / 10, `${lost.length}`);
    assert.ok(lost.every(({ stiffness, torque }) => !stiffness && !torque));
    assert.match(said, /touch_mjcf: MuJoCo: .*(Nan|NaN|huge)/i);
    assert.ok(said.split("\n").length < 20, "not once per step");
  });

  for (const [what, mjcf, says] of [
    ["a file that does not exist", undefined, /nowhere\.xml: .*\n?.*FILE_NOT_FOUND.*nowhere\.xml/],
    ["MJCF with an error, with MuJoCo's text", "<mujoco><worldbody><geom type='ball'/></worldbody></mujoco>",
      /scene\.xml: XML Error: invalid keyword: 'ball'\nElement 'geom', line 1/],
    ["what is no XML", "nothing", /scene\.xml: XML parse error/],
    ["a scene without the tool", "<mujoco><worldbody><body name='other'><freejoint/><geom size='.01'/></body></worldbody></mujoco>",
      /scene\.xml: expected a body "tool" with a <freejoint\/>/],
    ["a tool that is not free", "<mujoco><worldbody><body name='tool'><joint type='slide'/><geom size='.01'/></body></worldbody></mujoco>",
      /scene\.xml: expected a body "tool" with a <freejoint\/>/],
    ["a tool that is fixed", "<mujoco><worldbody><body name='tool'><geom size='.01'/></body></worldbody></mujoco>",
      /scene\.xml: expected a body "tool" with a <freejoint\/>/],
    ["a tool that is too light", "<mujoco><option timestep='0.01'/><worldbody><body name='tool'><freejoint/><geom size='.01' mass='.05'/></body></worldbody></mujoco>",
      /mass = 0\.05: expected more than the stiffness of its coupling times step_s², 0\.1/],
  ] as const) {
    it(`refuses ${what}`, (test) => {
      const program = process.env["TENDON_TOUCH_MJCF"];
      if (!program) return test.skip(kNotBuilt);
      const scene = mjcf === undefined ? "nowhere.xml" : write(test, mjcf);
      const { status, stderr, stdout } = spawnSync(program, [scene, "--duration-s", "1"], { encoding: "utf8" });
      assert.match(stderr, says);
      assert.deepEqual([status, stdout], [1, ""]);
    });
  }
});
