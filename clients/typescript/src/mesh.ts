// SPDX-License-Identifier: Apache-2.0
// Closed triangle meshes, and their signed distance at the nodes of a lattice. The arithmetic is that of
// clients/python/tendon/mesh.py, so that both clients compute the same bytes.

export type Point = readonly [number, number, number];
export type Triangle = readonly [number, number, number];

export interface Mesh {
  readonly vertices: readonly Point[];
  readonly triangles: readonly Triangle[];
}

/**
 * Creates a mesh. Equal points are merged, and duplicate or degenerate triangles are removed. The normal of a triangle
 * (a, b, c) is (b − a) × (c − a). All normals must point out of the solid, or all of them into it. Throws a RangeError if
 * the mesh is not closed.
 */
export function closedMesh(name: string, points: readonly Point[], triangles: readonly Triangle[]): Mesh {
  const numbers = new Map<string, number>();
  const vertices: Point[] = [];
  const merged = points.map(([x, y, z]) => {
    if (![x, y, z].every(Number.isFinite)) throw new RangeError(`${name}: expected coordinates that are finite`);
    const key = `${x + 0},${y + 0},${z + 0}`; // + 0 makes −0 equal to 0
    const number = numbers.get(key) ?? vertices.push([x, y, z]) - 1;
    numbers.set(key, number);
    return number;
  });
  const kept = new Map<string, Triangle>();
  triangles.forEach((corners, i) => {
    const [a, b, c] = corners.map((corner) => merged[corner]);
    if (a === undefined || b === undefined || c === undefined) {
      throw new RangeError(`${name}: triangle ${i + 1} = ${corners.join(", ")}: expected vertices 0 … ${merged.length - 1}`);
    }
    if (a === b || b === c || c === a) return;
    const least = Math.min(a, b, c);
    const turned: Triangle = a === least ? [a, b, c] : b === least ? [b, c, a] : [c, a, b];
    if (!kept.has(turned.join())) kept.set(turned.join(), turned);
  });
  const mesh = { vertices, triangles: [...kept.values()] };
  expectClosed(name, mesh);
  return mesh;
}

function expectClosed(name: string, { vertices, triangles }: Mesh): void {
  if (triangles.length === 0) throw new RangeError(`${name}: expected at least one triangle`);
  const edges = new Map<string, number>();
  for (const [a, b, c] of triangles) {
    for (const edge of [`${a},${b}`, `${b},${c}`, `${c},${a}`]) edges.set(edge, (edges.get(edge) ?? 0) + 1);
  }
  const back = (edge: string): number => edges.get(edge.split(",").reverse().join()) ?? 0;
  const lone = [...edges].filter(([edge, count]) => count !== back(edge));
  if (lone.length === 0) return;
  const open = lone.filter(([edge, count]) => (count + back(edge)) % 2 === 1);
  const place = ([edge]: [string, number]): string =>
    "from " + edge.split(",").map((at) => `(${vertices[Number(at)]!.map((value) => Number((1000 * value).toPrecision(6))).join(", ")})`).join(" to ") + " mm";
  const places = (open.length > 0 ? open : lone).slice(0, 3).map(place).join(", ");
  throw new RangeError(open.length > 0
    ? `${name}: ${open.length} open edges, for example ${places}; expected a closed surface`
    : `${name}: ${lone.length} edges whose triangles have opposite normals, for example ${places}; ` +
      "expected normals that all point out of the solid");
}

const way = (a: Point, b: Point): Point => [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
const lengthOf = ([x, y, z]: Point): number => Math.sqrt(x * x + y * y + z * z);
const over = ([x, y, z]: Point, length: number): Point => [x / length, y / length, z / length];
const along = (a: Point, x: number, y: number, z: number): number => a[0] * x + a[1] * y + a[2] * z;

/** Returns a unit vector that is perpendicular to `u`. */
function across(u: Point): Point {
  const least = Math.min(...u.map(Math.abs));
  const axis = u.findIndex((value) => Math.abs(value) === least);
  const v = u.map((value, i) => (i === axis ? 1 : 0) - u[axis]! * value) as unknown as Point;
  return over(v, lengthOf(v));
}

/** Returns the square of the distance from (u, v) to the segment from (0, 0) to (x, y). */
function toSegment(u: number, v: number, x: number, y: number): number {
  const part = (u * x + v * y) / (x * x + y * y);
  const share = part <= 0 ? 0 : part >= 1 ? 1 : part;
  return (u - share * x) * (u - share * x) + (v - share * y) * (v - share * y);
}

/**
 * A triangle with the axes u and v in its plane. In these axes, the corners are (0, 0), (l, 0) and (cx, cy). The edge
 * from (0, 0) to (l, 0) is the longest one, so 0 ≤ cx ≤ l.
 */
class Facet {
  readonly at: Point;
  readonly u: Point;
  readonly v: Point;
  readonly w: Point;
  readonly #l: number;
  readonly #cx: number;
  readonly #cy: number;

  constructor(corners: readonly [Point, Point, Point]) {
    const [p, q, r] = corners;
    const turned: [Point, Point, Point][] = [[p, q, r], [q, r, p], [r, p, q]];
    const lengths = turned.map(([from, to]) => lengthOf(way(from, to)));
    const [a, b, c] = turned[lengths.indexOf(Math.max(...lengths))]!;
    const ac = way(a, c);
    this.at = a;
    this.#l = lengthOf(way(a, b));
    const u = this.u = over(way(a, b), this.#l);
    this.#cx = along(u, ...ac);
    const high: Point = [ac[0] - this.#cx * u[0], ac[1] - this.#cx * u[1], ac[2] - this.#cx * u[2]];
    this.#cy = lengthOf(high);
    // If the corners are collinear, any plane that contains the edge can be used.
    const v = this.v = this.#cy > 1e-9 * this.#l ? over(high, this.#cy) : across(u);
    this.w = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  }

  /** Returns the square of the distance. */
  squared(i: number, j: number, k: number): number {
    const [x, y, z] = [i - this.at[0], j - this.at[1], k - this.at[2]];
    const w = along(this.w, x, y, z);
    return w * w + this.beside(along(this.u, x, y, z), along(this.v, x, y, z));
  }

  /** Returns the square of the distance in the plane. */
  beside(u: number, v: number): number {
    const [l, cx, cy] = [this.#l, this.#cx, this.#cy];
    if (v <= 0) { // the angles at the ends of the longest edge are acute
      const out = u - (u <= 0 ? 0 : u >= l ? l : u);
      return out * out + v * v;
    }
    let nearest = -1;
    if (cx * v > cy * u) nearest = toSegment(u, v, cx, cy);
    if ((l - cx) * v > cy * (l - u)) {
      const other = toSegment(l - u, v, l - cx, cy);
      nearest = nearest < 0 ? other : Math.min(nearest, other);
    }
    return Math.max(nearest, 0);
  }
}

/** The offset of the lines from the nodes, in spacings. Otherwise, a line could contain an edge of an aligned mesh. */
const kOffLineY = 1.37e-7;
const kOffLineZ = 2.71e-7;

/**
 * Computes the signed distance of a mesh at the nodes of a lattice. All lengths are in spacings, and the position of node
 * (i, j, k) is (i, j, k). The distance is exact if it is less than `band`. Otherwise, only the nearest triangles of the
 * neighbours are tested. The distance is negative if the winding number is not zero. The winding number is the sum of the
 * crossings along a line in the direction of x. This also works for several solids that overlap, and for cavities. The
 * faces inside of an overlap are not removed.
 */
export class NodeDistances {
  readonly #vertices: readonly Point[];
  readonly #triangles: readonly Triangle[];
  readonly #facets: readonly Facet[];
  readonly #counts: Point;
  /** Between numbers of nodes along the axes. There are nodes −2 … count + 1. */
  readonly #steps: Point;
  readonly #beside: readonly number[];
  /** By the number of a node. */
  readonly #squared = new Map<number, number>();
  readonly #nearest = new Map<number, number>();

  constructor({ vertices, triangles }: Mesh, origin: Point, spacing: number, counts: Point, band: number) {
    this.#vertices = vertices.map((at) => at.map((value, i) => (value - origin[i]!) / spacing) as unknown as Point);
    this.#triangles = triangles;
    this.#counts = counts;
    this.#facets = triangles.map(([a, b, c]) => new Facet([this.#vertices[a]!, this.#vertices[b]!, this.#vertices[c]!]));
    const [wide, high] = [counts[0] + 4, counts[1] + 4];
    this.#steps = [1, wide, wide * high];
    const around = [-1, 0, 1];
    this.#beside = around.flatMap((i) => around.flatMap((j) => around.map((k) => i + wide * (j + high * k)))).filter((step) => step !== 0);
    this.#facets.forEach((facet, number) => this.#spread(number, facet, band));
  }

  /** The nodes within the band. */
  *near(): Iterable<Point> {
    for (const at of this.#squared.keys()) yield this.#node(at);
  }

  /** Returns the signed distances of the nodes. They must be connected to the band. */
  fill(nodes: readonly Point[]): (node: Point) => number {
    const [squared, nearest, facets] = [this.#squared, this.#nearest, this.#facets];
    const beyond = new Map<number, Point>();
    const rows = new Map<number, [number, number][]>();
    for (const node of nodes) {
      if (!squared.has(this.number(node))) beyond.set(this.number(node), node);
      rows.set(this.number([0, node[1], node[2]]), []);
    }
    let todo = [...beyond.keys()];
    while (todo.length > 0) {
      const later: number[] = [];
      const found: [number, number, number][] = [];
      for (const at of todo) {
        let [least, which] = [Infinity, -1];
        for (const number of new Set(this.#beside.map((step) => nearest.get(at + step) ?? -1))) {
          if (number < 0) continue;
          const distance = facets[number]!.squared(...beyond.get(at)!);
          if (distance < least || (distance === least && number < which)) [least, which] = [distance, number];
        }
        if (which < 0) later.push(at);
        else found.push([at, least, which]);
      }
      if (found.length === 0) throw new RangeError("expected nodes that are connected to the surface");
      for (const [at, distance, number] of found) {
        squared.set(at, distance);
        nearest.set(at, number);
      }
      todo = later;
    }
    this.#refine(beyond);
    this.#cross(rows);
    return (node) => {
      const winding = rows.get(this.number([0, node[1], node[2]]))!.reduce((sum, [x, sign]) => sum + (x < node[0] ? sign : 0), 0);
      const distance = Math.sqrt(squared.get(this.number(node))!);
      return winding !== 0 ? -distance : distance;
    };
  }

  number([i, j, k]: Point): number {
    const [, wide, plane] = this.#steps;
    return i + 2 + wide * (j + 2) + plane * (k + 2);
  }

  #node(at: number): Point {
    const [, wide, plane] = this.#steps;
    return [(at % wide) - 2, Math.floor((at % plane) / wide) - 2, Math.floor(at / plane) - 2];
  }

  /** Updates the nearest triangle of each node from its neighbours until there is no change. */
  #refine(beyond: ReadonlyMap<number, Point>): void {
    const [squared, nearest] = [this.#squared, this.#nearest];
    const faces = this.#steps.flatMap((step) => [-step, step]);
    let nodes = [...beyond.keys()];
    while (nodes.length > 0) {
      const changed = new Set<number>();
      for (const at of nodes) {
        for (const number of new Set(faces.map((step) => nearest.get(at + step) ?? -1))) {
          if (number < 0) continue;
          const distance = this.#facets[number]!.squared(...beyond.get(at)!);
          if (!(distance < squared.get(at)!)) continue;
          squared.set(at, distance);
          nearest.set(at, number);
          for (const step of faces) changed.add(at + step);
        }
      }
      nodes = [...changed].filter((at) => beyond.has(at));
    }
  }

  /** Updates the nodes within the band of one triangle. */
  #spread(number: number, facet: Facet, band: number): void {
    const [squared, most] = [this.#squared, band * band];
    const corners = this.#triangles[number]!.map((corner) => this.#vertices[corner]!);
    const ranges = [0, 1, 2].map((axis) => {
      const values = corners.map((corner) => corner[axis]!);
      return [
        Math.max(Math.ceil(Math.min(...values) - band), -1), Math.min(Math.floor(Math.max(...values) + band), this.#counts[axis]!),
      ] as const;
    });
    const { at, u, v, w } = facet;
    for (let k = ranges[2]![0]; k <= ranges[2]![1]; ++k) {
      for (let j = ranges[1]![0]; j <= ranges[1]![1]; ++j) {
        const [y, z] = [j - at[1], k - at[2]];
        const [atU, atV, atW] = [u[1] * y + u[2] * z, v[1] * y + v[2] * z, w[1] * y + w[2] * z];
        let [start, end] = ranges[0]!;
        if (Math.abs(w[0]) > 1e-9) { // the row crosses the slab around the plane
          const ends = [(-band - atW) / w[0] + at[0], (band - atW) / w[0] + at[0]];
          start = Math.max(start, Math.ceil(Math.min(...ends)));
          end = Math.min(end, Math.floor(Math.max(...ends)));
        } else if (Math.abs(atW) > band) {
          continue;
        }
        const row = this.number([0, j, k]);
        for (let i = start; i <= end; ++i) {
          const x = i - at[0];
          const out = w[0] * x + atW;
          const distance = out * out + facet.beside(u[0] * x + atU, v[0] * x + atV);
          if (!(distance < most && distance < (squared.get(row + i) ?? most))) continue;
          squared.set(row + i, distance);
          this.#nearest.set(row + i, number);
        }
      }
    }
  }

  /** Adds the crossings of each row (j, k), with 1 if the line enters the solid and −1 if it leaves the solid. */
  #cross(rows: ReadonlyMap<number, [number, number][]>): void {
    for (const corners of this.#triangles) {
      const [a, b, c] = corners.map((corner) => this.#vertices[corner]!) as [Point, Point, Point];
      const [ab, ac] = [way(a, b), way(a, c)];
      const out = [ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]];
      if (out[0] === 0) continue;
      const [lowX, highX] = [Math.min(a[0], b[0], c[0]), Math.max(a[0], b[0], c[0])];
      const last = [Math.floor(Math.max(a[1], b[1], c[1]) - kOffLineY), Math.floor(Math.max(a[2], b[2], c[2]) - kOffLineZ)];
      for (let j = Math.ceil(Math.min(a[1], b[1], c[1]) - kOffLineY); j <= last[0]!; ++j) {
        for (let k = Math.ceil(Math.min(a[2], b[2], c[2]) - kOffLineZ); k <= last[1]!; ++k) {
          const row = rows.get(this.number([0, j, k]));
          const [y, z] = [j + kOffLineY, k + kOffLineZ];
          const [p, q, r] = corners;
          if (!row || this.#isLeft(p, q, y, z) !== this.#isLeft(q, r, y, z) || this.#isLeft(q, r, y, z) !== this.#isLeft(r, p, y, z)) continue;
          const x = a[0] - (out[1]! * (y - a[1]) + out[2]! * (z - a[2])) / out[0]!;
          row.push([Math.min(Math.max(x, lowX), highX), out[0]! > 0 ? -1 : 1]);
        }
      }
    }
  }

  /** Returns true if the line is on the left side of an edge. The result is the same for both triangles of the edge. */
  #isLeft(p: number, q: number, y: number, z: number): boolean {
    if (p > q) return !this.#isLeft(q, p, y, z);
    const [a, b] = [this.#vertices[p]!, this.#vertices[q]!];
    return (b[1] - a[1]) * (z - a[2]) > (b[2] - a[2]) * (y - a[1]);
  }
}
