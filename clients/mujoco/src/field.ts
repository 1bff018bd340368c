// SPDX-License-Identifier: Apache-2.0
import type { MainModule, MjModel } from "@mujoco/mujoco";
import { Field as ClientField, rotated, type Primitive, type Quat, type Vec3 } from "tendon-client";

type Numbers = ArrayLike<number>;
const vector = (from: Numbers, at: number): Vec3 => ({ x: from[at]!, y: from[at + 1]!, z: from[at + 2]! });
const sum = (a: Vec3, b: Vec3): Vec3 => ({ x: a.x + b.x, y: a.y + b.y, z: a.z + b.z });

/** Adds a constructor for MuJoCo geoms to the fields of tendon-client. */
export class Field extends ClientField {
  /**
   * Creates a field from a geom (plane, sphere, capsule, box or mesh) in the frame of its body. The object therefore has
   * the same pose as the body (MjData.xpos, xquat). `spacingMm` is only used for meshes. Throws a RangeError if the geom
   * has another type, or if a mesh is not closed.
   */
  static fromGeom(mj: MainModule, model: MjModel, geom: string, { spacingMm = 1 }: { readonly spacingMm?: number } = {}): ClientField {
    const id: number = mj.mj_name2id(model, mj.mjtObj.mjOBJ_GEOM.value, geom);
    if (id < 0) throw new RangeError(`geom "${geom}": expected the name of a geom of the model`);
    const at = vector(model.geom_pos, 3 * id);
    const [w, x, y, z] = (model.geom_quat as Float64Array).slice(4 * id, 4 * id + 4) as unknown as [number, number, number, number];
    const turn: Quat = { w, x, y, z };
    const size = vector(model.geom_size, 3 * id);
    const inBody = (local: Vec3): Vec3 => sum(at, rotated(turn, local));
    const primitive = (shape: Primitive): ClientField => ClientField.fromPrimitives(shape);
    const types = mj.mjtGeom;
    switch (model.geom_type[id]) {
      case types.mjGEOM_PLANE.value:
        return primitive({ kind: "plane", at, normal: rotated(turn, { x: 0, y: 0, z: 1 }) });
      case types.mjGEOM_SPHERE.value:
        return primitive({ kind: "sphere", centre: at, radius: size.x });
      case types.mjGEOM_CAPSULE.value:
        return primitive({
          kind: "capsule", start: inBody({ x: 0, y: 0, z: -size.y }), end: inBody({ x: 0, y: 0, z: size.y }), radius: size.x,
        });
      case types.mjGEOM_BOX.value:
        return primitive({ kind: "box", centre: at, half: size, turn });
      case types.mjGEOM_MESH.value: {
        const mesh: number = model.geom_dataid[id];
        const rows = (from: Numbers, first: number, count: number): Vec3[] =>
          Array.from({ length: count }, (_, i) => vector(from, 3 * (first + i)));
        const points = rows(model.mesh_vert, model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]).map(inBody);
        const faces = rows(model.mesh_face, model.mesh_faceadr[mesh], model.mesh_facenum[mesh]);
        return ClientField.fromTriangles(
          points.map((p) => [p.x, p.y, p.z] as const), faces.map((f) => [f.x, f.y, f.z] as const), spacingMm, `geom "${geom}"`);
      }
      default:
        throw new RangeError(`geom "${geom}" has type ${model.geom_type[id]}: expected a plane, sphere, capsule, box or mesh`);
    }
  }
}
