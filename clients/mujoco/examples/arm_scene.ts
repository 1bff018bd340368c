// SPDX-License-Identifier: Apache-2.0
// An arm of six joints with two links of 0.3 m, over a table at z = 0.17. Its tool points down, 20 mm above the table.
const servo = (joint: string): string => `<position joint="${joint}" kp="200" kv="6"/>`;

export const armScene = `<mujoco>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
  <default>
    <joint axis="0 1 0" armature="0.05" damping="0.2"/>
    <geom solref="0.004 1" solimp="0.99 0.999 0.0001" mass="0.3" contype="0" conaffinity="0"/>
  </default>
  <worldbody>
    <geom name="table" type="box" pos="0.4 0 0.16" size="0.3 0.3 0.01" contype="1" conaffinity="1"/>
    <body name="shoulder" pos="0 0 0.3" gravcomp="1">
      <joint name="pan" axis="0 0 1"/>
      <geom type="cylinder" size="0.05 0.05"/>
      <body name="upper" gravcomp="1">
        <joint name="lift"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
        <body name="fore" pos="0.3 0 0" gravcomp="1">
          <joint name="elbow"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.025"/>
          <body name="wrist" pos="0.3 0 0" gravcomp="1">
            <joint name="pitch"/>
            <geom type="sphere" size="0.03"/>
            <body name="hand" gravcomp="1">
              <joint name="yaw" axis="0 0 1"/>
              <geom type="sphere" size="0.025"/>
              <body name="finger" gravcomp="1">
                <joint name="roll" axis="1 0 0"/>
                <geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.01" contype="1" conaffinity="1"/>
                <site name="tool" pos="0 0 -0.11"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>${["pan", "lift", "elbow", "pitch", "yaw", "roll"].map(servo).join("")}</actuator>
  <keyframe><key qpos="0 -0.7853981634 1.5707963268 -0.7853981634 0 0"/></keyframe>
</mujoco>`;
