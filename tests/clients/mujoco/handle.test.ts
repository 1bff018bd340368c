// SPDX-License-Identifier: Apache-2.0
// Tests a tool that rotates with the handle and returns a force, a torque and both stiffnesses.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, it, type TestContext } from "node:test";
import type { Quat, Touch, Vec3 } from "tendon-client/node";
import { TouchableScene, zUp, type SceneConfig } from "../../../clients/mujoco/src/index.js";
import { spring } from "../../../clients/mujoco/src/rotation.js";
import { kRoot } from "../typescript/support/paths.js";
import { kStiff } from "./scenes.js";

const kOrigin: Vec3 = { x: 0, y: 0, z: 0 };
const kHeld: Quat = { w: 1, x: 0, y: 0, z: 0 };
/** A device frame that is rotated relative to the scene. */
const kAskew = [2, -1, 2, 2, 2, -1, -1, 2, 2].map((value) => value / 3);
const kInertia = '<inertial pos="0 0 0" mass="0.05" diaginertia="2e-5 2e-5 2e-5"/>';

async function load(test: TestContext, mjcf: string, config: Partial<SceneConfig> = {}) {
  const warnings: string[] = [];
  const scene = await TouchableScene.load(mjcf, { tool: "tool", onWarning: (text) => warnings.push(text), ...config });
  test.after(() => scene.delete());
  return { scene, warnings };
}
const scene = (inside: string, { tool = "", more = "", gravity = "0 0 0" } = {}) => `<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" gravity="${gravity}"/>
  <worldbody><body name="tool" ${tool}><freejoint/>${inside}</body>${more}</worldbody></mujoco>`;
const kBall = `${kInertia}<geom type="sphere" size="0.01" condim="1" ${kStiff}/>`;

const about = (axis: readonly number[], degrees: number): Quat => {
  const [half, length] = [(degrees * Math.PI) / 360, Math.hypot(...axis)];
  const [x, y, z] = axis.map((value) => (Math.sin(half) * value) / length) as [number, number, number];
  return { w: Math.cos(half), x, y, z };
};
/** This is Rodrigues' formula, because the code under test uses quaternions. */
function turned(axis: readonly number[], degrees: number, v: readonly number[]): number[] {
  const [angle, n] = [(degrees * Math.PI) / 180, axis.map((value) => value / Math.hypot(...axis))];
  const along = n.reduce((sum, value, i) => sum + value * v[i]!, 0);
  const across = cross(n, v);
  return v.map((value, i) => value * Math.cos(angle) + across[i]! * Math.sin(angle) + n[i]! * along * (1 - Math.cos(angle)));
}
const cross = (a: readonly number[], b: readonly number[]): number[] =>
  [0, 1, 2].map((i) => a[(i + 1) % 3]! * b[(i + 2) % 3]! - a[(i + 2) % 3]! * b[(i + 1) % 3]!);
const list = ({ x, y, z }: Vec3): number[] => [x, y, z];
const toScene = (frame: readonly number[], v: readonly number[]): number[] =>
  [0, 1, 2].map((i) => v.reduce((sum, value, k) => sum + frame[3 * i + k]! * value, 0));
const toDevice = (frame: readonly number[], v: readonly number[]): number[] =>
  [0, 1, 2].map((i) => v.reduce((sum, value, k) => sum + frame[3 * k + i]! * value, 0));
function near(actual: readonly number[], expected: readonly number[], tolerance: number, what = ""): void {
  assert.equal(actual.length, expected.length, what);
  const off = Math.max(...actual.map((value, i) => Math.abs(value - expected[i]!)));
  assert.ok(off <= tolerance, `${what}: expected ${expected.join(", ")} ± ${tolerance}, got ${actual.join(", ")}`);
}
function settle(of: TouchableScene, position = kOrigin, orientation: Quat | undefined = kHeld, answers = 60): Touch {
  let touch: Touch | undefined;
  for (let i = 0; i < answers; ++i) touch = of.touch(position, 0.01, orientation);
  assert.ok(touch, "no answer");
  return touch;
}

describe("a held tool", () => {
  it("gives the hand its weight, and its weight's lever as a torque", async (test) => {
    const [gravity, lever] = [[1, 2, -9], [0.03, -0.01, 0.02]];
    const body = `<inertial pos="${lever.join(" ")}" mass="0.1" diaginertia="2e-5 3e-5 4e-5"/><geom type="sphere" size="0.01"/>`;
    const { scene: held } = await load(test, scene(body, { gravity: gravity.join(" ") }), { rotation: kAskew });
    const axis = [1, -2, 3];
    const { force, torque } = settle(held, kOrigin, about(axis, 40));
    const weight = gravity.map((value) => 0.1 * value);
    near(list(force), toDevice(kAskew, weight), 1e-4, "force");
    // The tool sags by a degree, so the lever arm is computed from MuJoCo's center of mass.
    const sagged = cross([0, 1, 2].map((i) => held.data.xipos[3 + i] - held.data.xpos[3 + i]), weight);
    near(list(torque!), toDevice(kAskew, sagged), 1e-5, "torque");
    near(toScene(kAskew, list(torque!)), cross(toScene(kAskew, turned(axis, 40, toDevice(kAskew, lever))), weight), 2e-3, "unsagged");
    assert.ok(Math.hypot(...list(torque!)) > 0.02, "there is a torque");
  });

  it("turns as the handle does, in the scene's axes, from how it lay", async (test) => {
    const home = about([3, 1, 2], 50);
    const tool = `quat="${[home.w, home.x, home.y, home.z].join(" ")}" pos="0.1 0.2 0.3"`;
    const { scene: held } = await load(test, scene(kBall, { tool }), { rotation: kAskew });
    for (const [axis, degrees] of [[[1, 0, 0], 30], [[0, 1, 0], -80], [[1, 2, -2], 170]] as const) {
      settle(held, { x: 0.01, y: 0.02, z: -0.03 }, about(axis, degrees));
      for (const u of [[1, 0, 0], [0, 1, 0]]) {
        const expected = toScene(kAskew, turned(axis, degrees, toDevice(kAskew, turned([3, 1, 2], 50, u))));
        const m = [0, 1, 2].map((row) => [0, 1, 2].reduce((sum, k) => sum + held.data.xmat[9 + 3 * row + k] * u[k]!, 0));
        near(m, expected, 1e-6, `about ${axis.join()}`);
      }
      near([...held.data.xpos.subarray(3, 6)], toScene(kAskew, [0.01, 0.02, -0.03]).map((x, i) => x + [0.1, 0.2, 0.3][i]!), 1e-8, "place");
    }
  });

  it("runs beside a hand that moves and turns evenly without a force", async (test) => {
    const { scene: held } = await load(test, scene(kBall));
    let touch: Touch | undefined;
    for (let i = 0; i < 100; ++i) touch = held.touch({ x: 0.001 * i, y: 0, z: 0 }, 0.01, about([0, 0, 1], i));
    near(list(touch!.force), [0, 0, 0], 1e-6, "force");
    near(list(touch!.torque!), [0, 0, 0], 1e-6, "torque");
  });

  it("resists a turn by κ sin θ, the law of core/base/rotation.h", async (test) => {
    const mjcf = scene(kBall).replace("</worldbody>",
      `</worldbody><equality><weld body1="tool" solref="0.002 1" solimp="0.9999 0.9999 0.001"/></equality>`);
    const { scene: fixed } = await load(test, mjcf, { coupling: { angularStiffness: 0.5 } });
    const axis = [1, 2, 2].map((value) => value / 3);
    for (const degrees of [5, -30, 60, 90, 140]) {
      const { torque, angularStiffness: k } = settle(fixed, kOrigin, about(axis, degrees));
      const angle = (degrees * Math.PI) / 180;
      near(list(torque!), axis.map((value) => -0.5 * Math.sin(angle) * value), 0.003, `${degrees}°`);
      // This is −∂τ/∂θ about the same axis. If it is negative, which is the case above 90°, it must not be sent.
      const along = toScene(k!, axis).reduce((sum, value, i) => sum + value * axis[i]!, 0);
      near([along], [Math.max(0.5 * Math.cos(angle), 0)], 0.01, `stiffness at ${degrees}°`);
    }
  });

  it("is refused: too light for its coupling, or on a hinge", async () => {
    const options = { tool: "tool", onWarning: () => {} };
    const light = scene('<inertial pos="0 0 0" mass="0.05" diaginertia="1e-6 2e-5 2e-5"/><geom size="0.01"/>');
    await assert.rejects(TouchableScene.load(light, options), /"tool", is too light.*2 N·m\/rad.*at least 2\.0e-6 kg·m², got 1\.0e-6/);
    await assert.rejects(TouchableScene.load(scene('<inertial pos="0 0 0" mass="0.0005" diaginertia="1 1 1"/><geom size="0.01"/>'), options),
      /"tool", is too light.*1000 N\/m.*at least 1\.0e-3 kg/);
    await assert.rejects(TouchableScene.load(scene(kBall).replace("<freejoint/>", "<joint/>"), options), /"tool", requires mocap.*<freejoint\/>/);
    for (const coupling of [{ stiffness: 0 }, { angularStiffness: NaN }])
      await assert.rejects(TouchableScene.load(scene(kBall), { ...options, coupling }), /^RangeError: coupling\.(s|angularS)tiffness/);
  });

  it("takes no orientation that is none", async (test) => {
    const { scene: held, warnings } = await load(test, scene(kBall));
    for (const bad of [{ w: 0, x: 0, y: 0, z: 0 }, { w: 1, x: 0.1, y: 0, z: 0 }, { w: NaN, x: 0, y: 0, z: 1 }])
      assert.equal(held.touch(kOrigin, 0.01, bad), undefined);
    assert.equal(held.stats().badPositions, 3);
    assert.match(warnings.join("\n"), /turned by \(0, 0, 0, 0\),.*is not a valid position/);
    assert.ok(held.touch(kOrigin, 0.01, { w: -1, x: 0, y: 0, z: 0 }), "−q is q");
  });

  it("turns no faster than maxToolSpin, and the short way", async (test) => {
    const { scene: held } = await load(test, scene(kBall), { maxToolSpin: 5 });
    held.touch(kOrigin, 0.01, kHeld);
    const { w, x, y, z } = about([0, 0, 1], 90);
    held.touch(kOrigin, 0.01, { w: -w, x: -x, y: -y, z: -z });
    held.touch(kOrigin, 0.01, about([0, 0, 1], 90));
    assert.equal(held.stats().lagging, 2);
    const angle = 2 * Math.atan2(held.data.qpos[6], held.data.qpos[3]);
    assert.ok(angle > 0.02 && angle < 0.1, `${angle} rad after 20 ms`);
  });

  it("gives no torque to a hand whose orientation nobody measures", async (test) => {
    const body = `<inertial pos="0.03 0 0" mass="0.1" diaginertia="2e-5 2e-5 2e-5"/><geom size="0.01"/>`;
    const { scene: held } = await load(test, scene(body, { gravity: "0 0 -10" }));
    let touch: Touch | undefined;
    for (let i = 0; i < 60; ++i) touch = held.touch(kOrigin, 0.01);
    near(list(touch!.force), [0, 0, -1], 1e-3, "its weight");
    assert.deepEqual([touch!.torque, touch!.angularStiffness], [undefined, undefined]);
  });

  it("is at home again when MuJoCo has lost the solution", async (test) => {
    const { scene: held } = await load(test, scene(kBall));
    settle(held, { x: 0.05, y: 0, z: 0 }, about([0, 1, 0], 30));
    held.data.qvel[0] = NaN;
    assert.equal(held.touch({ x: 0.05, y: 0, z: 0 }, 0.001, about([0, 1, 0], 30)), undefined);
    assert.equal(held.stats().restarts, 1);
    near([...held.data.qpos.subarray(0, 7)], [0, 0, 0, 1, 0, 0, 0], 0, "home");
    held.touch({ x: 0.05, y: 0, z: 0 }, 0.001, about([0, 1, 0], 30));
    assert.ok(Math.hypot(...held.data.qvel.subarray(0, 3)) < 1, "it is not pulled to where the hand was");
    near(list(settle(held, { x: 0.05, y: 0, z: 0 }, about([0, 1, 0], 30)).force), [0, 0, 0], 1e-6, "and comes back");
  });
});

describe("the stiffness", () => {
  it("of a tool in free space is none", async (test) => {
    const { scene: held } = await load(test, scene(kBall), { rotation: kAskew });
    const { stiffness, angularStiffness } = settle(held, { x: 0.01, y: 0, z: 0 }, about([1, 1, 0], 20));
    near(stiffness!, Array(9).fill(0), 1e-9, "K");
    near(angularStiffness!, Array(9).fill(0), 1e-9, "K of rotation");
    near([...held.data.qacc], Array(6).fill(0), 1e-6, "and no probe is left in the scene");
  });

  it("against a smooth plane is the coupling's along the normal", async (test) => {
    const normal = [2, 3, 6].map((value) => value / 7);
    const more = `<geom type="plane" size="1 1 1" zaxis="2 3 6" pos="${normal.map((n) => -0.012 * n).join(" ")}" condim="1" ${kStiff}/>`;
    const { scene: held } = await load(test, scene(kBall, { more }), { rotation: kAskew });
    const [x, y, z] = toDevice(kAskew, normal.map((n) => -0.004 * n)) as [number, number, number];
    const pressed = settle(held, { x, y, z }, kHeld);
    const n = toDevice(kAskew, normal);
    near(list(pressed.force), n.map((value) => 2 * value), 0.05, "2 mm deep at 1000 N/m");
    near(pressed.stiffness!, n.flatMap((a) => n.map((b) => 1000 * a * b)), 20, "K");
    near(pressed.angularStiffness!, Array(9).fill(0), 1e-6, "a smooth ball turns freely");
    near([pressed.validRadius!], [0.002], 1e-4, "so far back it lets go");
    // The hand moves to this position, which is 0.5 mm deeper and 0.3 mm to the side.
    const [a, b, c] = n.map((value, i) => -0.0005 * value + 0.0003 * cross(n, [1, 0, 0])[i]!) as [number, number, number];
    const there = settle(held, { x: x + a, y: y + b, z: z + c }, kHeld);
    const predicted = list(pressed.force).map((f, i) => f - toScene(pressed.stiffness!, [a, b, c])[i]!);
    near(list(there.force), predicted, 0.02, "F − K dx");
  });

  it("of a plate that lies flat is the coupling's, but not about its normal", async (test) => {
    const tool = `quat="${[0.5, 0.5, 0.5, 0.5].join(" ")}" pos="0 0 0.01"`; // its own y axis points up
    const plate = `${kInertia}<geom type="box" size="0.05 0.01 0.05" condim="1" ${kStiff}/>`;
    const more = `<geom type="plane" size="1 1 1" condim="1" ${kStiff}/>`;
    const { scene: held } = await load(test, scene(plate, { tool, more }), { rotation: kAskew });
    const [x, y, z] = toDevice(kAskew, [0, 0, -0.02]) as [number, number, number];
    const { angularStiffness } = settle(held, { x, y, z }, kHeld);
    const n = toDevice(kAskew, [0, 0, 1]);
    near(angularStiffness!, n.flatMap((a, i) => n.map((b, k) => 2 * (Number(i === k) - a * b))), 0.05, "K of rotation");
  });

  it("to ask for it changes nothing: bit for bit the same motion", async (test) => {
    const states = await Promise.all([true, false].map(async (sendStiffness) => {
      const { scene: held } = await load(test, kPeg, { sendStiffness });
      const way: number[] = [];
      for (let i = 0; i < 150; ++i) {
        held.touch({ x: 0, y: 0, z: -Math.min(0.0005 * i, 0.015) }, 0.01, about([0, 1, 0], 10 * Math.sin(i / 10)));
        way.push(...held.data.qpos, ...held.data.qvel);
      }
      const { stiffness, angularStiffness, validRadius } = held.touch(kOrigin, 0.01, kHeld)!;
      for (const sent of [stiffness, angularStiffness, validRadius]) assert.equal(sent !== undefined, sendStiffness);
      return way;
    }));
    assert.ok(Math.hypot(...states[0]!.slice(-6)) > 1e-4, "it moves");
    assert.deepEqual(states[0], states[1]);
  });

  it("is symmetric and stores energy in a peg that wedges", async (test) => {
    const { scene: held } = await load(test, kPeg);
    let wedged = 0;
    for (let i = 0; i < 200; ++i) {
      const touch = held.touch({ x: 0, y: 0, z: -Math.min(0.0005 * i, 0.015) }, 0.01, about([1, 2, 0.2], 10 * Math.sin(i / 10)))!;
      for (const k of [touch.stiffness!, touch.angularStiffness!]) {
        near([k[1]!, k[2]!, k[5]!], [k[3]!, k[6]!, k[7]!], 1e-9, "symmetric");
        const least = Math.min(...kProbes.map((v) => toScene(k, v).reduce((sum, value, j) => sum + value * v[j]!, 0)));
        assert.ok(least >= -1e-9 && Math.max(...k) <= 1000 + 1e-6);
      }
      if (touch.angularStiffness![0]! > 0.5) ++wedged;
    }
    assert.ok(wedged > 20, `wedged in ${wedged} answers`);
  });

  it("that a spring cannot have is that of the nearest one", () => {
    near(spring([2, 1, 0, -1, 3, 0, 0, 0, -4], 10)!, [2, 0, 0, 0, 3, 0, 0, 0, 0], 1e-12, "no circulation, none below zero");
    near(spring([5, 4, 0, 4, 5, 0, 0, 0, 1], 6)!, [3.5, 2.5, 0, 2.5, 3.5, 0, 0, 0, 1], 1e-12, "9 about (1, 1, 0) becomes 6");
    assert.equal(spring([1, 0, 0, 0, NaN, 0, 0, 0, 1], 10), undefined);
  });
});

describe("a scene whose z points up", () => {
  it("has the operator's right at x and what points to the operator at −y", () => {
    near(toScene(zUp(), [1, 2, 3]), [1, -3, 2], 1e-12, "x right, y up, z to the user");
    // The device has x to the user, y right, z up. The axes of the operator are its y, z and x axes.
    const operatorFromDevice = { w: 0.5, x: -0.5, y: -0.5, z: -0.5 };
    near(toScene(zUp(operatorFromDevice), [1, 2, 3]), [2, -1, 3], 1e-12, "x to the user, y right, z up");
  });
});

/** The scene of the example. The tool is moved in the directions of the axes of the scene. */
const kExample = readFileSync(join(kRoot, "clients/mujoco/examples/peg_in_hole.ts"), "utf8");
const kPeg = /`([\s\S]*)`/.exec(kExample)![1]!.replace('name="peg"', 'name="tool"');
const kProbes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, -1, 0], [1, 0, 1], [1, 0, -1], [0, 1, 1], [0, 1, -1], [1, 1, 1]];

describe("the peg in the hole", () => {
  const wedge = async (test: TestContext, degrees: number) => {
    const { scene: held } = await load(test, kPeg, { rotation: zUp() });
    for (let i = 0; i < 60; ++i) settle(held, { x: 0, y: -0.0003 * i, z: 0 }, kHeld, 1);
    return { held, ...settle(held, { x: 0, y: -0.018, z: 0 }, about([0, 0, 1], degrees)) };
  };

  it("goes in straight without a torque, and rests on the bottom", async (test) => {
    const { held, force, torque } = await wedge(test, 0);
    near([...list(force), ...list(torque!)], Array(6).fill(0), 1e-3, "loose");
    near(list(settle(held, { x: 0, y: -0.032, z: 0 }).force), [0, 2, 0], 0.1, "2 mm into the bottom: up, which is y");
  });

  it("wedges when it is tilted: the torque is against the tilt", async (test) => {
    for (const degrees of [10, -10]) {
      const { held, force, torque, angularStiffness } = await wedge(test, degrees);
      const against = -Math.sign(degrees) * torque!.z;
      assert.ok(against > 0.1 && against < 2 * Math.sin(Math.PI / 18), `${torque!.z} N·m at ${degrees}°`);
      near([torque!.x, torque!.y], [0, 0], 0.01, "about the axis of the tilt");
      assert.ok(Math.abs(force.x) > 1, `and the hole pushes aside: ${force.x} N`);
      near(list(held.contactForce("tool")), toScene(zUp(), list(force)), 0.01, "what the hole pushes the hand feels");
      assert.ok(angularStiffness![8]! > 1.5, `${angularStiffness![8]} N·m/rad`);
    }
  });

  it("asks at most 30 lines of its user", () => {
    assert.ok(kExample.trimEnd().split("\n").length <= 30);
  });
});
