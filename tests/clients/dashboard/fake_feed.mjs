// SPDX-License-Identifier: Apache-2.0
// Replaces the WebSocket of the page with messages from four devices that no simulated device provides.

/** Returns the rotation by `angle` about an axis as w, x, y, z. */
const turn = (x, y, z, angle) => [Math.cos(angle / 2), ...[x, y, z].map((v) => v * Math.sin(angle / 2))];
const product = (a, b) => [
  a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
  a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
  a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
  a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
];
const kBox = [[-0.08, -0.06, -0.06], [0.08, 0.06, 0.06]];
const handle = (more) => ({ operator_from_device: [1, 0, 0, 0], buttons: [], orientation_measured: false, max_torque_nm: 0, gripper_open_rad: null, max_gripper_force_n: 0, group: "", hand: "any", ...more });

/** The x axis points to the user, y points right, and z points up, as in the base frame of a Falcon. */
export const kTurnedFrame = [0.5, -0.5, -0.5, -0.5];

export const kDevices = [
  { name: "stylus", model: "6-DOF stylus", handle: handle({ buttons: ["front", "rear"], orientation_measured: true, max_torque_nm: 0.2 }), workspace_m: kBox },
  { name: "gripper", model: "7-DOF gripper", handle: handle({ operator_from_device: kTurnedFrame, buttons: ["clutch"], orientation_measured: true, max_torque_nm: 0.4, gripper_open_rad: 0.5, max_gripper_force_n: 8 }), workspace_m: [[-0.06, -0.08, -0.06], [0.06, 0.08, 0.06]] },
  { name: "falcon", model: "falcon", handle: handle({ operator_from_device: kTurnedFrame, buttons: ["centre", "left", "right"] }), workspace_m: [[-0.05, -0.05, -0.05], [0.05, 0.05, 0.05]] },
  { name: "old", model: "point", handle: null, workspace_m: null },
];

/** The fifth device, which renders a field. */
export const kTouching = { name: "touching", model: "falcon", handle: handle({}), workspace_m: kBox };

export const serverMessage = (devices = kDevices) => ({
  type: "server", address: "127.0.0.1:47100", contact: "open", words: "connected to 127.0.0.1:47100, tendond", version: "tendond", recordings: true, arms: false, press: null,
  devices: devices.map((device, number) => ({ number, loop_hz: 1000, max_force_n: 8, channels: [], arming_objection: "This page is read-only.", ...device })),
});

function stateOf(number, t) {
  const sway = (rate, phase = 0) => Math.sin(rate * t + phase);
  const plain = { orientation: null, torque_nm: null, grip_rad: null, grip_n: null, buttons: 0 };
  if (number === 0) {
    return { ...plain, position_m: [0.045 * sway(1.7), 0.03 * sway(2.3, 0.5) - 0.02, 0.03 * sway(1.1, 1)], applied_n: [-2 * sway(1.7), 2.6, 0.8 * sway(3)], wanted_n: [-2.8 * sway(1.7), 3.6, 0.8 * sway(3)],
      orientation: product(turn(0, 1, 0, 0.5 * sway(0.9)), turn(1, 0, 0, -0.9 + 0.2 * sway(1.3))), torque_nm: [0.06, 0.09 + 0.04 * sway(2), 0.03], buttons: sway(1.5) > -0.6 ? 1 : 2 };
  }
  if (number === 1) {
    return { ...plain, position_m: [0.025 * sway(1.3), 0.04 * sway(1.9), 0.03 * sway(1.5, 1)], applied_n: [1.2, 1.5 * sway(1.9), -1], wanted_n: [1.2, 1.5 * sway(1.9), -1],
      orientation: turn(0, 1, 0, 0.6 + 0.3 * sway(1.1)), torque_nm: [0, 0.1 * sway(1.1), 0.16], grip_rad: 0.45 + 0.3 * sway(2.2), grip_n: 2.5, buttons: sway(0.8) > 0 ? 1 : 0 };
  }
  if (number === 2) return { ...plain, position_m: [0.03 * sway(2), 0.035 * sway(1.2), 0.03 * sway(2.6)], applied_n: [3 * sway(2), 0, 1], wanted_n: [4 * sway(2), 0, 1], stiffness_n_per_m: [0, 0, 0, 0, 0, 0, 0, 0, 500], buttons: 4 };
  if (number === 4) {
    // It presses on a sphere of 800 N/m, whose field is replaced after 5 s.
    const [depth, height] = [Math.max(0.004 * sway(2.5), 0), 0.03];
    const [a, b] = [0.5 * sway(0.8), Math.sqrt(1 - (0.5 * sway(0.8)) ** 2)];
    const at = (radius) => [a * radius, b * radius - 0.02, 0];
    const force = [a, b, 0].map((v) => 800 * depth * v);
    return { ...plain, position_m: at(height - depth + Math.max(-0.006 * sway(2.5), 0)), applied_n: force, wanted_n: force, field: t < 5 ? 3 : 4, field_depth_m: depth, field_proxy_m: at(height + Math.max(-0.006 * sway(2.5), 0)) };
  }
  return { ...plain, position_m: [0.03 * sway(1.4), 0.03 * sway(2.9), 0.02], applied_n: [0, 0, 0], wanted_n: [0, 0, 0] };
}

/** Returns the states of a device at ticks [from, to), but only one in `every`, in the format of page_json.cc. */
export function statesMessage(number, from, to, every = 1) {
  const ticks = [];
  for (let tick = from; tick < to; tick += every) ticks.push(tick);
  const states = ticks.map((tick) => stateOf(number, tick / 1000));
  const columns = (name, axes) => Array.from({ length: axes }, (_, k) => states.map((s) => s[name][k]));
  const one = (value) => ticks.map(() => value);
  const message = {
    type: "states", device: number, tick: ticks, sampled_us: ticks.map((tick) => tick * 1000), position_m: columns("position_m", 3), wanted_n: columns("wanted_n", 3), applied_n: columns("applied_n", 3),
    permitted_n: one(6), energy_j: one(0.01), reasons: one(0), mode: one(2), force_age_ms: one(2),
  };
  if (states[0]?.stiffness_n_per_m) message.stiffness_n_per_m = columns("stiffness_n_per_m", 9);
  if (states[0]?.orientation) Object.assign(message, { orientation: columns("orientation", 4), torque_nm: columns("torque_nm", 3) });
  if (states[0]?.grip_rad !== null && states[0]) Object.assign(message, { grip_rad: states.map((s) => s.grip_rad), grip_n: states.map((s) => s.grip_n) });
  if (states[0]?.field) Object.assign(message, { field: states.map((s) => s.field), field_depth_m: states.map((s) => s.field_depth_m), field_proxy_m: columns("field_proxy_m", 3) });
  if (states.some((s) => s.buttons)) message.buttons = states.map((s) => s.buttons);
  return message;
}

const reportsMessage = (device) => ({
  type: "reports", device, link: { round_trip_ms: 0.2, received: 1000, lost: 0 }, engines: [],
  loop: { span_s: 1, steps: 1000, missed: 0, overruns: 0, unseen: 0, safety: "armed", fault: "", degraded: "", lateness_us_log2: [], lateness_us_log2_total: [0, 0, 0, 0, 0, 2, 40, 700, 258], steps_total: 1000, missed_total: 0 },
});

/**
 * Replaces /live of `page` by four devices at 1 kHz, with 60 messages per second. Call it before the page is opened.
 * The devices stop at tick `until`. Returns the list of lines that the page sends.
 */
export async function fakeFeed(page, { devices = kDevices, until = Infinity, begin = 4000 } = {}) {
  const heard = [];
  await page.routeWebSocket(/\/live$/, (socket) => {
    let [watched, beside] = [0, false];
    let tick = 0;
    socket.send(JSON.stringify(serverMessage(devices)));
    socket.onMessage((line) => {
      heard.push(line);
      [watched, beside] = [Number(line.split(" ")[1]), line.endsWith(" beside")];
      tick = 0;
      socket.send(JSON.stringify(reportsMessage(watched)));
    });
    const began = performance.now();
    const timer = setInterval(() => {
      const now = Math.min(begin + Math.floor(performance.now() - began), until);
      if (now <= tick) return;
      for (let i = 0; i < devices.length; ++i) {
        if (i === watched) socket.send(JSON.stringify(statesMessage(i, tick, now)));
        else if (beside) socket.send(JSON.stringify(tick === 0 ? statesMessage(i, 0, now, 17) : statesMessage(i, now - 1, now)));
      }
      tick = now;
    }, 1000 / 60).unref();
    socket.onClose(() => clearInterval(timer));
  });
  return heard;
}
