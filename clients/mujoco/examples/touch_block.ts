// SPDX-License-Identifier: Apache-2.0
// A block of something like liver, in MuJoCo. The hand of deploy/scenes/demo.toml moves along x and touches it at x > 0.
import { commandLine, run } from "tendon-client/node";
import { TouchableScene } from "tendon-mujoco";

const { options } = commandLine("A soft block, simulated by MuJoCo.", { name: "touch_block", rateHz: 100 });

const scene = await TouchableScene.load(`
  <mujoco>
    <option timestep="0.002" integrator="discrete" solver="CG" gravity="0 0 0"/>
    <size memory="100M"/>
    <worldbody>
      <body name="tool" mocap="true" pos="0 0 0.0605">
        <geom type="sphere" size="0.01"/>
      </body>
      <flexcomp name="block" type="grid" dim="3" count="5 5 3" spacing="0.025 0.025 0.025" pos="0 0 0.025"
                mass="0.5" radius="0.0005">
        <elasticity young="1e4" poisson="0.45" damping="0.01"/>
        <contact selfcollide="none" internal="false" solref="0.004 1" solimp="0.99 0.999 0.0001"/>
        <pin gridrange="0 0 0 4 4 0"/>
      </flexcomp>
    </worldbody>
  </mujoco>`, { tool: "tool", rotation: [0, 0, 1, 0, 1, 0, -1, 0, 0] }); // the device's +x goes down into the block

process.exitCode = await run(options, scene);
