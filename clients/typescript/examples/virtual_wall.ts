// SPDX-License-Identifier: Apache-2.0
// A wall at x = 0. Outside, x < 0, the hand is free; inside, a spring pushes it back out along -x.
import { commandLine, run } from "tendon-client/node";

const { options, values } = commandLine(
  "Render a wall at x = 0 that pushes the hand out along -x.",
  { name: "virtual_wall", rateHz: 100 },
  {
    "stiffness-n-per-m": [2000, "Stiffness of the wall, N/m"],
    "local-model": [false, "Also send the stiffness, for use between two answers"],
  },
);
const k = values["stiffness-n-per-m"];

process.exitCode = await run(options, {
  physics({ position }) {
    const depth = position.x;
    if (depth <= 0) return { x: 0, y: 0, z: 0 };
    const force = { x: -k * depth, y: 0, z: 0 };
    return values["local-model"] ? { force, stiffness: [k, 0, 0] } : force;
  },
});
