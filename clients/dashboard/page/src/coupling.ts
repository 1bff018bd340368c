// SPDX-License-Identifier: Apache-2.0
import { levelOf, mayPress, press } from "./arming.js";
import { Chart, type ChartEvents, type ChartSpec } from "./chart.js";
import { h, mark, say } from "./dom.js";
import type { Order, PortEnd, PortRow, ServerMessage } from "./stream.js";
import type { Plotted } from "./track.js";
import { digits, duration, kPhases, type Level, type StateWords } from "./words.js";

const kColumns = ["x", "y", "z", "px", "py", "pz", "felt", "contact", "given", "own", "peer", "pair"] as const;
type Column = (typeof kColumns)[number];

/** Number of rows to keep: two minutes at 50 per second. */
const kKept = 6000;
/** s, maximum age of shown values. */
const kStale = 1;
/** The time in ms for which a success is shown. */
const kToldMs = 8000;

const kCharts: readonly ChartSpec<Column>[] = [
  {
    id: "ends", title: "Both ends", unit: "mm from where they were coupled; the other end in its own axes", scale: 1e3, least: 2,
    lines: [
      { column: "x", name: "x", colour: "x", width: 2 },
      { column: "y", name: "y", colour: "y", width: 2 },
      { column: "z", name: "z", colour: "z", width: 2 },
      { column: "px", name: "other x", colour: "x", dash: [6, 4] },
      { column: "py", name: "other y", colour: "y", dash: [6, 4] },
      { column: "pz", name: "other z", colour: "z", dash: [6, 4] },
    ],
  },
  {
    id: "touch", title: "Felt, and touched", unit: "N", scale: 1, positive: true, least: 0.5,
    lines: [
      { column: "felt", name: "felt at the leader", colour: "applied", width: 2 },
      { column: "contact", name: "contact of the follower", colour: "wanted", dash: [6, 4] },
      { column: "given", name: "motors of the follower", colour: "z", dash: [2, 3], toggle: "motors of the follower" },
    ],
  },
  {
    id: "accounts", title: "Accounts", unit: "mJ that may be spent now", scale: 1e3, positive: true, least: 1,
    lines: [
      { column: "own", name: "this end", colour: "energy", width: 2 },
      { column: "peer", name: "other end", colour: "wanted", dash: [6, 4] },
      { column: "pair", name: "the pair", colour: "applied", dash: [2, 3], width: 2 },
    ],
  },
];

class PortTrack implements Plotted<Column> {
  t: number[] = [];
  rows: PortRow[] = [];
  readonly begin = 0;
  #columns = empty();

  get end(): number {
    return this.t.length;
  }
  get length(): number {
    return this.t.length;
  }
  column(name: Column): number[] {
    return this.#columns[name];
  }
  at(time: number): number {
    let [low, high] = [0, this.t.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.t[middle]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }
  push(t: number, row: PortRow, leads: boolean | undefined): void {
    const { own, peer } = row;
    const [leader, follower] = leads === undefined ? [undefined, undefined] : leads ? [own, peer] : [peer, own];
    const values: Record<Column, number> = {
      x: own.position_m[0], y: own.position_m[1], z: own.position_m[2],
      px: peer?.position_m[0] ?? NaN, py: peer?.position_m[1] ?? NaN, pz: peer?.position_m[2] ?? NaN,
      felt: norm(leader?.force_n), contact: norm(follower?.contact_n), given: norm(follower?.force_n),
      own: own.account_j ?? NaN, peer: peer?.account_j ?? NaN, pair: row.pair_j ?? NaN,
    };
    this.t.push(t);
    this.rows.push(row);
    for (const name of kColumns) this.#columns[name].push(values[name]);
    if (this.length < 2 * kKept) return;
    for (const list of [this.t, this.rows, ...Object.values(this.#columns)]) list.splice(0, kKept);
  }
  clear(): void {
    this.t = [];
    this.rows = [];
    this.#columns = empty();
  }
}

const empty = (): Record<Column, number[]> => Object.fromEntries(kColumns.map((name) => [name, []])) as unknown as Record<Column, number[]>;
const norm = (v: readonly number[] | null | undefined): number => (v ? Math.hypot(...v) : NaN);

const kUnknown: StateWords = { name: "–", meaning: "the server tells nothing of it now", level: "off" };
const kUnheard: StateWords = { name: "–", meaning: "nothing is heard of it", level: "off" };

const tile = (id: string): { element: HTMLElement; name: HTMLElement; value: HTMLElement; note: HTMLElement } => {
  const [name, value, note] = [h("div", { class: "name" }), h("div", { class: "value" }), h("div", { class: "note" })];
  return { element: h("div", { class: "tile", "data-tile": id }, name, value, note), name, value, note };
};
type Tile = ReturnType<typeof tile>;

/** Both ends of the watched device's coupling: positions, forces, accounts, and the two buttons. Hidden without one. */
export class Coupling {
  readonly element: HTMLElement;
  readonly #track = new PortTrack();
  readonly #charts: Chart<Column>[];
  readonly #plots: HTMLElement;
  readonly #tiles = {
    own: tile("port-own"), peer: tile("port-peer"), trip: tile("port-trip"), ownAccount: tile("port-account"), peerAccount: tile("port-peer-account"),
    pair: tile("port-pair"), stiffness: tile("port-stiffness"), share: tile("port-share"),
  };
  readonly #buttons: Readonly<Record<"engage" | "disengage", HTMLButtonElement>>;
  readonly #group: HTMLElement;
  readonly #scales = h("span", { class: "quiet" });
  readonly #result = h("p", { class: "result", role: "status", hidden: true });
  #device = 0;
  #leads: boolean | undefined;
  #refused: string | undefined;
  #told: string | undefined;
  #toldAt = -Infinity;

  constructor(events: ChartEvents) {
    this.#charts = kCharts.map((spec) => new Chart(spec, events));
    const button = (order: "engage" | "disengage", text: string): HTMLButtonElement =>
      h("button", { type: "button", id: order, disabled: true, click: () => void this.#press(order) }, text);
    this.#buttons = { disengage: button("disengage", "Disengage"), engage: button("engage", "Engage") };
    this.#group = h("span", { class: "orders" }, this.#buttons.disengage, this.#buttons.engage);
    this.#plots = h("div", { class: "plots" }, ...this.#charts.map((chart) => chart.element));
    this.element = h("section", { class: "coupling", "aria-label": "Coupling", hidden: true },
      h("div", { class: "head" }, h("h3", { text: "Coupling" }), this.#scales, h("span", { class: "space" }), this.#group), this.#result,
      h("div", { class: "tiles" }, ...Object.values(this.#tiles).map((t) => t.element)), this.#plots);
  }

  push(t: number, row: PortRow): void {
    if (row.role) this.#leads = row.role === "leader";
    this.#track.push(t, row, this.#leads);
  }

  clear(): void {
    this.#track.clear();
    this.#leads = undefined;
  }

  repaint(): void {
    for (const chart of this.#charts) chart.repaint();
  }

  /** Shows [from, to]. The tiles show the values at `cursor`. `plots` is false next to the 3-D view. */
  draw(server: ServerMessage | undefined, device: number, from: number, to: number, cursor: number, plots: boolean): void {
    this.#device = device;
    this.element.hidden = this.#track.length === 0;
    if (this.element.hidden) return;
    this.#plots.hidden = !plots;
    if (plots) for (const chart of this.#charts) chart.draw(this.#track, from, to, cursor);
    const at = this.#track.at(cursor);
    const i = Math.min(at, this.#track.end - 1);
    const connected = server?.contact === "open";
    const row = connected && cursor - this.#track.t[i]! < kStale ? this.#track.rows[i] : undefined;
    this.#drawTiles(row);
    this.#drawOrders(server, this.#track.rows.at(-1));
  }

  #drawTiles(row: PortRow | undefined): void {
    const show = (t: Tile, name: string, level: Level, value: string, note: string): void => {
      mark(t.element, "data-level", level);
      say(t.name, name);
      say(t.value, value);
      say(t.note, note);
    };
    const { own, peer, trip, ownAccount, peerAccount, pair, stiffness, share } = this.#tiles;
    const role = (leads: boolean | undefined): string => (leads === undefined ? "" : leads ? " (leader)" : " (follower)");
    const here = `This end${role(this.#leads)}`;
    const there = `Other end${role(this.#leads === undefined ? undefined : !this.#leads)}`;
    const phase = (t: Tile, name: string, end: PortEnd | null | undefined, without: StateWords): void => {
      const words = end ? (kPhases[end.phase] ?? { name: end.phase, meaning: "", level: "off" as const }) : without;
      show(t, name, words.level, words.name, words.meaning);
    };
    phase(own, here, row?.own, kUnknown);
    phase(peer, there, row?.peer, row ? kUnheard : kUnknown);
    const ms = (end: PortEnd | null | undefined): string => duration((end?.round_trip_ms ?? NaN) / 1e3);
    show(trip, "Round trip", "off", ms(row?.own), row?.peer ? `as this end measures it; the other: ${ms(row.peer)}` : "as this end measures it");
    const scaled = row?.position_scale != null && row.position_scale !== row.force_scale;
    const account = (t: Tile, name: string, end: PortEnd | null | undefined): void => {
      const value = end?.account_j ?? NaN;
      const note = !end ? "not told" : end.account_j === null ? "it has no energy tank: its limiter counts for itself" : scaled ? "joules of its own scale" : "may be spent now";
      show(t, name, value < 0 ? "bad" : "off", Number.isFinite(value) ? `${digits(1e3 * value)} mJ` : "–", note);
    };
    account(ownAccount, "Account of this end", row?.own);
    account(peerAccount, "Account of the other end", row?.peer);
    const sum = row?.pair_j ?? NaN;
    show(pair, "Account of the pair", sum < 0 ? "bad" : "off", Number.isFinite(sum) ? `${digits(1e3 * sum)} mJ` : "–", pairNote(row, scaled));
    const surface = row?.own.stiffness_n_per_m ?? row?.peer?.stiffness_n_per_m ?? null;
    stiffness.element.hidden = surface === null;
    show(stiffness, "Surface found", "off", `${digits(surface ?? NaN)} N/m`, "its stiffness, as the follower found it");
    const counts = row?.own.share ?? row?.peer?.share ?? null;
    share.element.hidden = counts === null;
    show(share, "Share of this leader", "off", `${digits(100 * (counts ?? NaN))} %`, "the other leaders have the rest");
    const known = row?.position_scale != null && row.force_scale !== null;
    say(this.#scales, known && (row.position_scale !== 1 || row.force_scale !== 1)
      ? `the follower moves ${digits(row.position_scale!)} times as far; forces are felt ${digits(row.force_scale!)} times as large` : "");
  }

  #drawOrders(server: ServerMessage | undefined, row: PortRow | undefined): void {
    const told = server ? JSON.stringify(server.press) : this.#told;
    if (told !== this.#told) {
      this.#refused = undefined;
      this.#toldAt = this.#told === undefined ? -Infinity : performance.now();
      this.#told = told;
    }
    const last = server?.press ?? undefined;
    const ours = last?.device === this.#device && (last.order === "engage" || last.order === "disengage");
    const shown = ours && !(last.state === "done" && performance.now() - this.#toldAt > kToldMs) ? last : undefined;
    const objection = server?.devices.find((d) => d.number === this.#device)?.arming_objection ?? "unknown";
    const busy = last?.state === "under_way";
    const phase = row?.own.phase;
    this.#group.hidden = !mayPress(server);
    this.#buttons.engage.hidden = this.#leads !== true;
    this.#buttons.engage.disabled = objection !== "" || busy || phase !== "coupled";
    const live = phase === "engaged" || phase === "clutched" || phase === "aligning";
    this.#buttons.disengage.disabled = objection !== "" || !live || (busy && last?.order !== "arm" && last?.order !== "engage");
    const words = this.#refused ?? shown?.words ?? "";
    say(this.#result, words);
    this.#result.hidden = words === "";
    mark(this.#result, "data-level", this.#refused !== undefined ? "bad" : levelOf(shown));
  }

  async #press(order: Order): Promise<void> {
    this.#refused = undefined;
    this.#refused = await press(order, this.#device);
  }
}

function pairNote(row: PortRow | undefined, scaled: boolean): string {
  if (!row?.peer) return "the other end is not heard";
  if (row.pair_j !== null) return scaled ? "joules of the leader, with what is under way" : "both, and what is under way between them";
  if (row.own.account_j === null || row.peer.account_j === null) return "an end has no energy tank: they do not pay each other";
  if (row.position_scale === null) return "the scales are not known: look at each by itself";
  return "the two do not know each other yet";
}
