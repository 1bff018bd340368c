// SPDX-License-Identifier: Apache-2.0
import { h, s, say } from "./dom.js";
import type { Track } from "./track.js";
import { digits } from "./words.js";

const kWidth = 320;
const kHeight = 158;
/** Places in the picture: the proxy, the greatest depth of the scale, the column of both, and the axis. */
const [kTop, kBottom, kMiddle, kAxis] = [22, 138, 64, 292];

/**
 * The field that the device renders: the proxy, and below it the hand at its depth. Up is from the hand to the proxy.
 * The surface is drawn in the 3-D view.
 */
export class FieldPanel {
  readonly element: HTMLElement;
  readonly #generation = h("td", {});
  readonly #depth = h("td", {});
  readonly #proxy = h("td", {});
  readonly #svg = s("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, role: "img" });
  #drawn = "";

  constructor() {
    const row = (name: string, value: HTMLElement): HTMLElement => h("tr", {}, h("th", { scope: "row", text: name }), value);
    this.element = h("section", { class: "panel field-panel", hidden: true }, h("h3", { text: "The field that the device renders" }),
      this.#svg as unknown as HTMLElement,
      h("table", {}, row("generation in use", this.#generation), row("depth of the hand", this.#depth), row("proxy x, y, z", this.#proxy)),
      h("p", { class: "note", text: "The shape of the object is not sent to observers. The 3-D view shows the surface where it was touched." }));
  }

  /** Shows the values at `cursor`. The scale fits the largest depth in [from, to]. */
  draw(track: Track, from: number, to: number, cursor: number): void {
    this.element.hidden = !track.hasField;
    if (!track.hasField) return;
    const at = track.at(cursor);
    const i = at < track.end ? at : track.end - 1;
    const value = (name: "field" | "depth" | "px" | "py" | "pz"): number => track.column(name)[i] ?? NaN;
    const generation = value("field");
    const depth = generation > 0 ? value("depth") : NaN;
    say(this.#generation, generation > 0 ? String(generation) : "none");
    say(this.#depth, Number.isNaN(depth) ? "–" : depth > 0 ? `${digits(1e3 * depth)} mm` : "no contact");
    say(this.#proxy, Number.isNaN(depth) ? "–" : `${[value("px"), value("py"), value("pz")].map((v) => (1e3 * v).toFixed(1).replace("-", "−")).join(", ")} mm`);
    this.#draw(1e3 * depth, scaleOf(1e3 * deepest(track, from, to)));
  }

  /** Both in mm. The depth is NaN if no field is rendered. */
  #draw(depth: number, scale: number): void {
    const y = kTop + (Math.min(depth, scale) / scale) * (kBottom - kTop);
    const drawn = `${y.toFixed(1)} ${scale}`;
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    const text = (x: number, at: number, words: string, name = ""): SVGElement => s("text", { x, y: at + 4, class: name, text: words });
    const axis = [0, scale / 2, scale].flatMap((mm) => {
      const tick = kTop + (mm / scale) * (kBottom - kTop);
      return [s("line", { x1: kAxis - 5, x2: kAxis, y1: tick, y2: tick, class: "axis" }), text(kAxis - 9, tick, `${mm} mm`, "tick")];
    });
    const none = Number.isNaN(depth);
    this.#svg.setAttribute("aria-label", none ? "no field is rendered" : depth > 0 ? `the hand is ${digits(depth)} mm below the proxy` : "the hand is at the proxy");
    this.#svg.replaceChildren(
      s("line", { x1: kAxis, x2: kAxis, y1: kTop, y2: kBottom, class: "axis" }), ...axis,
      ...(none ? [text(16, (kTop + kBottom) / 2, "no field is rendered")] : [
        s("line", { x1: 16, x2: kAxis - 60, y1: kTop, y2: kTop, class: "level" }),
        s("line", { x1: kMiddle, x2: kMiddle, y1: kTop, y2: y, class: "depth" }),
        s("circle", { cx: kMiddle, cy: kTop, r: 9, class: "proxy" }),
        s("circle", { cx: kMiddle, cy: y, r: 5, class: "hand" }),
        text(kMiddle + 16, kTop - 12, "proxy"),
        text(kMiddle + 16, Math.max(y, kTop + 13), depth > 0 ? `hand, ${digits(depth)} mm deep` : "hand, no contact"),
      ]));
  }
}

/** Returns the largest depth in [from, to], in m, or 0 if there is no field. */
function deepest(track: Track, from: number, to: number): number {
  const depth = track.column("depth");
  const last = track.after(to);
  let most = 0;
  for (let i = track.at(from); i < last; ++i) if (depth[i]! > most) most = depth[i]!;
  return most;
}

/** Returns the next of 0.5, 1, 2, 5, 10 … mm, so that the picture keeps its scale. */
function scaleOf(most: number): number {
  let scale = 0.5;
  for (let step = 0; scale < most && step < 12; ++step) scale *= step % 3 === 2 ? 2.5 : 2;
  return scale;
}
