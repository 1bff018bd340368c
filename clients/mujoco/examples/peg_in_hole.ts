// SPDX-License-Identifier: Apache-2.0
// A square peg, and a hole with 0.3 mm to spare. The hand of deploy/scenes/peg.toml puts it in and tilts it: it wedges.
import { commandLine, run } from "tendon-client/node";
import { TouchableScene, zUp } from "tendon-mujoco";

const { options } = commandLine("A peg in a hole, simulated by MuJoCo.", { name: "peg_in_hole", rateHz: 100 });

const scene = await TouchableScene.load(`
  <mujoco>
    <option timestep="0.001" integrator="implicitfast" cone="elliptic"/>
    <default><geom friction="0.3" solref="0.004 1" solimp="0.99 0.999 0.0001"/></default>
    <worldbody>
      <body name="peg" gravcomp="1">
        <freejoint/>
        <inertial pos="0 0 -0.02" mass="0.05" diaginertia="2e-5 2e-5 2e-5"/>
        <geom type="box" pos="0 0 -0.02" size="0.005 0.005 0.02"/>
      </body>
      <geom type="box" pos="0 0 -0.08" size="0.03 0.03 0.01"/>
      <geom type="box" pos="0.0153 0 -0.055" size="0.01 0.03 0.015"/>
      <geom type="box" pos="-0.0153 0 -0.055" size="0.01 0.03 0.015"/>
      <geom type="box" pos="0 0.0153 -0.055" size="0.0053 0.01 0.015"/>
      <geom type="box" pos="0 -0.0153 -0.055" size="0.0053 0.01 0.015"/>
    </worldbody>
  </mujoco>`, { tool: "peg", rotation: zUp() }); // the device's y points up, as that of deploy/scenes/peg.toml does

process.exitCode = await run(options, scene);
