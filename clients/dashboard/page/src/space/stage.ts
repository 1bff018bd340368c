// SPDX-License-Identifier: Apache-2.0
//
// The 3-D view itself. Only this file and prop.ts use three.js; panel.ts loads them when somebody asks for the view.
import {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, PerspectiveCamera, Quaternion, Scene, Sprite,
  SpriteMaterial, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
import { theme } from "../dom.js";
import type { HandleInfo } from "../stream.js";
import type { Track } from "../track.js";
import { figureOf, frameOf, poseAt, rotated, threeOrder, wordsOf, type Figure, type Quat, type Vec } from "./figure.js";
import { Orbit, eyeOf } from "./orbit.js";
import { Prop, kPathPoints, kUsualTorque } from "./prop.js";

/** One device, and the instant at which it is shown. */
export interface Shown {
  readonly name: string;
  readonly track: Track;
  /** s on the track's clock. */
  readonly time: number;
  readonly handle: HandleInfo | null;
  /** m, base frame; null: nobody says. */
  readonly workspace: readonly [Vec, Vec] | null;
  readonly watched: boolean;
}

/** s of the path that is drawn. */
export const kPathSpan = 3;
const kFieldOfView = 30;
/** m between two devices side by side: where they really stand to each other nobody tells. */
const kBetween = 0.05;
const kRoom = 0.012;
const kLeastHalf = 0.06;

interface Box {
  readonly min: Vec;
  readonly max: Vec;
}

/** A device's place on the stage: what stands still is built anew when its name, frame or box changes. */
class Place {
  readonly group = new Group();
  readonly prop: Prop;
  readonly still = new Group();
  readonly path = new Float32Array(3 * kPathPoints);
  key = "";
  box: Box = { min: [0, 0, 0], max: [0, 0, 0] };
  figure: Figure | undefined;

  constructor(triad: (length: number) => Group) {
    this.prop = new Prop(triad);
    this.group.add(this.still, this.prop.object);
  }
}

export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(kFieldOfView, 1, 0.01, 20);
  readonly #orbit: Orbit;
  readonly #places: Place[] = [];
  readonly #middle = new Vector3();
  readonly #half = new Vector3();
  readonly #axes: readonly MeshBasicMaterial[];
  readonly #lines = { box: new LineBasicMaterial({ transparent: true, opacity: 0.75 }), floor: new LineBasicMaterial() };
  #colours = new Map<string, Color>();
  #shown: readonly Shown[] = [];
  #moved = true;
  #size = "";

  constructor(readonly canvas: HTMLCanvasElement, moved: () => void) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(-0.5, 1, 0.8);
    this.#scene.add(new AmbientLight(0xffffff, 1.5), sun);
    this.#axes = ["x", "y", "z"].map(() => new MeshBasicMaterial());
    this.#orbit = new Orbit(canvas, () => {
      this.#moved = true;
      moved();
    });
  }

  /** Draws; returns in words what is seen. */
  draw(shown: readonly Shown[]): string {
    this.#shown = shown;
    if (this.#colours.size === 0) this.#moved = true;
    while (this.#places.length < shown.length) {
      const place = new Place((length) => this.#triad(length));
      this.#places.push(place);
      this.#scene.add(place.group);
    }
    this.#places.forEach((place, i) => (place.group.visible = i < shown.length));
    this.#arrange();
    const eye = this.#look();
    const seen = shown.map((device, i) => {
      const place = this.#places[i]!;
      const words = this.#drawDevice(place, device, eye);
      return device.name === "" ? words : `${device.name}: ${words}`;
    });
    this.#renderer.render(this.#scene, this.#camera);
    return seen.join("; ");
  }

  figures(): readonly (Figure | undefined)[] {
    return this.#shown.map((_, i) => this.#places[i]!.figure);
  }

  /** The theme has changed. */
  repaint(): void {
    this.#colours.clear();
    for (const place of this.#places) place.key = "";
  }

  destroy(): void {
    for (const place of this.#places) {
      place.prop.dispose();
      this.#clear(place.still);
    }
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  #drawDevice(place: Place, { track, time, handle }: Shown, eye: Vector3): string {
    const at = track.at(time);
    const i = at < track.end ? at : track.end - 1;
    const pose = poseAt(track, i);
    place.figure = pose && figureOf(pose, handle);
    const frame = frameOf(handle);
    const first = Math.max(track.at(time - kPathSpan), track.begin);
    const n = pose ? Math.min(kPathPoints, i - first + 1) : 0;
    const [x, y, z] = [track.column("x"), track.column("y"), track.column("z")];
    for (let k = 0; k < n; ++k) {
      const j = n < 2 ? i : Math.round(first + ((i - first) * k) / (n - 1));
      const [a, b, c] = rotated(frame, [x[j]!, y[j]!, z[j]!]);
      place.path[3 * k] = a;
      place.path[3 * k + 1] = b;
      place.path[3 * k + 2] = c;
    }
    const local = eye.clone().sub(place.group.position);
    const most = handle && handle.max_torque_nm > 0 ? handle.max_torque_nm : kUsualTorque;
    // As wide as two pixels are in the middle of the picture.
    const width = (Math.tan((kFieldOfView * Math.PI) / 360) * eye.distanceTo(this.#middle) * 2.2) / Math.max(this.canvas.clientHeight, 1);
    place.prop.show(place.figure, most, place.path, n, local, width);
    return place.figure ? wordsOf(place.figure) : "no state has come";
  }

  /** Puts the devices side by side, in rows where the picture is narrow. */
  #arrange(): void {
    const shown = this.#shown;
    const narrow = this.canvas.clientWidth < this.canvas.clientHeight * 1.3;
    const columns = narrow ? Math.ceil(Math.sqrt(shown.length)) : shown.length;
    let changed = false;
    shown.forEach((device, i) => {
      const place = this.#places[i]!;
      const frame = frameOf(device.handle);
      const key = JSON.stringify([device.name, frame, device.workspace ?? extentOf(device.track), device.watched, columns, shown.length]);
      if (key === place.key) return;
      place.key = key;
      place.box = boxOf(device.workspace ?? extentOf(device.track), frame);
      place.prop.paint((name) => this.#colour(name), device.watched);
      this.#build(place, device, frame);
      changed = true;
    });
    if (!changed) return;
    const size = [0, 1, 2].map((k) => Math.max(...shown.map((_, i) => this.#places[i]!.box.max[k]! - this.#places[i]!.box.min[k]!)));
    shown.forEach((_, i) => {
      const { box, group } = this.#places[i]!;
      const middle = [0, 1, 2].map((k) => (box.min[k]! + box.max[k]!) / 2);
      group.position.set((i % columns) * (size[0]! + kBetween) - middle[0]!, -Math.floor(i / columns) * (size[1]! + kBetween) - middle[1]!, -middle[2]!);
    });
    const rows = Math.ceil(shown.length / columns);
    this.#half.set((columns * size[0]! + (columns - 1) * kBetween) / 2, (rows * size[1]! + (rows - 1) * kBetween) / 2, size[2]! / 2);
    this.#middle.set(this.#half.x - size[0]! / 2, -(this.#half.y - size[1]! / 2), 0);
    this.#moved = true;
  }

  /** Puts the camera where all boxes fill the picture; returns where that is. */
  #look(): Vector3 {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const size = `${width} ${height} ${window.devicePixelRatio}`;
    if (size !== this.#size && width > 0 && height > 0) {
      this.#size = size;
      this.#renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
      this.#renderer.setSize(width, height, false);
      this.#camera.aspect = width / height;
      this.#camera.updateProjectionMatrix();
      this.#moved = true;
    }
    if (this.#moved) {
      this.#moved = false;
      const [x, y, z] = eyeOf(this.#orbit.view);
      const back = new Vector3(x, y, z);
      const right = new Vector3(0, 1, 0).cross(back).normalize();
      const up = back.clone().cross(right);
      const slope = Math.tan((kFieldOfView * Math.PI) / 360);
      let far = 0.1;
      for (const [a, b, c] of kCorners) {
        const corner = new Vector3(a * this.#half.x, b * this.#half.y, c * this.#half.z);
        const ahead = corner.dot(back);
        far = Math.max(far, ahead + Math.abs(corner.dot(right)) / (slope * this.#camera.aspect), ahead + Math.abs(corner.dot(up)) / slope);
      }
      // A little more than the boxes: their names stand below them.
      this.#camera.position.copy(back).multiplyScalar((far * 1.06) / this.#orbit.view.zoom).add(this.#middle);
      this.#camera.up.set(0, 1, 0);
      this.#camera.lookAt(this.#middle);
    }
    return this.#camera.position;
  }

  /** What stands still: the box, the floor, the frame of the base, and the name. */
  #build(place: Place, { name, watched, handle }: Shown, frame: Quat): void {
    this.#clear(place.still);
    const { min, max } = place.box;
    const size: Vec = [max[0] - min[0], max[1] - min[1], max[2] - min[2]];
    const edges = new EdgesGeometry(new BoxGeometry(...size));
    const box = new LineSegments(edges, this.#lines.box);
    box.position.set((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
    const base = this.#triad(Math.max(0.035, 0.22 * Math.min(...size)), this.#letters());
    base.quaternion.set(...threeOrder(frame));
    place.still.add(box, floorOf(place.box, this.#lines.floor), base);
    const tall = 0.075 * Math.max(size[0], size[1]);
    const title = this.#text(name === "" ? "device" : name, watched ? "text" : "quiet", tall);
    title.position.set((min[0] + max[0]) / 2, max[1] - tall * 0.1 + tall * 0.75, max[2]);
    const you = this.#text(handle?.operator_from_device ? "you are here" : "its frame is not known", "quiet", tall * 0.7);
    you.position.set((min[0] + max[0]) / 2, min[1] + tall * 0.45, max[2]);
    place.still.add(title, you);
  }

  #letters(): (axis: number) => Sprite {
    return (axis) => this.#text("xyz"[axis]!, "xyz"[axis]!, 0.013);
  }

  /** Three axes, in the colours of the position's plot. */
  #triad(length: number, letter?: (axis: number) => Sprite): Group {
    const triad = new Group();
    const turns = [new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), -Math.PI / 2), new Quaternion(), new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2)];
    turns.forEach((turn, axis) => {
      const shaft = new CylinderGeometry(0.0007, 0.0007, length, 8).translate(0, length / 2, 0);
      const head = new ConeGeometry(0.0022, 0.007, 12).translate(0, length + 0.003, 0);
      for (const shape of [shaft, head]) {
        const part = new Mesh(shape, this.#axes[axis]!);
        part.quaternion.copy(turn);
        triad.add(part);
      }
      if (!letter) return;
      const sprite = letter(axis);
      sprite.position.set(0, length + 0.014, 0).applyQuaternion(turn);
      triad.add(sprite);
    });
    return triad;
  }

  #text(text: string, colour: string, tall: number): Sprite {
    const canvas = document.createElement("canvas");
    const paint = canvas.getContext("2d")!;
    const font = "600 52px system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";
    paint.font = font;
    canvas.width = Math.ceil(paint.measureText(text).width) + 8;
    canvas.height = 68;
    paint.font = font;
    paint.textBaseline = "middle";
    paint.fillStyle = theme(colour);
    paint.fillText(text, 4, 36);
    const map = new CanvasTexture(canvas);
    map.colorSpace = SRGBColorSpace;
    const sprite = new Sprite(new SpriteMaterial({ map, depthWrite: false }));
    sprite.scale.set((tall * canvas.width) / canvas.height, tall, 1);
    return sprite;
  }

  #colour(name: string): Color {
    if (this.#colours.size === 0) {
      this.#colours.set("", new Color());
      ["x", "y", "z"].forEach((axis, i) => this.#axes[i]!.color.copy(this.#colour(axis)));
      this.#lines.box.color.copy(this.#colour("permitted"));
      this.#lines.floor.color.copy(this.#colour("line"));
    }
    const known = this.#colours.get(name);
    if (known) return known;
    // Eight digits hold an opacity, which a Color has not.
    const colour = new Color(theme(name).slice(0, 7));
    this.#colours.set(name, colour);
    return colour;
  }

  #clear(group: Group): void {
    group.traverse((part) => {
      if (part instanceof Mesh || part instanceof LineSegments) (part.geometry as BufferGeometry).dispose();
      if (part instanceof Sprite) {
        part.material.map?.dispose();
        part.material.dispose();
      }
    });
    group.clear();
  }
}

const kCorners = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => [-1, 1].map((c): Vec => [a, b, c])));

/** The box about the corners of a base-frame box, in the operator's frame. */
function boxOf([low, high]: readonly [Vec, Vec], frame: Quat): Box {
  const corners = kCorners.map((signs) => rotated(frame, signs.map((s, k) => (s < 0 ? low[k]! : high[k]!)) as unknown as Vec));
  const of = (least: (...values: number[]) => number): Vec => [0, 1, 2].map((k) => least(...corners.map((c) => c[k]!))) as unknown as Vec;
  return { min: of(Math.min), max: of(Math.max) };
}

/** Where a device has been, in steps of 2 cm so that the picture does not breathe: for one whose workspace nobody tells. */
function extentOf(track: Track): readonly [Vec, Vec] {
  const grid = 0.02;
  const ends = (["x", "y", "z"] as const).map((name) => {
    const column = track.column(name);
    let [low, high] = [Infinity, -Infinity];
    const step = Math.max(1, Math.floor(track.length / 400));
    for (let i = track.begin; i < track.end; i += step) {
      if (column[i]! < low) low = column[i]!;
      if (column[i]! > high) high = column[i]!;
    }
    if (!(low <= high)) [low, high] = [0, 0];
    const middle = grid * Math.round((low + high) / 2 / grid);
    const half = Math.max(kLeastHalf, grid * Math.ceil(((high - low) / 2 + kRoom) / grid));
    return [middle - half, middle + half] as const;
  });
  return [ends.map((e) => e[0]) as unknown as Vec, ends.map((e) => e[1]) as unknown as Vec];
}

/** A grid on the bottom of a box. */
function floorOf({ min, max }: Box, material: LineBasicMaterial): LineSegments {
  const places: number[] = [];
  const lines = 6;
  for (let i = 0; i <= lines; ++i) {
    const x = min[0] + ((max[0] - min[0]) * i) / lines;
    const z = min[2] + ((max[2] - min[2]) * i) / lines;
    places.push(x, min[1], min[2], x, min[1], max[2], min[0], min[1], z, max[0], min[1], z);
  }
  return new LineSegments(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(places), 3)), material);
}
