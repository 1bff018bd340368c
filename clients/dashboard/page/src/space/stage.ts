// SPDX-License-Identifier: Apache-2.0
//
// The 3-D view. Only this file and prop.ts use three.js; panel.ts loads them when needed.
import {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, PerspectiveCamera, Quaternion, Scene, Sprite,
  SpriteMaterial, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
import { theme } from "../dom.js";
import type { HandleInfo } from "../stream.js";
import type { Track } from "../track.js";
import { figureOf, frameOf, poseAt, rotated, threeOrder, wordsOf, type Figure, type Quat, type Vec } from "./figure.js";
import { Orbit, gridOf } from "./orbit.js";
import { Prop, kPathPoints, kUsualTorque } from "./prop.js";
import { TouchedSurface } from "./surface.js";

export interface Shown {
  readonly name: string;
  readonly track: Track;
  /** s, in the clock of the track. */
  readonly time: number;
  readonly handle: HandleInfo | null;
  /** m, base frame; null: unknown. */
  readonly workspace: readonly [Vec, Vec] | null;
  readonly watched: boolean;
}

/** s, duration of the drawn path. */
export const kPathSpan = 3;
const kFieldOfView = 22;
/** Height of a name relative to a box. */
const kTitle = 0.075;
const kRight = new Vector3(1, 0, 0);
const kUp = new Vector3(0, 1, 0);
const kRoom = 0.012;
const kLeastHalf = 0.06;

interface Box {
  readonly min: Vec;
  readonly max: Vec;
}

/** One device on the stage. Static parts are rebuilt when its name, frame or box changes. */
class Place {
  /** In its cell, rotated by the user, and in the coordinates of the device. */
  readonly group = new Group();
  readonly turned = new Group();
  readonly inner = new Group();
  title = new Sprite();
  readonly prop: Prop;
  readonly still = new Group();
  readonly path = new Float32Array(3 * kPathPoints);
  readonly surface = new TouchedSurface();
  /** Identifies the surface that is drawn, to build it again only after a change. */
  surfaceKey = "";
  patches = 0;
  key = "";
  box: Box = { min: [0, 0, 0], max: [0, 0, 0] };
  figure: Figure | undefined;

  constructor(triad: (length: number) => Group) {
    this.prop = new Prop(triad);
    this.inner.add(this.still, this.prop.object);
    this.turned.add(this.inner);
    this.group.add(this.turned, this.title);
  }
}

export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(kFieldOfView, 1, 0.01, 20);
  readonly #orbit: Orbit;
  readonly #places: Place[] = [];
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

  /** Draws. Returns a description in words. */
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
    const local = eye.clone().sub(place.group.position).applyQuaternion(place.turned.quaternion.clone().invert()).sub(place.inner.position);
    const most = handle && handle.max_torque_nm > 0 ? handle.max_torque_nm : kUsualTorque;
    // Width of two pixels in the center of the picture.
    const width = (Math.tan((kFieldOfView * Math.PI) / 360) * eye.z * 2.2) / Math.max(this.canvas.clientHeight, 1);
    place.prop.show(place.figure, most, place.path, n, local, width);
    this.#drawSurface(place, track, frame, track.column("field")[i] ?? NaN);
    return place.figure ? wordsOf(place.figure, place.patches) : "no state has come";
  }

  /** Draws the surface of the field that is in use, as far as it was touched in the whole track. */
  #drawSurface(place: Place, track: Track, frame: Quat, generation: number): void {
    place.surface.follow(track);
    const key = `${place.surface.version} ${generation} ${frame}`;
    if (key === place.surfaceKey) return;
    place.surfaceKey = key;
    const patches = place.surface.patches(generation, frame);
    place.patches = patches.length;
    place.prop.showSurface(patches);
  }

  #arrange(): void {
    this.#shown.forEach((device, i) => {
      const place = this.#places[i]!;
      const frame = frameOf(device.handle);
      const extent = device.workspace ?? extentOf(device.track);
      const key = JSON.stringify([device.name, frame, extent, device.watched, this.#shown.length]);
      if (key === place.key) return;
      place.key = key;
      place.box = boxOf(extent, frame);
      place.prop.paint((name) => this.#colour(name), device.watched);
      this.#build(place, device, frame);
      this.#moved = true;
    });
  }

  /**
   * Arranges the devices in a grid that fills the picture, and sets the camera. User rotation is applied to each
   * device about its center, so that all are seen from the same direction.
   */
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
    if (!this.#moved || this.#shown.length === 0) return this.#camera.position;
    this.#moved = false;
    const { turn, rise, zoom } = this.#orbit.view;
    const turned = new Quaternion().setFromAxisAngle(kRight, rise).multiply(new Quaternion().setFromAxisAngle(kUp, -turn));
    const places = this.#places.slice(0, this.#shown.length);
    const corner = new Vector3();
    const half = new Vector3();
    for (const { box } of places) {
      for (const signs of kCorners) {
        corner.fromArray(signs.map((s, k) => (s * (box.max[k]! - box.min[k]!)) / 2)).applyQuaternion(turned);
        half.max(corner);
      }
    }
    const cell = { width: 2.2 * half.x, height: 2 * half.y * (1 + 2 * kTitle) };
    const { columns, rows } = gridOf(places.length, cell.width / cell.height, width / height);
    places.forEach((place, i) => {
      const inRow = Math.min(columns, places.length - columns * Math.floor(i / columns));
      place.group.position.set(((i % columns) - (inRow - 1) / 2) * cell.width, ((rows - 1) / 2 - Math.floor(i / columns)) * cell.height, 0);
      place.turned.quaternion.copy(turned);
      place.inner.position.set(...([0, 1, 2].map((k) => -(place.box.min[k]! + place.box.max[k]!) / 2) as [number, number, number]));
      const tall = 2 * half.y * kTitle;
      place.title.position.set(0, half.y + 0.75 * tall, 0);
      place.title.scale.set(tall * (place.title.userData["aspect"] as number), tall, 1);
    });
    const slope = Math.tan((kFieldOfView * Math.PI) / 360);
    const far = Math.max((columns * cell.width) / 2 / (slope * this.#camera.aspect), (rows * cell.height) / 2 / slope) * 1.03 + half.z;
    this.#camera.position.set(0, 0, far / zoom);
    this.#camera.lookAt(0, 0, 0);
    return this.#camera.position;
  }

  #build(place: Place, { name, watched }: Shown, frame: Quat): void {
    this.#clear(place.still);
    const { min, max } = place.box;
    const size: Vec = [max[0] - min[0], max[1] - min[1], max[2] - min[2]];
    const edges = new EdgesGeometry(new BoxGeometry(...size));
    const box = new LineSegments(edges, this.#lines.box);
    box.position.set((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
    // In a corner, because at the origin it would look like force arrows.
    const base = this.#triad(Math.max(0.025, 0.17 * Math.min(...size)), this.#letters());
    base.quaternion.set(...threeOrder(frame));
    base.position.set(min[0], min[1], min[2]);
    place.still.add(box, floorOf(place.box, this.#lines.floor), base);
    const side = this.#text("your side", "quiet", 0.065 * Math.max(size[0], size[1]));
    side.position.set((min[0] + max[0]) / 2, min[1], max[2]);
    place.still.add(side);
    place.title.material.map?.dispose();
    place.title.material.dispose();
    place.group.remove(place.title);
    place.title = this.#text(name, watched ? "text" : "quiet", 1);
    place.group.add(place.title);
  }

  #letters(): (axis: number) => Sprite {
    return (axis) => this.#text("xyz"[axis]!, "xyz"[axis]!, 0.013);
  }

  /** Three axes in the colors of the position plot. */
  #triad(length: number, letter?: (axis: number) => Sprite): Group {
    const triad = new Group();
    const turns = [new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), -Math.PI / 2), new Quaternion(), new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2)];
    turns.forEach((turn, axis) => {
      const shaft = new CylinderGeometry(0.0005, 0.0005, length, 8).translate(0, length / 2, 0);
      const head = new ConeGeometry(0.0017, 0.006, 12).translate(0, length + 0.003, 0);
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
    sprite.userData["aspect"] = canvas.width / canvas.height;
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
    // Colors with eight digits contain opacity, which Color does not support.
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

/** Returns the bounding box of a base-frame box in the operator frame. */
function boxOf([low, high]: readonly [Vec, Vec], frame: Quat): Box {
  const corners = kCorners.map((signs) => rotated(frame, signs.map((s, k) => (s < 0 ? low[k]! : high[k]!)) as unknown as Vec));
  const of = (least: (...values: number[]) => number): Vec => [0, 1, 2].map((k) => least(...corners.map((c) => c[k]!))) as unknown as Vec;
  return { min: of(Math.min), max: of(Math.max) };
}

/** Returns the range of the path, rounded to 2 cm to keep the picture stable, for devices without a workspace. */
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
