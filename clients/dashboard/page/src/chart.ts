// SPDX-License-Identifier: Apache-2.0
import uPlot from "uplot";
import { h, mark, say, theme } from "./dom.js";
import { thin, type Column, type Plotted } from "./track.js";
import { digits } from "./words.js";

export interface Line<C extends string = Column> {
  readonly column: C;
  readonly name: string;
  /** CSS variable of the color. Lines also differ in dash and width. */
  readonly colour: string;
  readonly dash?: readonly number[];
  readonly width?: number;
  readonly fill?: string;
  /** Shown only while the legend button with this name is pressed. */
  readonly toggle?: string;
}

export interface ChartSpec<C extends string = Column> {
  readonly id: string;
  readonly title: string;
  readonly unit: string;
  /** Factor from SI to `unit`. */
  readonly scale: number;
  readonly lines: readonly Line<C>[];
  readonly positive?: boolean;
  /** Minimum range of the axis. */
  readonly least: number;
  /** Line that may leave the axis, because its large values would flatten the others. */
  readonly mayLeave?: C;
  /** The chart keeps its own axis if a shared axis would make it ten times smaller. */
  readonly ownScale?: boolean;
}

/** Requests of a user who drags or scrolls a chart. */
export interface ChartEvents {
  zoom(from: number, to: number): void;
  reset(): void;
  hover(time: number | undefined): void;
  changed(): void;
}

/** Height of a plot, which is lower on narrow screens. */
const heightFor = (width: number): number => (width < 500 ? 168 : 196);

/** A plot over time with a unit. The legend shows values at the cursor and toggles lines. */
export class Chart<C extends string = Column> {
  readonly element: HTMLElement;
  #plot: uPlot;
  readonly #box: HTMLElement;
  readonly #values: HTMLElement[];
  readonly #finer: HTMLElement;
  readonly #shown: boolean[];
  #width = 0;
  #shared: [number, number] | undefined;

  constructor(readonly spec: ChartSpec<C>, events: ChartEvents) {
    this.#values = spec.lines.map(() => h("span", { class: "value" }));
    this.#shown = spec.lines.map((line) => line.toggle === undefined);
    const keys = spec.lines.map((line, i) => h("span", { class: "key", hidden: !this.#shown[i] }, swatch(line), line.name, " ", this.#values[i]!));
    const toggles = [...new Set(spec.lines.flatMap((line) => line.toggle ?? []))].map((name) => {
      const button = h("button", { type: "button", class: "toggle", "aria-pressed": "false", click: () => {
        const pressed = button.getAttribute("aria-pressed") !== "true";
        mark(button, "aria-pressed", String(pressed));
        spec.lines.forEach((line, i) => {
          if (line.toggle !== name) return;
          this.#shown[i] = pressed;
          keys[i]!.hidden = !pressed;
          this.#plot.setSeries(i + 1, { show: pressed });
        });
        events.changed();
      } }, name);
      return button;
    });
    const legend = h("div", { class: "legend" }, ...keys, ...toggles);
    this.#box = h("div", { class: "plot" });
    this.#finer = h("span", { class: "unit" });
    this.element = h("figure", { class: "chart", "data-chart": spec.id },
      h("figcaption", {}, h("span", { class: "title" }, spec.title, h("span", { class: "unit", text: spec.unit }), this.#finer), legend), this.#box);

    const font = "11px system-ui, sans-serif";
    const grid = { stroke: () => theme("grid"), width: 1 };
    const options: uPlot.Options = {
      width: 300,
      height: heightFor(300),
      padding: [8, 20, 0, 0],
      legend: { show: false },
      cursor: { y: false, drag: { x: true, y: false, setScale: false }, points: { show: false }, sync: { key: "tendon" } },
      scales: { x: { time: false }, y: { range: () => this.#range() } },
      axes: [
        { stroke: () => theme("quiet"), font, grid, ticks: grid, size: 30, space: 70, values: (_, at) => at.map((t) => `${Number(t.toFixed(6))} s`) },
        { stroke: () => theme("quiet"), font, grid, ticks: { show: false }, size: 48, space: 28, values: (_, at) => at.map((v) => String(Number(v.toPrecision(6))).replace("-", "−")) },
      ],
      series: [{}, ...spec.lines.map((line): uPlot.Series => ({
        label: line.name,
        show: line.toggle === undefined,
        stroke: () => theme(line.colour),
        width: line.width ?? 1.5,
        ...(line.dash ? { dash: [...line.dash] } : {}),
        ...(line.fill ? { fill: () => theme(line.fill!) } : {}),
        points: { show: false },
        spanGaps: false,
      }))],
      hooks: {
        setSelect: [(plot) => {
          const { left, width } = plot.select;
          if (width < 4) return;
          events.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
          plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        }],
        setCursor: [(plot) => {
          const left = plot.cursor.left ?? -1;
          if (plot.cursor.event) events.hover(left < 0 ? undefined : plot.posToVal(left, "x"));
        }],
      },
    };
    this.#plot = new uPlot(options, [[], ...spec.lines.map(() => [])], this.#box);
    this.#plot.over.addEventListener("dblclick", () => events.reset());
  }

  /** Shows [from, to]. The legend shows the values at `cursor`. */
  draw(track: Plotted<C>, from: number, to: number, cursor: number): void {
    const width = this.#box.clientWidth;
    if (width === 0) return;
    if (width !== this.#width) {
      this.#width = width;
      this.#plot.setSize({ width, height: heightFor(width) });
    }
    const lines = this.spec.lines.filter((_, k) => this.#shown[k]);
    const [times, ...values] = thin(track, lines.map((line) => line.column), from, to, Math.max(width - 60, 50), this.spec.scale);
    say(this.#finer, ""); // until it shares an axis
    const data = [times, ...this.#shown.map((shown) => (shown ? values.shift()! : []))];
    this.#plot.batch(() => {
      this.#plot.setData(data as uPlot.AlignedData, false);
      this.#plot.setScale("x", { min: from, max: to });
    });
    const at = track.at(cursor);
    const i = at < track.end ? at : track.end - 1;
    this.spec.lines.forEach((line, k) => {
      const value = i >= track.begin ? track.column(line.column)[i]! * this.spec.scale : NaN;
      say(this.#values[k]!, digits(value));
    });
  }

  /** Range of the drawn values, without the line that may leave the axis. */
  extent(): [number, number] {
    let [from, to] = [Infinity, -Infinity];
    this.spec.lines.forEach((line, k) => {
      if (line.column === this.spec.mayLeave || !this.#shown[k]) return;
      for (const v of this.#plot?.data[k + 1] ?? []) {
        if (v == null) continue;
        if (v < from) from = v;
        if (v > to) to = v;
      }
    });
    return from > to ? [0, 0] : [from, to];
  }

  share([from, to]: readonly [number, number]): void {
    const [ownFrom, ownTo] = this.extent();
    const finer = (Math.max(to, 0) - Math.min(from, 0)) / Math.max(Math.max(ownTo, 0) - Math.min(ownFrom, 0), this.spec.least);
    const own = this.spec.ownScale === true && finer >= 10;
    say(this.#finer, own ? `(scale ${digits(finer, 2)} × finer)` : "");
    this.#shared = own ? undefined : [from, to];
    const [min, max] = own ? this.#range() : [from, to];
    this.#plot.setScale("y", { min, max });
    this.#shared = undefined;
  }

  repaint(): void {
    this.#plot.redraw(false, true);
  }

  destroy(): void {
    this.#plot.destroy();
  }

  #range(): [number, number] {
    const { positive, least, mayLeave } = this.spec;
    let [from, to] = this.#shared ?? this.extent();
    if (mayLeave) to *= 1.25;
    if (positive) from = Math.min(0, from);
    const middle = (from + to) / 2;
    if (to - from < least) [from, to] = positive && from === 0 ? [0, Math.max(to, least)] : [middle - least / 2, middle + least / 2];
    const room = (to - from) * 0.06;
    return [positive && from === 0 ? 0 : from - room, to + room];
  }
}

function swatch(line: Line<string>): HTMLElement {
  const box = h("span", { class: "swatch" });
  const style = !line.dash ? "solid" : (line.dash[0] ?? 0) > 3 ? "dashed" : "dotted";
  box.style.borderTop = `${line.fill ? 2 : Math.max(2, line.width ?? 2)}px ${style} var(--${line.colour})`;
  return box;
}
