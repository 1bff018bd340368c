// SPDX-License-Identifier: Apache-2.0

export const kStiff = 'solref="0.004 1" solimp="0.99 0.999 0.0001"';

export interface Block {
  /** Cells along 100 mm; there are n × n × n/2 cells. */
  readonly n: number;
  readonly option?: string;
  readonly poisson?: number;
  readonly contact?: string;
}

/** Block B1: 100 × 100 × 50 mm, 10 kPa, fixed at the bottom. A sphere of 10 mm is 5.5 mm above it at the start. */
export function block({ n, option = 'timestep="0.002" integrator="discrete"', poisson = 0.45, contact = kStiff }: Block): string {
  const spacing = 0.1 / n;
  return `<mujoco>
    <option ${option} solver="CG" tolerance="1e-8" iterations="100" gravity="0 0 0"/>
    <size memory="200M"/>
    <worldbody>
      <body name="tool" mocap="true" pos="0 0 0.066"><geom type="sphere" size="0.01" condim="1" ${contact}/></body>
      <flexcomp name="block" type="grid" dim="3" count="${n + 1} ${n + 1} ${n / 2 + 1}" spacing="${spacing} ${spacing} ${spacing}"
                pos="0 0 0.025" mass="0.5" radius="0.0005">
        <elasticity young="1e4" poisson="${poisson}" damping="0.01"/>
        <contact selfcollide="none" internal="false" condim="1" ${contact}/>
        <pin gridrange="0 0 0 ${n} ${n} 0"/>
      </flexcomp>
    </worldbody>
  </mujoco>`;
}
