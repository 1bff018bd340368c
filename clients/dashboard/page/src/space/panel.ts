// SPDX-License-Identifier: Apache-2.0
import { h, mark, say } from "../dom.js";
import { digits, moment } from "../words.js";
import type { Figure, Vec } from "./figure.js";
import type { Shown, Stage } from "./stage.js";

/** s, available time range while paused. */
export interface Instants {
  readonly from: number;
  readonly to: number;
  readonly at: number;
}

const kNoWebGl = "This browser has no WebGL, so the view stays 2-D.";

/** Container of the 3-D view. It loads three.js when needed and shows the values of the arrows as numbers. */
export class SpacePanel {
  readonly element: HTMLElement;
  /** 3-D is not available, which is shown as a message. */
  missing = false;
  readonly #canvas: HTMLCanvasElement;
  readonly #said = h("p", { class: "quiet", role: "status" });
  readonly #rows = h("div", { class: "handles" });
  readonly #slider: HTMLInputElement;
  readonly #play: HTMLButtonElement;
  readonly #when = h("span", { class: "when" });
  readonly #seek: HTMLElement;
  #stage: Stage | undefined;
  #asked = false;
  #destroyed = false;
  #instants: Instants | undefined;
  #playing: number | undefined;
  #readout: Row[] = [];

  /** `changed`: draw again. `seek`: the user wants to see that time. */
  constructor(readonly changed: () => void, readonly seek: (time: number) => void) {
    this.#canvas = h("canvas", { tabindex: 0, role: "img", "aria-label": "3-D view" });
    this.#slider = h("input", { type: "range", min: 0, max: 1000, "aria-label": "Instant that is shown", input: () => {
      this.#stop();
      const { from, to } = this.#instants!;
      this.seek(from + (Number(this.#slider.value) / 1000) * (to - from));
    } });
    this.#play = h("button", { type: "button", class: "play", "aria-label": "Play", click: () => (this.#playing === undefined ? this.#start() : this.#stop()) }, "▶");
    this.#seek = h("div", { class: "seek", hidden: true }, this.#play, this.#slider, this.#when);
    this.element = h("figure", { class: "chart spatial", "data-chart": "space", hidden: true },
      h("figcaption", {}, h("span", { class: "title" }, "In space"), h("span", { class: "legend" },
        key("applied", "applied force"), key("wanted", "wanted force", true), h("span", { text: "1 cm for 1 N" }), key("torque", "torque"), key("energy", "surface"), key("second", "proxy and touched surface"))),
      this.#said, h("div", { class: "stage" }, this.#canvas), this.#seek, this.#rows);
  }

  /** Hides the view, or shows the devices. `instants` is set while time is paused. */
  hide(): void {
    this.#stop();
    this.element.hidden = true;
  }

  draw(shown: readonly Shown[], instants: Instants | undefined): void {
    this.element.hidden = false;
    this.#instants = instants;
    this.#seek.hidden = instants === undefined;
    if (instants) {
      const share = (1000 * (instants.at - instants.from)) / Math.max(instants.to - instants.from, 1e-9);
      if (document.activeElement !== this.#slider || this.#playing !== undefined) this.#slider.value = String(Math.round(share));
      say(this.#when, moment(Math.max(instants.at, 0)));
    } else {
      this.#stop();
    }
    if (!this.#stage) return this.#load();
    if (this.#canvas.clientWidth === 0) return;
    const words = this.#stage.draw(shown);
    mark(this.#canvas, "aria-label", `3-D view. ${words}`);
    this.#tell(shown, this.#stage.figures());
  }

  repaint(): void {
    this.#stage?.repaint();
  }

  destroy(): void {
    this.#stop();
    this.#destroyed = true;
    this.#stage?.destroy();
    this.#stage = undefined;
  }

  #load(): void {
    if (this.#asked || this.missing) return;
    this.#asked = true;
    if (!document.createElement("canvas").getContext("webgl2")) return this.#lacks(kNoWebGl);
    say(this.#said, "Loading the 3-D view …");
    import("./stage.js").then(({ Stage: Made }) => {
      if (this.#destroyed) return;
      this.#stage = new Made(this.#canvas, this.changed);
      this.#said.hidden = true;
      this.changed();
    }).catch((error: unknown) => this.#lacks(`The 3-D view cannot be shown: ${String(error)}`));
  }

  #lacks(words: string): void {
    this.missing = true;
    say(this.#said, words);
    this.#said.hidden = false;
    this.#canvas.parentElement!.hidden = true;
    this.#seek.hidden = true;
    this.changed();
  }

  /** Plays in real time from the shown time, or from the beginning if that is the last one. */
  #start(): void {
    if (!this.#instants) return;
    const { from, to } = this.#instants;
    const first = this.#instants.at >= to - 1e-3 ? from : this.#instants.at;
    const began = performance.now();
    say(this.#play, "❚❚");
    mark(this.#play, "aria-label", "Stop");
    const step = (now: number): void => {
      const at = first + Math.max(now - began, 0) / 1e3;
      this.seek(Math.min(at, to));
      if (at >= to) return this.#stop();
      this.#playing = requestAnimationFrame(step);
    };
    this.#playing = requestAnimationFrame(step);
  }

  #stop(): void {
    if (this.#playing === undefined) return;
    cancelAnimationFrame(this.#playing);
    this.#playing = undefined;
    say(this.#play, "▶");
    mark(this.#play, "aria-label", "Play");
  }

  /** Updates texts at most ten times per second, because layouts are expensive. */
  #tell(shown: readonly Shown[], figures: readonly (Figure | undefined)[]): void {
    if (this.#readout.length !== shown.length) {
      this.#readout = shown.map(() => new Row());
      this.#rows.replaceChildren(...this.#readout.map((row) => row.element));
      this.#told = 0;
    }
    const now = performance.now();
    if (this.#instants === undefined && now - this.#told < 100) return;
    this.#told = now;
    shown.forEach((device, i) => this.#readout[i]!.show(device, figures[i]));
  }
  #told = 0;
}

const key = (colour: string, name: string, thin = false): HTMLElement => {
  const swatch = h("span", { class: "swatch" });
  swatch.style.borderTop = `${thin ? 2 : 4}px solid var(--${colour})`;
  return h("span", { class: "key" }, swatch, name);
};

class Row {
  readonly element: HTMLElement;
  readonly #name = h("b", {});
  readonly #values = h("span", { class: "values" });
  readonly #buttons = h("span", { class: "buttons" });
  readonly #frame = h("span", { class: "note", text: "How it lies before you is not known: drawn as if x were right, y up, z to you." });
  #names = "";

  constructor() {
    this.element = h("div", { class: "handle" }, this.#name, this.#values, this.#buttons, this.#frame);
  }

  show({ name, watched, handle }: Shown, figure: Figure | undefined): void {
    say(this.#name, name);
    this.#name.hidden = name === "";
    mark(this.element, "data-watched", String(watched));
    say(this.#values, figure ? valuesOf(figure) : "no state has come");
    this.#frame.hidden = handle?.operator_from_device != null;
    const buttons = figure?.buttons ?? [];
    const names = buttons.map((b) => b.name).join("\n");
    if (names !== this.#names) {
      this.#names = names;
      this.#buttons.replaceChildren(...buttons.map((b) => h("span", { class: "button" }, h("span", { class: "light", "aria-hidden": "true" }), b.name)));
    }
    buttons.forEach((b, i) => mark(this.#buttons.children[i]!, "data-held", String(b.held)));
  }
}

function valuesOf(figure: Figure): string {
  const size = (v: Vec | undefined): number => (v ? Math.hypot(...v) : NaN);
  const parts = [`${fixed(size(figure.force), 2)} N`];
  if (figure.torque) parts.push(`${fixed(1e3 * size(figure.torque), 0)} mN·m`);
  if (figure.opening !== undefined) parts.push(`open ${fixed((figure.opening * 180) / Math.PI, 0)}°`);
  if (figure.gripForce !== undefined) parts.push(`grip ${fixed(figure.gripForce, 2)} N`);
  if (figure.hand) parts.push(`hand ${fixed(size(figure.hand), 2)} N`);
  if (figure.plane) parts.push(figure.plane.gap < 0 ? `${digits(-1e3 * figure.plane.gap, 2)} mm in the surface` : `${digits(1e3 * figure.plane.gap, 2)} mm above it`);
  if (figure.proxy) parts.push(figure.proxy.depth > 0 ? `${digits(1e3 * figure.proxy.depth, 2)} mm below the proxy` : "at the proxy");
  return parts.join(" · ");
}

/** Uses a constant number of digits, because a changing width is hard to read. */
const fixed = (value: number, places: number): string => (Number.isFinite(value) ? value.toFixed(places).replace("-", "−") : "–");
