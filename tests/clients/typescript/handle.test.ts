// SPDX-License-Identifier: Apache-2.0
// Tests the orientation, the torque and the gripper of a handle.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { Deadband, predict } from "../../../clients/typescript/src/deadband.js";
import type { Touch } from "../../../clients/typescript/src/index.js";
import { kFair, World, type ServerConduct } from "./support/world.js";

const kPush = { x: -1, y: 0, z: 0 };
const kTorque = { x: 0, y: 0, z: 0.1 };
const kTouch: Touch = { force: kPush, torque: kTorque, angularStiffness: [0.2], gripForce: -1.5 };
const kTurning = { orientation: { w: 0.6, x: 0.8, y: 0, z: 0 }, angularVelocity: { x: 0, y: 1, z: 0 } };

function world(touch: Touch, features: string[], turns: boolean): World {
  const made: World = new World(1, kFair, {}, { physics: () => touch }, { features });
  const plain = made.server.conduct.state;
  if (turns) made.server.conduct.state = (tick) => ({ ...plain(tick), turning: kTurning });
  return made;
}

describe("the whole handle", () => {
  it("torque, angular stiffness and grip force travel with the force", () => {
    const w = world(kTouch, ["handle"], true);
    w.runMs(200);
    assert.ok(w.server.forces.length > 100);
    for (const { command } of w.server.forces) {
      assert.deepEqual(command.torque, { torque: kTorque, model: { at: kTurning.orientation, stiffness: [0.2] } });
      assert.equal(command.gripForce, -1.5);
      assert.equal(command.model, undefined);
    }
    assert.equal(w.client.stats().leftOut, "");
  });

  it("what cannot be sent is said, and the force is sent", () => {
    for (const knows of [false, true]) {
      const w = world(kTouch, knows ? ["handle"] : ["local-model"], false);
      w.runMs(200);
      assert.ok(w.server.forces.length > 100);
      for (const { command } of w.server.forces) {
        assert.deepEqual(command.torque, knows ? { torque: kTorque } : undefined);
        assert.equal(command.gripForce, knows ? -1.5 : undefined);
      }
      assert.match(w.client.stats().leftOut, knows ? /^angular stiffness: the device/ : /^torque and grip force: the server/);
    }
  });

  it("an answer with an impossible torque or grip force is not sent", () => {
    const bad: [Partial<Touch>, RegExp][] = [
      [{ torque: { x: NaN, y: 0, z: 0 } }, /the torque is not finite/], [{ torque: { x: 0, y: 2e12, z: 0 } }, /the torque exceeds/],
      [{ angularStiffness: [1, 2] }, /angular stiffness/], [{ angularStiffness: [Infinity] }, /angular stiffness/],
      [{ gripForce: NaN }, /grip force/],
    ];
    for (const [part, why] of bad) {
      const w = world({ force: kPush, ...part }, ["handle"], true);
      w.runMs(100);
      assert.equal(w.server.forces.length, 0);
      assert.match(w.client.stats().unusable, why);
    }
  });

  it("a deadband leaves out no torque or grip force that a hand can tell", () => {
    const deadband = new Deadband({ share: 0.1, floor: 0.05, longestSilenceMs: 20 });
    let now = 0n;
    const passes = (x: number, torque?: number, gripForce?: number): boolean =>
      deadband.passes((now += 1_000_000n), {
        force: { x, y: 0, z: 0 }, ...(torque !== undefined && { torque: { torque: { x: 0, y: torque, z: 0 } } }), gripForce,
      });
    assert.deepEqual([passes(1), passes(1, 0.001), passes(1.09, 0.003), passes(1, 0.004)], [true, true, false, true]);
    assert.deepEqual([passes(1, 0.004, 0), passes(1, 0.004, 0.04), passes(1, 0.004, 0.06)], [true, false, true]);
    assert.deepEqual([passes(1, undefined, 0.06), passes(1, undefined, 0.06)], [true, false]);
  });

  it("a state is predicted with the velocities of rotation and gripper", () => {
    const conduct: Pick<ServerConduct, "state"> = world(kTouch, [], false).server.conduct;
    const sent = {
      ...conduct.state(100n), grip: { opening: 0.5, velocity: -3 },
      turning: { orientation: { w: 1.0009, x: 0, y: 0, z: 0 }, angularVelocity: { x: 0, y: 0, z: 2 } },
    };
    const { turning, grip } = predict(sent, 10_000_000n, 1_000_000n);
    assert.ok(Math.abs(turning!.orientation.w - Math.cos(0.01)) < 1e-12);
    assert.ok(Math.abs(turning!.orientation.z - Math.sin(0.01)) < 1e-12);
    assert.ok(Math.abs(grip!.opening - 0.47) < 1e-12);
    assert.deepEqual(predict(sent, 0n, 1_000_000n).turning, sent.turning);
    const about = { orientation: { w: 0.6, x: 0, y: 0.8, z: 0 }, angularVelocity: { x: 0, y: 2, z: 0 } };
    const turned = predict({ ...sent, turning: about }, 10_000_000n, 1_000_000n).turning!.orientation;
    assert.ok(Math.abs(turned.w - Math.cos(Math.acos(0.6) + 0.01)) < 1e-12, "the angle grows");
  });
});
