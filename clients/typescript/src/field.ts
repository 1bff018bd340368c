// SPDX-License-Identifier: Apache-2.0
// Fields: objects that an engine describes once, and that the server renders at the rate of the device, so that a delay of
// the engine does not matter (core/field/README.md).
import { blake2b } from "@noble/hashes/blake2";
import { expect } from "./expect.js";
import { kUnitTolerance } from "./limits.js";
import { closedMesh, NodeDistances, type Point, type Triangle } from "./mesh.js";
import { FieldFixtureKind, type FieldBrick, type FieldDepthTable, type FieldFixture, type FieldMaterial, type Vec3 } from "./messages.js";
import { centreOf, distanceTo, kPrimitiveKinds, numbersOf, type Primitive } from "./shape.js";

const kSide = 8;
/** If the distance of a node to the surface is less than this number of spacings, it must be in a brick. */
const kBand = 2.5;
const kMostBricks = 1023;
const kMostCells = 65536;
const kMostExtent = 2;
const kMostPrimitives = 32;
const kMostMaterials = 8;
const kMostTables = 3;
const kMostEntries = 16;
const kMostFixtures = 4;
/** m, of a table. */
const kLeastStep = 1e-4;
const kMostStep = 0.1;
/** The maximum ratio of the stiffness to the smallest slope of a curve. It must be less than 10 (core/field/material.h). */
const kMostRatio = 8;
const kBiggest = 32767;
const kScaledBand = 16;
/** The distances in spacings between the mesh and the ends of the lattice, whose last node is one spacing before its end. */
const kMargin = [3, 4] as const;

/** A field as it is sent. */
export interface FieldDescription {
  /** The BLAKE2b-256 of the manifest. */
  readonly name: Uint8Array;
  readonly manifest: Uint8Array;
  /** In the order of the manifest. */
  readonly bricks: readonly FieldBrick[];
  readonly materials: readonly FieldMaterial[];
  readonly fixtures: readonly FieldFixture[];
  readonly tables: readonly FieldDepthTable[];
}

/**
 * This table is added to the force of the springs of a material. The correction is zero at the surface, and is
 * interpolated linearly between the entries. The last entry is also used for all greater depths. The server checks the
 * slope of the table.
 */
export interface DepthTable {
  /** m, 0.0001 to 0.1. */
  readonly step: number;
  /** N, with 1 to 16 entries. Entry i is for the depth (i + 1) · step. */
  readonly force: readonly number[];
}

export interface MaterialOptions {
  /** N/m. */
  readonly stiffness: number;
  /** The coefficient of friction. Default: 0. */
  readonly friction?: number;
  /** Adds a second spring, whose force decays with this time constant in s. */
  readonly relaxS?: number;
  /** The stiffness of the second spring in N/m. Default: `stiffness`. */
  readonly branch?: number;
  /** The table that is added to the force of the springs. See depthTableOf. */
  readonly table?: DepthTable;
  /** The material is used for bricks and primitives with their centre in the region. Absent: for the whole object. */
  readonly region?: Primitive;
}

/** `origin` is the position of the first node of the first brick. */
interface Lattice {
  readonly origin: Point;
  readonly spacing: number;
  readonly bricks: Point;
}

interface Brick extends FieldBrick {
  readonly place: Point;
}

interface Material extends FieldMaterial {
  readonly name: string;
  readonly region: Primitive | undefined;
  readonly table: DepthTable | undefined;
}

/**
 * The shape and the materials of one object: the union of primitives and of bricks, which are blocks of 8³ weights of a
 * quadratic B-spline near the surface of any other shape (core/field/brick_field.h). Lengths are in m, in the frame of
 * the object.
 */
export class Field {
  readonly primitives: readonly Primitive[];
  readonly #lattice: Lattice | undefined;
  readonly #bricks: readonly Brick[];
  readonly #materials: Material[] = [{ name: "default", stiffness: 1000, branchStiffness: 0, relaxation: 0, friction: 0, region: undefined, table: undefined }];
  readonly #fixtures: FieldFixture[] = [];

  protected constructor(lattice: Lattice | undefined, bricks: readonly Brick[], primitives: readonly Primitive[]) {
    this.#lattice = lattice;
    this.#bricks = bricks;
    this.primitives = primitives;
    primitives.forEach(numbersOf);
    expect(primitives.length <= kMostPrimitives, "primitives", primitives.length, `at most ${kMostPrimitives}`);
    if (bricks.length === 0 && primitives.length === 0) {
      throw new RangeError("the field has no surface: expected a distance that changes its sign");
    }
    if (lattice && bricks.length > kMostBricks) {
      const wider = 1000 * lattice.spacing * Math.sqrt(bricks.length / kMostBricks) * 1.05;
      throw new RangeError(`${bricks.length} bricks at a spacing of ${1000 * lattice.spacing} mm: expected at most ${kMostBricks}; ` +
        `try a spacing of ${Number(wider.toPrecision(2))} mm`);
    }
  }

  /** Creates a field from the union of primitives. Adjacent primitives should overlap by at least 1 mm. */
  static fromPrimitives(...primitives: readonly Primitive[]): Field {
    return new Field(undefined, [], primitives);
  }

  /** Samples a signed distance (m, negative inside the solid) between two corners, and adds primitives. */
  static fromFunction(distance: (x: Vec3) => number, low: Vec3, high: Vec3, spacingMm = 1, primitives: readonly Primitive[] = []): Field {
    const lattice = latticeBetween([low.x, low.y, low.z], [high.x, high.y, high.z], spacingMm / 1000);
    const value = (node: Point): number => distance(positionOf(lattice, node));
    const near = (place: Point): boolean => nodesOf(place, 0).some((node) => Math.abs(value(node)) < kBand * lattice.spacing);
    return new Field(lattice, bricksOf(lattice, placesOf(lattice).filter(near), value), primitives);
  }

  /**
   * Creates a field from a list of points (m) and a list of triangles with the indices of their corners. The walls of the
   * object should be at least two spacings thick. Throws a RangeError if the mesh is not closed.
   */
  static fromTriangles(points: readonly Point[], triangles: readonly Triangle[], spacingMm = 1, name = "mesh"): Field {
    const mesh = closedMesh(name, points, triangles);
    const h = spacingMm / 1000;
    expect(h > 0, "spacingMm", spacingMm, "0.25 to 8");
    const used = mesh.triangles.flat().map((corner) => mesh.vertices[corner]!);
    const ends = (pick: (a: number, b: number) => number): Point => used.reduce<Point>(
      (a, b) => [pick(a[0], b[0]), pick(a[1], b[1]), pick(a[2], b[2])], used[0]!);
    // The origin is a multiple of the size of a brick, so that a change of the mesh only changes the bricks near it.
    const grid = kSide * h;
    const origin = ends(Math.min).map((at) => grid * Math.floor((at - kMargin[0] * h) / grid)) as unknown as Point;
    const high = ends(Math.max).map((at) => at + kMargin[1] * h) as unknown as Point;
    const lattice = latticeBetween(origin, high, h);
    const counts = lattice.bricks.map((count) => kSide * count) as unknown as Point;
    const distances = new NodeDistances(mesh, origin, h, counts, kBand);
    const near = new Set<string>();
    for (const node of distances.near()) {
      if (node.every((at, axis) => at >= 0 && at < counts[axis]!)) near.add(node.map((at) => Math.floor(at / kSide)).join());
    }
    const places = placesOf(lattice).filter((place) => near.has(place.join()));
    const nodes = new Map<number, Point>();
    for (const place of places) {
      for (const node of nodesOf(place, 1)) nodes.set(distances.number(node), node);
    }
    const value = distances.fill([...nodes.values()]);
    return new Field(lattice, bricksOf(lattice, places, (node) => h * value(node)), []);
  }

  /**
   * Sets a material. If there is no region, the material is used for the whole object. Otherwise, it is used for each
   * brick and each primitive with its centre in the region. If several regions contain the centre, the last material is
   * used. If there is already a material with this name, it is replaced.
   */
  material(name: string, { stiffness, friction = 0, relaxS, branch, region, table }: MaterialOptions): void {
    expect(stiffness > 0 && stiffness <= 1e12, "stiffness", stiffness, "above 0 N/m, and at most 1e12");
    expect(friction >= 0 && friction <= 2, "friction", friction, "0 to 2");
    const second = branch ?? stiffness;
    expect(relaxS !== undefined || branch === undefined, "branch", branch, "a branch with relaxS");
    expect(relaxS === undefined || (relaxS >= 0.01 && relaxS <= 10), "relaxS", relaxS, "0.01 to 10 s");
    expect(second > 0 && second <= 1e12, "branch", second, "above 0 N/m, and at most 1e12");
    if (table) expectTable(table);
    const branchStiffness = relaxS === undefined ? 0 : second;
    const made: Material = { name, stiffness, branchStiffness, relaxation: relaxS ?? 0, friction, region, table };
    const known = region ? this.#materials.findIndex((old, number) => number > 0 && old.name === name) : 0;
    const at = known < 0 ? this.#materials.length : known;
    expect(at < kMostMaterials, "materials", at + 1, `at most ${kMostMaterials}`);
    const tables = this.#materials.filter((old, number) => number !== at && old.table).length + (table ? 1 : 0);
    expect(tables <= kMostTables, "tables", tables, `at most ${kMostTables}`);
    this.#materials[at] = made;
  }

  /**
   * Adds a spring from the hand to the nearest position on a "point", a "line" along `normal` through `at`, or a "plane"
   * with this normal (core/field/fixture.h). `stiffness` is in N/m, and the force is at most `mostForce` N.
   */
  fixture(kind: "point" | "line" | "plane", at: Vec3, stiffness: number, normal: Vec3 = { x: 0, y: 0, z: 1 }, mostForce?: number): void {
    expect(this.#fixtures.length < kMostFixtures, "fixtures", this.#fixtures.length + 1, `at most ${kMostFixtures}`);
    expect(stiffness > 0 && stiffness <= 1e12, "stiffness", stiffness, "above 0 N/m, and at most 1e12");
    expect(mostForce === undefined || (mostForce > 0 && mostForce <= 1e12), "mostForce", mostForce, "above 0 N, and at most 1e12");
    const length = Math.hypot(normal.x, normal.y, normal.z);
    expect(Math.abs(length - 1) <= kUnitTolerance, "normal", length, "a vector of length 1");
    const number = { point: FieldFixtureKind.POINT, line: FieldFixtureKind.LINE, plane: FieldFixtureKind.PLANE }[kind];
    this.#fixtures.push({ kind: number, at, normal, stiffness, ...(mostForce === undefined ? {} : { mostForce }) });
  }

  /** Returns what is sent to a server: a copy, which later changes do not affect. */
  describe(): FieldDescription {
    const manifest = this.#manifest();
    return {
      name: blake2b(manifest, { dkLen: 32 }),
      manifest,
      bricks: this.#bricks.map(({ hash, weights }) => ({ hash, weights })),
      materials: this.#materials.map(({ stiffness, branchStiffness, relaxation, friction }) =>
        ({ stiffness, branchStiffness, relaxation, friction })),
      fixtures: [...this.#fixtures],
      tables: this.#materials.flatMap(({ table }, material) => (table ? [{ material, step: table.step, force: [...table.force] }] : [])),
    };
  }

  #materialAt(centre: Vec3): number {
    const at = this.#materials.findLastIndex(({ region }) => region && distanceTo(region, centre) <= 0);
    return Math.max(at, 0);
  }

  /** protocol/field/manifest.h */
  #manifest(): Uint8Array {
    const size = 50 + 23 * this.#bricks.length + 91 * this.primitives.length;
    const bytes = new Uint8Array(size);
    const view = new DataView(bytes.buffer);
    let at = 0;
    const f64 = (value: number): void => void (view.setFloat64(at, value, true), (at += 8));
    const u16 = (value: number): void => void (view.setUint16(at, value, true), (at += 2));
    const u8 = (value: number): void => void (bytes[at++] = value);
    // Without bricks, these numbers are ignored.
    const { origin, spacing, bricks } = this.#lattice ?? { origin: [0, 0, 0], spacing: 1e-3, bricks: [1, 1, 1] };
    origin.forEach(f64);
    f64(spacing);
    f64(this.#lattice ? scaleOf(this.#lattice) : 1e-7);
    bricks.forEach(u16);
    u16(this.#bricks.length);
    u16(this.primitives.length);
    for (const { place, hash } of this.#bricks) {
      place.forEach(u16);
      u8(this.#materialAt(positionOf(this.#lattice!, place.map((n) => kSide * n + kSide / 2 - 0.5) as unknown as Point)));
      bytes.set(hash, at);
      at += hash.length;
    }
    for (const shape of this.primitives) {
      u8(1 + kPrimitiveKinds.indexOf(shape.kind));
      u8(shape.hollow === true ? 1 : 0);
      u8(this.#materialAt(centreOf(shape)));
      const numbers = numbersOf(shape);
      for (let i = 0; i < 11; ++i) f64(numbers[i] ?? 0);
    }
    return bytes;
  }
}

function expectTable({ step, force }: DepthTable): void {
  expect(step >= kLeastStep && step <= kMostStep, "step", step, `${kLeastStep} to ${kMostStep} m`);
  expect(force.length >= 1 && force.length <= kMostEntries, "force", force.length, `1 to ${kMostEntries} entries`);
  expect(force.every((one) => Math.abs(one) <= 1e12), "force", force, "±1e12 N");
}

/**
 * Returns the stiffness and the table of a material that match a measured curve. The forces (N) and the depths (m) must
 * be increasing, and the curve starts at zero. If there are at most 16 points and they are equally spaced, the table
 * contains these points. Otherwise, the curve is resampled at 16 depths. For greater depths, only the stiffness is used.
 */
export function depthTableOf(depths: readonly number[], forces: readonly number[]): { readonly stiffness: number; readonly table: DepthTable } {
  expect(forces.length === depths.length && forces.length > 0, "forces", forces.length, `as many as depths, ${depths.length}, and at least 1`);
  const slopes = depths.map((depth, n) => {
    const [from, least] = [depths[n - 1] ?? 0, forces[n - 1] ?? 0];
    expect(depth > from && depth < Infinity, `depths[${n}]`, depth, `above ${from} m`);
    expect(forces[n]! > least && forces[n]! < Infinity, `forces[${n}]`, forces[n], `above ${least} N`);
    return (forces[n]! - least) / (depth - from);
  });
  const end = depths.at(-1)!;
  const even = depths.every((depth, n) => Math.abs(depth - (end * (n + 1)) / depths.length) <= 1e-9 * end);
  const count = even && depths.length <= kMostEntries ? depths.length : kMostEntries;
  const step = Math.max(end / count, kLeastStep);
  const stiffness = Math.min(slopes.at(-1)!, kMostRatio * Math.min(...slopes));
  const force = Array.from({ length: count }, (_, n) => {
    const depth = step * (n + 1);
    const at = Math.min(depths.filter((start) => start <= depth).length, slopes.length - 1);
    return (forces[at - 1] ?? 0) + slopes[at]! * (depth - (depths[at - 1] ?? 0)) - stiffness * depth;
  });
  const table = { step, force };
  expectTable(table);
  return { stiffness, table };
}

/** m per unit of a weight. */
const scaleOf = ({ spacing }: Lattice): number => (kScaledBand * spacing) / kBiggest;

function positionOf({ origin: [x, y, z], spacing: h }: Lattice, [i, j, k]: Point): Vec3 {
  return { x: x + h * i, y: y + h * j, z: z + h * k };
}

function latticeBetween(low: Point, high: Point, spacing: number): Lattice {
  expect(spacing >= 0.25e-3 && spacing <= 8e-3, "spacing", spacing, "0.00025 to 0.008 m");
  const bricks = high.map((end, axis) => Math.ceil((end - low[axis]!) / (kSide * spacing))) as unknown as Point;
  const extents = bricks.map((count) => count * kSide * spacing);
  expect(extents.every((extent) => extent > 0 && extent <= kMostExtent), "extent", extents, "at most 2 m along each axis");
  const cells = bricks[0] * bricks[1] * bricks[2];
  expect(cells <= kMostCells, "lattice", cells, `at most ${kMostCells} bricks of 8³ nodes`);
  return { origin: low, spacing, bricks };
}

function placesOf({ bricks }: Lattice): Point[] {
  const places: Point[] = [];
  for (let k = 0; k < bricks[2]; ++k) for (let j = 0; j < bricks[1]; ++j) for (let i = 0; i < bricks[0]; ++i) places.push([i, j, k]);
  return places;
}

function nodesOf(place: Point, apron: number): Point[] {
  const [x, y, z] = place.map((n) => kSide * n) as unknown as Point;
  const nodes: Point[] = [];
  const [first, last] = [-apron, kSide + apron - 1];
  for (let k = first; k <= last; ++k) for (let j = first; j <= last; ++j) for (let i = first; i <= last; ++i) nodes.push([x + i, y + j, z + k]);
  return nodes;
}

function bricksOf(lattice: Lattice, places: readonly Point[], value: (node: Point) => number): Brick[] {
  return places.map((place) => {
    const weights = weightsOf(nodesOf(place, 1).map(value), scaleOf(lattice));
    return { place, weights, hash: blake2b(weights, { dkLen: 16 }) };
  });
}

/** Filters the values of the 10³ nodes of a brick with its apron along x, y and z, in this order. */
function weightsOf(nodes: readonly number[], scale: number): Uint8Array {
  const wide = kSide + 2;
  let values = nodes;
  for (const step of [1, wide, wide * wide]) {
    values = values.map((value, n) => -0.125 * (values[n - step] ?? 0) + 1.25 * value + -0.125 * (values[n + step] ?? 0));
  }
  const bytes = new Uint8Array(2 * kSide ** 3);
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (let k = 1; k <= kSide; ++k) {
    for (let j = 1; j <= kSide; ++j) {
      for (let i = 1; i <= kSide; ++i, at += 2) {
        const value = Math.min(Math.max(values[(k * wide + j) * wide + i]! / scale, -kBiggest), kBiggest);
        const whole = Math.trunc(value);
        const rest = value - whole; // halves are rounded away from zero
        view.setInt16(at, whole + (rest >= 0.5 ? 1 : rest <= -0.5 ? -1 : 0), true);
      }
    }
  }
  return bytes;
}
