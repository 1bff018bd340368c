// SPDX-License-Identifier: Apache-2.0
// Runs the cases in tests/clients/follower_cases.json. The Python and C++ clients run the same cases.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, it } from "node:test";
import { Follower, type DeviceState, type Pose, type Quat, type ToolContact, type Touch, type Vec3 } from "../../../clients/typescript/src/index.js";
import { kRoot } from "./support/paths.js";
import { kFair, World } from "./support/world.js";

type Values = Record<string, any>;
const suite = JSON.parse(readFileSync(join(kRoot, "tests/clients/follower_cases.json"), "utf8"));
const kPhases = ["", "alone", "coupled", "", "engaged", "clutched", "lost"];

const number = (value: unknown): number => (value === "nan" ? NaN : (value as number));
const vector = ([x, y, z]: unknown[]): Vec3 => ({ x: number(x), y: number(y), z: number(z) });
const quat = ([w, x, y, z]: number[]): Quat => ({ w: w!, x: x!, y: y!, z: z! });
const camel = (text: string): string => text.replace(/_([a-z])/g, (_, letter: string) => letter.toUpperCase());

function config(given: Values): Values {
  const entries = Object.entries(given).map(([key, value]) =>
    [camel(key), key === "rotation" ? quat(value) : value === "nan" ? NaN : value]);
  return Object.fromEntries(entries);
}

function near(values: readonly number[], expected: readonly number[], what: string): void {
  const close = values.length === expected.length && values.every((value, i) => Math.abs(value - expected[i]!) <= 1e-9);
  assert.ok(close, `${what}: [${values.join(", ")}], not [${expected.join(", ")}]`);
}
const numbers = (v: Vec3 | Quat): number[] => ("w" in v ? [v.w, v.x, v.y, v.z] : [v.x, v.y, v.z]);

function handOf(now: Values, step: Values): DeviceState {
  const sampled = step.sampled ?? now.at - 50;
  const zero = { x: 0, y: 0, z: 0 };
  return {
    tick: BigInt(step.tick ?? sampled + 1000), sampledNs: BigInt(sampled) * 1_000_000n, position: vector(now.hand), velocity: zero,
    forceApplied: zero, energy: 0, permittedForce: Infinity, reasons: now.reasons ?? 0, forceSequence: 0n, forceAgeNs: 0n,
    mode: now.mode ?? 2, device: 0, channel: 0, buttons: now.buttons ?? 0,
    turning: now.turn && { orientation: quat(now.turn), angularVelocity: zero },
    grip: now.opening === undefined ? undefined : { opening: now.opening, velocity: 0 },
  };
}

function checkFelt(touch: Touch | null, feels: Values | null): void {
  if (!feels) {
    assert.equal(touch, null);
    return;
  }
  near(numbers(touch!.force), feels.force, "force");
  near(touch!.stiffness ?? [], (feels.stiffness ?? []).flat(), "stiffness");
  near(touch!.contact ? [...numbers(touch!.contact.normal), touch!.contact.gap] : [], feels.normal ? [...feels.normal, feels.gap] : [], "surface");
  near(touch!.torque ? numbers(touch!.torque) : [], feels.torque ?? [], "torque");
  near([touch!.gripForce ?? 0], [feels.grip_force ?? 0], "grip force");
}

function check(follow: Follower, step: Values, now: Values): void {
  if (step.set_scale) assert.equal(follow.setScale(step.set_scale[0], step.set_scale[1]), step.changed);
  if (step.engage) follow.engage();
  const pose: Pose = { position: vector(now.pose), orientation: now.turned && quat(now.turned), grip: now.grip };
  const target = step.silence ? follow.silence(now.at) : follow.target(handOf(now, step), pose, now.at);
  assert.equal(follow.phase, kPhases[step.phase], `at ${now.at}`);
  near(target ? numbers(target.position) : [], step.target ?? [], `target at ${now.at}`);
  if (step.target_turned) near(numbers(target!.orientation!), step.target_turned, `turned at ${now.at}`);
  if (step.target_grip !== undefined) near([target!.grip!], [step.target_grip], `grip at ${now.at}`);
  if ("touch" in step) checkFelt(follow.touch(step.touch ? contactOf(step.touch) : undefined), step.feels);
  if (step.words) assert.equal(follow.words, step.words);
}

const contactOf = ({ force, torque, stiffness, normal, grip_force: gripForce }: Values): ToolContact =>
  ({ force: vector(force), torque: torque && vector(torque), stiffness, normal: normal && vector(normal), gripForce });

describe("the follower answers as the shared cases say", () => {
  for (const { name, config: given, steps } of suite.cases) {
    it(name, () => {
      const [follow, now] = [new Follower(config(given)), {} as Values];
      for (const step of steps) check(follow, step, Object.assign(now, step));
    });
  }
});

describe("an impossible config is refused with the field", () => {
  for (const { config: given, what } of suite.refused) {
    it(what, () => assert.throws(() => new Follower(config(given)), { name: "RangeError", message: camel(what).replace("nan", "NaN") }));
  }
  it("and so is an impossible scale", () =>
    assert.throws(() => new Follower({ engageBy: "call" }).setScale(1000, 1), { message: "scale = 1000: expected 0.01 to 100" }));
});

it("an answer of null is not sent", () => {
  let asked = 0;
  const world = new World(1, kFair, {}, { physics: () => (++asked % 2 === 0 ? null : { x: 1, y: 0, z: 0 }) });
  world.runMs(200);
  assert.ok(asked > 100);
  assert.ok(Math.abs(world.server.forces.length - asked / 2) < 5, `${world.server.forces.length} of ${asked}`);
});
