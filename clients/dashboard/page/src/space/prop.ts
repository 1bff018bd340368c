// SPDX-License-Identifier: Apache-2.0
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CircleGeometry, Color, ConeGeometry, CylinderGeometry, DoubleSide, Group,
  InstancedMesh, Line, LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Quaternion, RingGeometry,
  SphereGeometry, Vector3, type Material, type Object3D,
} from "three";
import { kLeastForce, kLeastTorque, type Figure, type Vec } from "./figure.js";
import { kMostPatches, kPatchCell, type Patch } from "./surface.js";

/** Length of a force arrow: 1 cm/N. */
export const kMetresPerNewton = 0.01;
const kLongestArrow = 0.15;
/** N·m, used if the maximum torque is unknown. */
export const kUsualTorque = 0.2;
export const kPathPoints = 220;

/** Returns a color of the theme by its name in style.css. */
export type Paint = (name: string) => Color;

const kUp = new Vector3(0, 1, 0);
const kAhead = new Vector3(0, 0, 1);
const kOne = new Vector3(1, 1, 1);
const scratch = { to: new Vector3(), at: new Vector3(), turn: new Quaternion(), place: new Matrix4() };

const shapes = {
  shaft: new CylinderGeometry(0.5, 0.5, 1, 14).translate(0, 0.5, 0),
  head: new ConeGeometry(0.5, 1, 20).translate(0, 0.5, 0),
  tip: new ConeGeometry(0.0042, 0.026, 28).rotateX(-Math.PI / 2).translate(0, 0, 0.013),
  handle: new CylinderGeometry(0.0042, 0.0052, 0.085, 28).rotateX(Math.PI / 2).translate(0, 0, 0.0685),
  end: new SphereGeometry(0.0052, 24, 14).translate(0, 0, 0.111),
  knob: new SphereGeometry(0.006, 24, 14),
  // From the hinge along −z.
  finger: new BoxGeometry(0.0035, 0.008, 0.036).translate(0, 0, -0.018),
  ball: new SphereGeometry(0.0065, 28, 18),
  dot: new SphereGeometry(0.0034, 16, 10),
  disc: new CircleGeometry(0.038, 48),
  rim: new RingGeometry(0.0372, 0.0384, 64),
  patch: new CircleGeometry(0.75 * kPatchCell, 12),
};

/** rad, sweep of the ring for the maximum torque. */
const kMostSweep = (320 / 180) * Math.PI;
const kRing = { radius: 0.024, thick: 0.085, segments: 80, sides: 8 };

/** A tube along an arc of radius 1 about z, starting at +x. The triangles are ordered along the arc for partial
 * drawing. */
function arcShape(): BufferGeometry {
  const { segments, sides, thick } = kRing;
  const [places, normals, index]: [number[], number[], number[]] = [[], [], []];
  for (let i = 0; i <= segments; ++i) {
    const a = (i / segments) * kMostSweep;
    for (let j = 0; j < sides; ++j) {
      const b = (j / sides) * 2 * Math.PI;
      const normal = [Math.cos(a) * Math.cos(b), Math.sin(a) * Math.cos(b), Math.sin(b)];
      normals.push(...normal);
      places.push(Math.cos(a) + thick * normal[0]!, Math.sin(a) + thick * normal[1]!, thick * normal[2]!);
      if (i === segments) continue;
      const [here, beside] = [i * sides + j, i * sides + ((j + 1) % sides)];
      index.push(here, here + sides, beside, beside, here + sides, beside + sides);
    }
  }
  const shape = new BufferGeometry();
  shape.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  shape.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
  shape.setIndex(index);
  return shape;
}

/** An arrow from its own origin. Thin arrows are offset from thick ones. */
class Arrow {
  readonly object = new Group();
  readonly #shaft: Mesh;
  readonly #head: Mesh;

  constructor(material: Material, readonly width: number) {
    this.#shaft = new Mesh(shapes.shaft, material);
    this.#head = new Mesh(shapes.head, material);
    this.object.add(this.#shaft, this.#head);
  }

  show(newtons: Vec | undefined): void {
    const size = newtons ? Math.hypot(...newtons) : 0;
    this.object.visible = size > kLeastForce;
    if (!this.object.visible) return;
    const length = Math.min(size * kMetresPerNewton, kLongestArrow);
    const head = Math.min(this.width * 2.8, length * 0.6);
    this.object.quaternion.setFromUnitVectors(kUp, scratch.to.fromArray(newtons!).divideScalar(size));
    this.#shaft.scale.set(this.width, Math.max(length - head, 1e-5), this.width);
    this.#head.position.y = length - head;
    this.#head.scale.set(head * 0.85, head, head * 0.85);
  }
}

/** A torque: a ring about its axis with an arrow in the direction of the right-hand rule. Its length is proportional.
 */
class Ring {
  readonly object = new Group();
  readonly #arc: Mesh;
  readonly #head: Mesh;

  constructor(material: Material) {
    this.#arc = new Mesh(arcShape(), material);
    this.#head = new Mesh(shapes.head, material);
    this.#head.scale.set(0.42, 0.5, 0.42);
    this.object.add(this.#arc, this.#head);
    this.object.scale.setScalar(kRing.radius);
  }

  show(torque: Vec | undefined, most: number): void {
    const size = torque ? Math.hypot(...torque) : 0;
    this.object.visible = size > kLeastTorque;
    if (!this.object.visible) return;
    const segments = Math.max(1, Math.round(Math.min(size / most, 1) * kRing.segments));
    this.#arc.geometry.setDrawRange(0, segments * kRing.sides * 6);
    const angle = (segments / kRing.segments) * kMostSweep;
    this.#head.position.set(Math.cos(angle), Math.sin(angle), 0);
    this.#head.rotation.z = angle;
    this.object.quaternion.setFromUnitVectors(kAhead, scratch.to.fromArray(torque!).divideScalar(size));
  }

  dispose(): void {
    this.#arc.geometry.dispose();
  }
}

/** The path of the tool: a ribbon that faces the viewer and fades with age. */
class Path {
  readonly object: Mesh;
  readonly #places = new Float32Array(kPathPoints * 6);
  readonly #geometry = new BufferGeometry();

  constructor(material: MeshBasicMaterial) {
    const fade = new Float32Array(kPathPoints * 8).fill(1);
    const index: number[] = [];
    for (let i = 0; i < kPathPoints; ++i) {
      fade[8 * i + 3] = fade[8 * i + 7] = (i / (kPathPoints - 1)) ** 1.5;
      if (i + 1 < kPathPoints) index.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2);
    }
    this.#geometry.setAttribute("position", new BufferAttribute(this.#places, 3));
    this.#geometry.setAttribute("color", new BufferAttribute(fade, 4));
    this.#geometry.setIndex(index);
    this.object = new Mesh(this.#geometry, material);
    this.object.frustumCulled = false;
  }

  /** `points` contains x, y, z of `n` positions, oldest first. `eye` is the viewpoint in the same frame. */
  show(points: Float32Array, n: number, eye: Vector3, width: number): void {
    this.object.visible = n >= 2;
    if (!this.object.visible) return;
    const out = this.#places;
    let [sx, sy, sz] = [0, 0, 0];
    for (let i = 0; i < n; ++i) {
      const [a, b, c] = [3 * Math.max(i - 1, 0), 3 * Math.min(i + 1, n - 1), 3 * i];
      const [dx, dy, dz] = [points[b]! - points[a]!, points[b + 1]! - points[a + 1]!, points[b + 2]! - points[a + 2]!];
      const [ex, ey, ez] = [eye.x - points[c]!, eye.y - points[c + 1]!, eye.z - points[c + 2]!];
      const [x, y, z] = [dy * ez - dz * ey, dz * ex - dx * ez, dx * ey - dy * ex];
      const length = Math.sqrt(x * x + y * y + z * z);
      // A resting hand has no direction; keep the previous one.
      if (length > 1e-9) [sx, sy, sz] = [(x / length) * width, (y / length) * width, (z / length) * width];
      for (const [k, sign] of [[0, 1], [3, -1]] as const) {
        out[6 * i + k] = points[c]! + sign * sx;
        out[6 * i + k + 1] = points[c + 1]! + sign * sy;
        out[6 * i + k + 2] = points[c + 2]! + sign * sz;
      }
    }
    this.#geometry.getAttribute("position").needsUpdate = true;
    // The newest position always has full opacity.
    const first = kPathPoints - n;
    if (first > 0) {
      out.copyWithin(6 * first, 0, 6 * n);
    }
    this.#geometry.setDrawRange(6 * first, 6 * (n - 1));
  }

  dispose(): void {
    this.#geometry.dispose();
  }
}

function span(line: Line, from: Vec, to: Vec): void {
  const ends = line.geometry.getAttribute("position");
  ends.setXYZ(0, ...from);
  ends.setXYZ(1, ...to);
  ends.needsUpdate = true;
}

/** All moving parts of one device, in the operator frame with the origin of the device. */
export class Prop {
  readonly object = new Group();
  readonly #tool = new Group();
  readonly #stylus: Object3D[];
  readonly #point: Object3D[];
  readonly #fingers: readonly [Group, Group];
  readonly #dots: Mesh[] = [];
  readonly #frame: Group;
  readonly #force: Arrow;
  readonly #wanted: Arrow;
  readonly #hand: Arrow;
  readonly #ring: Ring;
  readonly #plane = new Group();
  readonly #gap: Line;
  readonly #proxy: Mesh;
  readonly #depth: Line;
  readonly #path: Path;
  readonly #surface: InstancedMesh;
  readonly #materials: Record<"body" | "tip" | "applied" | "wanted" | "torque" | "hand" | "off" | "on" | "finger" | "surface", MeshLambertMaterial>;
  readonly #flat: Record<"plane" | "rim" | "path" | "proxy", MeshBasicMaterial>;
  readonly #line = new LineBasicMaterial();

  /** `triad` creates three axes of the given length. */
  constructor(triad: (length: number) => Group) {
    const lit = (): MeshLambertMaterial => new MeshLambertMaterial();
    this.#materials = { body: lit(), tip: lit(), applied: lit(), wanted: lit(), torque: lit(), hand: lit(), off: lit(), on: lit(), finger: lit(), surface: lit() };
    const see = (opacity: number): MeshBasicMaterial => new MeshBasicMaterial({ transparent: true, opacity, side: DoubleSide, depthWrite: false });
    this.#flat = { plane: see(0.28), rim: see(0.9), path: see(0.85), proxy: see(0.55) };
    this.#flat.path.vertexColors = true;
    const m = this.#materials;
    const tip = new Mesh(shapes.tip, m.tip);
    this.#stylus = [new Mesh(shapes.handle, m.body), new Mesh(shapes.end, m.body), tip];
    this.#point = [new Mesh(shapes.ball, m.tip), new Mesh(shapes.knob, m.tip)];
    this.#fingers = [new Group(), new Group()];
    for (const finger of this.#fingers) finger.add(new Mesh(shapes.finger, m.finger));
    this.#frame = triad(0.02);
    this.#tool.add(...this.#stylus, ...this.#point, ...this.#fingers, this.#frame);
    this.#force = new Arrow(m.applied, 0.0062);
    this.#wanted = new Arrow(m.wanted, 0.003);
    this.#hand = new Arrow(m.hand, 0.0026);
    this.#ring = new Ring(m.torque);
    this.#plane.add(new Mesh(shapes.disc, this.#flat.plane), new Mesh(shapes.rim, this.#flat.rim));
    this.#gap = new Line(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(6), 3)), this.#line);
    this.#gap.frustumCulled = false;
    this.#proxy = new Mesh(shapes.ball, this.#flat.proxy);
    this.#depth = this.#gap.clone();
    this.#depth.geometry = this.#gap.geometry.clone();
    this.#path = new Path(this.#flat.path);
    m.surface.side = DoubleSide;
    this.#surface = new InstancedMesh(shapes.patch, m.surface, kMostPatches);
    this.#surface.frustumCulled = false;
    this.#surface.count = 0;
    this.object.add(this.#surface, this.#tool, this.#force.object, this.#wanted.object, this.#hand.object, this.#ring.object, this.#plane, this.#gap, this.#proxy, this.#depth, this.#path.object);
  }

  paint(colour: Paint, watched: boolean): void {
    const m = this.#materials;
    m.body.color.copy(colour("quiet"));
    m.tip.color.copy(colour(watched ? "accent" : "quiet"));
    m.finger.color.copy(colour(watched ? "accent" : "quiet"));
    m.applied.color.copy(colour("applied"));
    m.wanted.color.copy(colour("wanted"));
    m.torque.color.copy(colour("torque"));
    m.hand.color.copy(colour("text"));
    m.off.color.copy(colour("line"));
    m.surface.color.copy(colour("second"));
    m.on.color.copy(colour("notice"));
    m.on.emissive.copy(colour("notice")).multiplyScalar(0.7);
    this.#flat.plane.color.copy(colour("energy"));
    this.#flat.rim.color.copy(colour("energy"));
    this.#flat.path.color.copy(colour("applied"));
    this.#flat.proxy.color.copy(colour("second"));
    this.#line.color.copy(colour("text"));
  }

  /** `figure` is undefined before the first state. */
  show(figure: Figure | undefined, mostTorque: number, path: Float32Array, points: number, eye: Vector3, width: number): void {
    this.object.visible = figure !== undefined;
    if (!figure) return;
    this.#tool.position.fromArray(figure.position);
    this.#tool.quaternion.fromArray(figure.quaternion);
    const stylus = figure.kind === "stylus";
    const gripper = figure.opening !== undefined;
    for (const part of this.#stylus) part.visible = stylus;
    this.#point[0]!.visible = !stylus;
    this.#point[1]!.visible = stylus && gripper;
    this.#frame.visible = stylus;
    this.#fingers.forEach((finger, i) => {
      finger.visible = gripper;
      finger.rotation.y = (i === 0 ? 0.5 : -0.5) * (figure.opening ?? 0);
    });
    this.#showButtons(figure, stylus);
    for (const [arrow, value] of [[this.#force, figure.force], [this.#wanted, figure.wanted], [this.#hand, figure.hand]] as const) {
      arrow.object.position.copy(this.#tool.position);
      arrow.show(value);
    }
    this.#ring.object.position.copy(this.#tool.position);
    this.#ring.show(figure.torque, mostTorque);
    this.#showPlane(figure);
    this.#proxy.visible = this.#depth.visible = figure.proxy !== undefined;
    if (figure.proxy) {
      this.#proxy.position.fromArray(figure.proxy.at);
      span(this.#depth, figure.position, figure.proxy.at);
    }
    this.#path.show(path, points, eye, width);
  }

  /** Sets the touched surface, which is drawn until the next call. */
  showSurface(patches: readonly Patch[]): void {
    this.#surface.count = patches.length;
    patches.forEach(({ at, normal }, i) => {
      scratch.turn.setFromUnitVectors(kAhead, scratch.to.fromArray(normal));
      this.#surface.setMatrixAt(i, scratch.place.compose(scratch.at.fromArray(at), scratch.turn, kOne));
    });
    this.#surface.instanceMatrix.needsUpdate = true;
  }

  /** Draws the buttons along the handle. They are lit while pressed. */
  #showButtons(figure: Figure, stylus: boolean): void {
    figure.buttons.forEach((button, i) => {
      let dot = this.#dots[i];
      if (!dot) this.#tool.add((dot = this.#dots[i] = new Mesh(shapes.dot, this.#materials.off)));
      dot.visible = true;
      dot.material = button.held ? this.#materials.on : this.#materials.off;
      dot.scale.setScalar(button.held ? 1.25 : 1);
      dot.position.set(stylus ? 0 : 0.011 * (i - (figure.buttons.length - 1) / 2), stylus ? 0.0058 : 0.016, stylus ? 0.042 + 0.013 * i : 0);
    });
    for (let i = figure.buttons.length; i < this.#dots.length; ++i) this.#dots[i]!.visible = false;
  }

  #showPlane({ plane, position }: Figure): void {
    this.#plane.visible = this.#gap.visible = plane !== undefined;
    if (!plane) return;
    this.#plane.position.fromArray(plane.at);
    this.#plane.quaternion.setFromUnitVectors(kAhead, scratch.to.fromArray(plane.normal));
    span(this.#gap, position, plane.at);
  }

  dispose(): void {
    for (const material of [...Object.values(this.#materials), ...Object.values(this.#flat), this.#line]) material.dispose();
    this.#gap.geometry.dispose();
    this.#depth.geometry.dispose();
    this.#ring.dispose();
    this.#path.dispose();
    this.#surface.dispose();
  }
}
