// SPDX-License-Identifier: Apache-2.0
import { h, mark, theme } from "./dom.js";
import type { Track } from "./track.js";
import { duration } from "./words.js";

const kHeight = 44;

/** An overview of one or more tracks with the shown time window, which can be dragged or moved with the arrow keys. */
export class Scrubber {
  readonly element: HTMLElement;
  readonly #canvas: HTMLCanvasElement;
  readonly #window: HTMLElement;
  #tracks: readonly Track[] = [];
  #from = 0;
  #to = 1;
  #drawn = "";

  constructor(readonly moved: (from: number, to: number) => void) {
    this.#canvas = h("canvas", { height: kHeight });
    const left = h("span", { class: "grip left" });
    const right = h("span", { class: "grip right" });
    this.#window = h("div", { class: "window", tabindex: 0, role: "slider", "aria-label": "part of the recording that is shown" }, left, right);
    this.element = h("div", { class: "scrubber" }, this.#canvas, this.#window);

    let grip: "left" | "right" | "middle" | undefined;
    let held = 0;
    this.element.addEventListener("pointerdown", (event) => {
      const time = this.#time(event.clientX);
      grip = event.target === left ? "left" : event.target === right ? "right" : "middle";
      if (grip === "middle" && (time < this.#from || time > this.#to)) this.#go(time - this.#length / 2);
      held = time - this.#from;
      this.element.setPointerCapture(event.pointerId);
      event.preventDefault();
      this.#window.focus();
    });
    this.element.addEventListener("pointermove", (event) => {
      if (!grip) return;
      const time = this.#time(event.clientX);
      if (grip === "middle") this.#go(time - held);
      else if (grip === "left") this.#set(Math.min(time, this.#to - this.#least), this.#to);
      else this.#set(this.#from, Math.max(time, this.#from + this.#least));
    });
    for (const name of ["pointerup", "pointercancel"]) this.element.addEventListener(name, () => (grip = undefined));
    this.#window.addEventListener("keydown", (event) => {
      const step = this.#length / (event.shiftKey ? 2 : 10);
      if (event.key === "ArrowLeft") this.#go(this.#from - step);
      else if (event.key === "ArrowRight") this.#go(this.#from + step);
      else if (event.key === "Home") this.#go(this.#begin);
      else if (event.key === "End") this.#go(this.#end);
      else return;
      event.preventDefault();
    });
  }

  draw(tracks: readonly Track[], from: number, to: number): void {
    [this.#tracks, this.#from, this.#to] = [tracks, from, to];
    const whole = Math.max(this.#end - this.#begin, 1e-9);
    const share = (time: number): number => (100 * Math.min(Math.max(time - this.#begin, 0), whole)) / whole;
    this.#window.style.left = `${share(from)}%`;
    this.#window.style.width = `${Math.max(share(to) - share(from), 0.5)}%`;
    mark(this.#window, "aria-valuemin", this.#begin.toFixed(3));
    mark(this.#window, "aria-valuemax", this.#end.toFixed(3));
    mark(this.#window, "aria-valuenow", from.toFixed(3));
    mark(this.#window, "aria-valuetext", `${duration(to - from)} from ${from.toFixed(3)} s`);
    this.#picture();
  }

  repaint(): void {
    this.#drawn = "";
  }

  get #begin(): number {
    return Math.min(...this.#tracks.map((track) => track.first));
  }
  get #end(): number {
    return Math.max(...this.#tracks.map((track) => track.last));
  }
  get #length(): number {
    return this.#to - this.#from;
  }
  get #least(): number {
    return Math.max((this.#end - this.#begin) / 2000, 0.005);
  }

  #time(clientX: number): number {
    const { left, width } = this.element.getBoundingClientRect();
    return this.#begin + ((clientX - left) / width) * (this.#end - this.#begin);
  }
  #go(from: number): void {
    const start = Math.min(Math.max(from, this.#begin), Math.max(this.#begin, this.#end - this.#length));
    this.#set(start, start + this.#length);
  }
  #set(from: number, to: number): void {
    this.moved(Math.max(from, this.#begin), Math.min(to, this.#end));
  }

  /** Draws the maximum of the wanted and the applied force for each pixel. */
  #picture(): void {
    const width = this.element.clientWidth;
    const drawn = [width, this.#begin, this.#end, ...this.#tracks.map((t) => t.length)].join();
    if (width === 0 || drawn === this.#drawn) return;
    this.#drawn = drawn;
    const ratio = window.devicePixelRatio;
    this.#canvas.width = width * ratio;
    this.#canvas.height = kHeight * ratio;
    const paint = this.#canvas.getContext("2d")!;
    paint.scale(ratio, ratio);
    const colours = [theme("applied"), theme("second")];
    this.#tracks.forEach((track, n) => {
      const force = track.column("applied");
      const peaks = new Float32Array(width);
      let most = 1e-9;
      for (let px = 0, i = track.begin; px < width; ++px) {
        const end = track.at(this.#begin + ((px + 1) / width) * (this.#end - this.#begin));
        for (; i < end; ++i) if (force[i]! > peaks[px]!) peaks[px] = force[i]!;
        most = Math.max(most, peaks[px]!);
      }
      const lane = kHeight / this.#tracks.length;
      paint.fillStyle = colours[n % colours.length]!;
      for (let px = 0; px < width; ++px) {
        const high = (peaks[px]! / most) * (lane - 6);
        paint.fillRect(px, (n + 1) * lane - high - 1, 1, Math.max(high, 1));
      }
    });
  }
}
