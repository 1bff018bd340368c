// SPDX-License-Identifier: Apache-2.0
// An arm of six joints in MuJoCo follows the hand of deploy/scenes/robot.toml and touches a table. Button 0: engage, clutch.
import { commandLine, Follower, run, type DeviceState, type Pose } from "tendon-client/node";
import { Arm } from "tendon-mujoco";
import { armScene } from "./arm_scene.js";

const { options } = commandLine("A robot arm, simulated by MuJoCo.", { name: "robot_arm", rateHz: 200 });
const arm = await Arm.load(armScene, "tool");
const rotation = { w: Math.SQRT1_2, x: Math.SQRT1_2, y: 0, z: 0 }; // y of the device points up, as z of the scene does
const follow = new Follower({ scale: 0.5, forceScale: 0.4, rotation, clutchButton: 0, rateHz: options.rateHz || 1000 });
const move = (target: Pose | undefined): void => (target ? arm.goTo(target) : arm.hold());
let [before, lines] = [performance.now(), 0];
let newest: DeviceState | undefined;

setInterval(() => { // the loop of the robot, independent of the connection
  const now = performance.now();
  move(follow.silence(now));
  arm.advance((now - before) / 1000);
  before = now;
  if (options.json && ++lines % 4 === 0)
    console.log(JSON.stringify({ phase: follow.phase, ms: now, hand: newest?.position, felt: newest?.forceApplied,
      tool: arm.pose().position, force: arm.contact().force }));
}, 5).unref();

const physics = (hand: DeviceState) => {
  move(follow.target(hand, arm.pose(), performance.now()));
  newest = hand;
  return follow.touch(arm.contact());
};
process.exitCode = await run(options, { physics });
