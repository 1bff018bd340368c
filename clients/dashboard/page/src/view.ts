// SPDX-License-Identifier: Apache-2.0
import { Chart, type ChartEvents, type ChartSpec } from "./chart.js";
import { h, mark, say } from "./dom.js";
import { FieldPanel } from "./field.js";
import { Histogram } from "./histogram.js";
import { Lanes } from "./lanes.js";
import { inSpace } from "./space/choice.js";
import { SpacePanel, type Instants } from "./space/panel.js";
import type { Shown } from "./space/stage.js";
import type { EngineReport } from "./stream.js";
import type { Track } from "./track.js";
import { digits, duration, kModes, type Level } from "./words.js";

export const kCharts: readonly ChartSpec[] = [
  {
    id: "force", title: "Force", unit: "N", scale: 1, positive: true, least: 0.5, mayLeave: "permitted",
    lines: [
      { column: "permitted", name: "permitted", colour: "permitted", width: 1, fill: "permitted-fill" },
      { column: "wanted", name: "wanted", colour: "wanted", dash: [6, 4] },
      { column: "applied", name: "applied", colour: "applied", width: 2 },
      { column: "ax", name: "applied x", colour: "x", width: 2, toggle: "applied x y z" },
      { column: "ay", name: "applied y", colour: "y", dash: [6, 4], toggle: "applied x y z" },
      { column: "az", name: "applied z", colour: "z", dash: [2, 3], toggle: "applied x y z" },
      { column: "wx", name: "wanted x", colour: "x", width: 1, toggle: "wanted x y z" },
      { column: "wy", name: "wanted y", colour: "y", width: 1, dash: [6, 4], toggle: "wanted x y z" },
      { column: "wz", name: "wanted z", colour: "z", width: 1, dash: [2, 3], toggle: "wanted x y z" },
    ],
  },
  {
    id: "position", title: "Position", unit: "mm", scale: 1e3, least: 2,
    lines: [
      { column: "x", name: "x", colour: "x", width: 2 },
      { column: "y", name: "y", colour: "y", dash: [6, 4] },
      { column: "z", name: "z", colour: "z", dash: [2, 3] },
    ],
  },
  {
    id: "energy", title: "Energy put in and not given back", unit: "mJ", scale: 1e3, positive: true, ownScale: true, least: 1,
    lines: [{ column: "energy", name: "energy", colour: "energy", width: 2, fill: "energy-fill" }],
  },
  {
    id: "depth", title: "Depth in the field", unit: "mm", scale: 1e3, positive: true, least: 0.5,
    lines: [{ column: "depth", name: "from the proxy to the hand", colour: "second", width: 2 }],
  },
];

/** Additional data of a view: reports of a live server, or values computed from a recording. */
export interface Facts {
  readonly state: { readonly level: Level; readonly name: string; readonly meaning: string };
  readonly engines: readonly EngineReport[];
  /** Shown instead of the cards if there is no engine. */
  readonly noEngines: string;
  readonly delay: { readonly name: string; readonly value: string; readonly note: string };
  readonly loss: { readonly name: string; readonly value: string; readonly note: string };
  readonly lateness: { readonly buckets: readonly number[]; readonly what: string; readonly more: string };
  readonly gives: boolean;
  /** Describes degradations of the server; empty: none. */
  readonly degraded: string;
}

const tile = (id: string, text: string): { element: HTMLElement; name: HTMLElement; value: HTMLElement; note: HTMLElement } => {
  const name = h("div", { class: "name", text });
  const value = h("div", { class: "value" });
  const note = h("div", { class: "note" });
  return { element: h("div", { class: "tile", "data-tile": id }, name, value, note), name, value, note };
};

export class View {
  readonly element: HTMLElement;
  readonly #charts: Chart[];
  readonly #space: SpacePanel;
  readonly #field = new FieldPanel();
  readonly #lanes = new Lanes();
  readonly #histogram = new Histogram();
  readonly #engines = h("div", { class: "engines" });
  readonly #tiles = {
    state: tile("state", "Device"), mode: tile("mode", "Force is"), force: tile("force", "Applied force"),
    energy: tile("energy", "Energy"), delay: tile("delay", "Delay"), loss: tile("loss", "Loss"),
  };
  readonly #alert = h("div", { class: "alert", role: "status", hidden: true });
  #cards = "";
  #hasField = false;

  constructor(events: ChartEvents) {
    this.#charts = kCharts.map((spec) => new Chart(spec, events));
    this.#space = new SpacePanel(() => events.changed(), (time) => events.hover(time));
    const engines = h("section", { class: "panel" }, h("h3", { text: "Engines" }), this.#engines);
    this.element = h("div", { class: "view" }, this.#space.element,
      h("div", { class: "tiles" }, ...Object.values(this.#tiles).map((t) => t.element)), this.#alert,
      h("div", { class: "columns" },
        h("div", { class: "charts" }, ...this.#charts.map((chart) => chart.element)),
        h("div", { class: "side" }, this.#field.element, this.#lanes.element, engines, this.#histogram.element)));
  }

  /** Shows [from, to]. Tiles and legends show the values at `cursor`. `instant` describes that time; empty: now. */
  draw(track: Track, from: number, to: number, cursor: number, instant: string, facts: Facts): void {
    this.#hasField = track.hasField;
    this.space();
    for (const chart of this.#charts) chart.draw(track, from, to, cursor);
    this.#field.draw(track, from, to, cursor);
    this.#lanes.draw(track, from, to);
    this.#histogram.draw(facts.lateness.buckets, facts.lateness.what, facts.lateness.more);
    this.#drawTiles(track, cursor, instant, facts);
    this.#drawEngines(facts);
  }

  /** Returns whether the 3-D view is visible and needs `drawSpace` for each frame. Only the force plot is then shown. The plot of the depth is hidden if there is no field.
   */
  space(): boolean {
    const shown = inSpace() && !this.#space.missing;
    for (const { element, spec: { id } } of this.#charts) element.hidden = (shown && id !== "force") || (id === "depth" && !this.#hasField);
    if (!inSpace()) this.#space.hide();
    return shown;
  }

  /** Draws the devices in 3-D. `instants` is set while time is paused. */
  drawSpace(shown: readonly Shown[], instants: Instants | undefined): void {
    this.#space.draw(shown, instants);
  }

  extents(): [number, number][] {
    return this.#charts.map((chart) => chart.extent());
  }

  share(extents: readonly (readonly [number, number])[]): void {
    this.#charts.forEach((chart, i) => chart.share(extents[i]!));
  }

  clear(): void {
    this.#lanes.clear();
  }

  repaint(): void {
    for (const chart of this.#charts) chart.repaint();
    this.#space.repaint();
  }

  destroy(): void {
    for (const chart of this.#charts) chart.destroy();
    this.#space.destroy();
  }

  #drawTiles(track: Track, cursor: number, instant: string, facts: Facts): void {
    const { state, mode, force, energy, delay, loss } = this.#tiles;
    const show = (t: typeof state, level: Level, value: string, note: string): void => {
      mark(t.element, "data-level", level);
      say(t.value, value);
      say(t.note, note);
    };
    show(state, facts.state.level, facts.state.name, facts.state.meaning);
    const at = track.at(cursor);
    const i = at < track.end ? at : track.end - 1;
    const known = i >= track.begin;
    const value = (column: "applied" | "wanted" | "permitted" | "energy" | "age"): number => (known ? track.column(column)[i]! : NaN);
    const suffix = instant === "" ? "" : ` at ${instant}`;
    say(mode.name, instant === "" ? "Force is" : `Force${suffix}`);
    say(force.name, `Applied force${suffix}`);
    say(energy.name, `Energy${suffix}`);
    const words = known ? kModes[track.mode[i]!] : undefined;
    if (words?.level === "good" && !facts.gives) show(mode, "off", words.name, "a fresh force has come, and the device gives none");
    else show(mode, words?.level ?? "off", words?.name ?? "–", words?.meaning ?? "no state has come");
    const bound = Number.isFinite(value("permitted")) ? `${digits(value("permitted"))} permitted` : "no bound";
    show(force, "off", `${digits(value("applied"))} N`, Number.isFinite(value("wanted")) ? `of ${digits(value("wanted"))} wanted, ${bound}` : bound);
    // Without a limiter the account may be negative. Then no energy may be output, and the deficit is shown
    // separately.
    const account = 1e3 * value("energy");
    if (account < 0) show(energy, "bad", "0 mJ", `may be given out: ${digits(-account)} mJ more came out than was put in`);
    else show(energy, "off", `${digits(account)} mJ`, "may still be given out");
    say(delay.name, facts.delay.name);
    say(loss.name, facts.loss.name);
    show(delay, "off", facts.delay.value, facts.delay.note);
    show(loss, "off", facts.loss.value, facts.loss.note);
    say(this.#alert, facts.degraded ? `Degraded: ${facts.degraded}` : "");
    this.#alert.hidden = facts.degraded === "";
  }

  #drawEngines(facts: Facts): void {
    const drawn = JSON.stringify(facts.engines) + facts.noEngines;
    if (drawn === this.#cards) return;
    this.#cards = drawn;
    this.#engines.replaceChildren(...(facts.engines.length > 0 ? facts.engines.map(card) : [h("p", { class: "quiet", text: facts.noEngines })]));
  }
}

function card(engine: EngineReport): HTMLElement {
  const late = engine.late_server + engine.late_network + engine.late_engine + engine.late_unknown;
  const lost = engine.lost / Math.max(engine.lost + engine.received, 1);
  const ms = (delays: { median: number; p99: number } | null): string => (delays ? duration(delays.median / 1e3) : "–");
  const p99 = (delays: { median: number; p99: number } | null): string => (delays ? `99\u00a0%: ${duration(delays.p99 / 1e3)}` : "");
  const level: Level = engine.forces_refused ? "bad" : late > 0 || engine.forces === 0 ? "notice" : "good";
  const row = (name: string, value: string, note: string): HTMLElement =>
    h("tr", {}, h("th", { scope: "row", text: name }), h("td", { text: value }), h("td", { class: "note", text: note }));
  const rate = engine.span_s > 0 ? engine.forces / engine.span_s : 0;
  const why = [
    [engine.late_server, "by the server"], [engine.late_network, "by the network"], [engine.late_engine, "by the engine"],
    [engine.late_unknown, "for an unknown cause"],
  ].filter(([n]) => (n as number) > 0).map(([n, cause]) => `${n} ${cause}`).join(", ");
  return h("div", { class: "engine", "data-level": level },
    h("div", { class: "name" }, h("b", { text: engine.name }), h("span", { class: "quiet", text: ` on channel ${engine.channel}` })),
    h("table", {},
      row("round trip", ms(engine.round_trip_ms), p99(engine.round_trip_ms)),
      row("to the server", ms(engine.to_server_ms), p99(engine.to_server_ms)),
      row("to the engine", ms(engine.to_client_ms), p99(engine.to_client_ms)),
      row("lost", `${digits(100 * lost, 2)} %`, `${engine.lost} of ${engine.lost + engine.received}`),
      row("forces", `${Math.round(rate)} /s`, late > 0 ? `${late} late: ${why}` : "none late"),
      (engine.error_n !== null || engine.way !== "") && row("least sure", engine.error_n !== null ? `± ${digits(engine.error_n)} N` : "–",
        engine.way !== "" ? `by its own estimate; answered by “${engine.way}”` : "by its own estimate")),
    engine.state_one_in > 1 && h("p", { class: "note", text: `Its network path is full: the server sends it one state in ${engine.state_one_in}.` }),
    engine.forces_refused && h("p", { class: "note", text: "Its forces are not used: its network path loses too many datagrams." }),
    engine.words !== "" && h("p", { class: "note", text: `${engine.words[0]!.toUpperCase()}${engine.words.slice(1)}.` }));
}
