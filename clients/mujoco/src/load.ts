// SPDX-License-Identifier: Apache-2.0
// Loads a model from MJCF. Scenes for which MuJoCo would silently compute wrong contact forces are rejected,
// corrected or reported here, with the measured effect (README.md).
import type { MainModule, MjModel, MjSpec } from "@mujoco/mujoco";

/** MuJoCo's default contact is soft: if the tool is pressed 2 mm into B1, it penetrates by 0.85 to 1.35 mm. */
const kDefaultSolref = [0.02, 1];
const kDefaultSolimp = [0.9, 0.95, 0.001];
/** With these values, the penetration is 0.03 to 0.06 mm of the 2 mm, and finer meshes converge. */
const kStiffSolref = [0.004, 1];
const kStiffSolimp = [0.99, 0.999, 0.0001];
/** Above this value, tetrahedra lock: B1 is 1.7 times too stiff at 0.45, and 12 times too stiff at 0.499. */
const kLargestPoisson = 0.45;

/** The files that are used in the scene: "liver.msh" → content. MuJoCo cannot read any other files. */
export type Assets = Readonly<Record<string, Uint8Array>>;

interface Flex {
  readonly name: string;
  readonly dim: number;
  readonly young: number;
  readonly poisson: number;
}

function flexesOf(mj: MainModule, spec: MjSpec): Flex[] {
  const found: Flex[] = [];
  let element = mj.mjs_firstElement(spec, mj.mjtObj.mjOBJ_FLEX);
  while (element) {
    const flex = mj.mjs_asFlex(element);
    if (flex) found.push({ name: mj.mjs_getName(element), dim: flex.dim, young: flex.young, poisson: flex.poisson });
    element = mj.mjs_nextElement(spec, element);
  }
  return found;
}

const sceneError = (what: string): Error => new Error(`MuJoCo scene: ${what.trim()}`);

function compile(mj: MainModule, xml: string, assets: Assets): { readonly model: MjModel; readonly flexes: readonly Flex[] } {
  const files = new mj.MjVFS();
  let spec: MjSpec | undefined;
  try {
    for (const [name, bytes] of Object.entries(assets)) files.addBuffer(name, bytes);
    spec = mj.parseXMLString(xml, files);
    return { flexes: flexesOf(mj, spec), model: mj.mj_compile(spec, files) };
  } catch (error) {
    const text = error instanceof Error ? error.message : String(error);
    const hint = /Poisson/.test(text) ? "; use an engine for incompressible solids: tendon-softbody with hex8-sri" : "";
    throw sceneError(text.replace(/^(MuJoCo Error: |Could not create Spec from XML string: |Error: )+/, "").trim() + hint);
  } finally {
    spec?.delete();
    files.delete();
  }
}

const isAlike = (values: Float64Array, at: number, expected: readonly number[]): boolean =>
  expected.every((value, i) => values[at + i] === value);

/** Sets stiff contact for each of the `count` geoms or flexes with MuJoCo's default. Returns their number. */
function stiffen(solref: Float64Array, solimp: Float64Array, count: number): number {
  let changed = 0;
  const [refs, imps] = [solref.length / count, solimp.length / count];
  for (let i = 0; i < count; ++i) {
    if (!isAlike(solref, refs * i, kDefaultSolref) || !isAlike(solimp, imps * i, kDefaultSolimp)) continue;
    solref.set(kStiffSolref, refs * i);
    solimp.set(kStiffSolimp, imps * i);
    ++changed;
  }
  return changed;
}

/** Throws an Error if the scene is invalid, and calls `warn` if it is questionable. The caller must delete the model.
 */
export function loadModel(mj: MainModule, xml: string, assets: Assets, warn: (text: string) => void): MjModel {
  const { model, flexes } = compile(mj, xml, assets);
  const option = model.opt;
  const soft = flexes.filter(({ young }) => young > 0);
  if (soft.length > 0 && option.integrator !== mj.mjtIntegrator.mjINT_DISCRETE.value) {
    model.delete();
    throw sceneError(`flex "${soft[0]!.name}" is elastic and requires <option integrator="discrete"/>: with other integrators, ` +
      `it can become unstable, and MuJoCo restarts at time 0 without a warning`);
  }
  for (const { name, dim, poisson } of soft) {
    if (dim === 3 && poisson > kLargestPoisson)
      warn(`flex "${name}": at poisson="${poisson}" tetrahedra lock, and the body is several times too stiff; use at most ${kLargestPoisson} ` +
        `(a block of 8 x 8 x 4 cells is then 1.7 times too stiff)`);
  }
  const changed = (model.ngeom > 0 ? stiffen(model.geom_solref, model.geom_solimp, model.ngeom) : 0) +
    (model.nflex > 0 ? stiffen(model.flex_solref, model.flex_solimp, model.nflex) : 0);
  if (changed > 0)
    warn(`the contact of ${changed} geoms and flexes had MuJoCo's default, which is too soft for a tool; it was changed to ` +
      `solref="${kStiffSolref.join(" ")}" solimp="${kStiffSolimp.join(" ")}". Set solref and solimp to use other values`);
  if (2 * option.timestep > kStiffSolref[0]!)
    warn(`timestep="${option.timestep}" softens the contact: MuJoCo increases solref to two steps, so the force depends on the ` +
      `step (0.56 N at 2 ms, 0.48 N at 50 ms); use at most ${kStiffSolref[0]! / 2}`);
  return model;
}
