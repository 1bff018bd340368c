// SPDX-License-Identifier: Apache-2.0
import { h, s, say } from "./dom.js";
import { count, duration, percent } from "./words.js";

const kWidth = 320;
const kHeight = 112;
const kFloor = 92;
/** Half the width of a label. */
const kMargin = 12;

/** Lateness of the haptic loop: counts by powers of two of 1 µs, on a logarithmic axis that shows the tail. */
export class Histogram {
  readonly element: HTMLElement;
  readonly #words = h("p", { class: "words" });
  readonly #more = h("p", { class: "quiet" });
  readonly #svg = s("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, role: "img", "aria-label": "lateness of the haptic loop" });
  #drawn = "";

  constructor() {
    this.element = h("section", { class: "panel lateness" }, h("h3", { text: "How late the haptic loop woke" }), this.#words, this.#svg as unknown as HTMLElement, this.#more);
  }

  /** `buckets` contains counts as in DeviceReport. `what` describes their time span, `more` is an additional text. */
  draw(buckets: readonly number[], what: string, more: string): void {
    const all = buckets.reduce((sum, n) => sum + n, 0);
    if (all === 0) {
      say(this.#words, "No report yet: the server sends one each second to clients that may see it.");
      this.#svg.replaceChildren();
      this.#svg.toggleAttribute("hidden", true);
      this.#drawn = "";
      return say(this.#more, more);
    }
    const quantile = (q: number): string => {
      let sum = 0;
      const bucket = buckets.findIndex((n) => (sum += n) >= q * all);
      return duration(2 ** bucket * 1e-6);
    };
    say(this.#words, `${what}: half within ${quantile(0.5)}, 99\u00a0% within ${quantile(0.99)}, all within ${quantile(1)}.`);
    say(this.#more, more);
    const drawn = buckets.join();
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    this.#svg.toggleAttribute("hidden", false);
    const last = Math.max(buckets.findLastIndex((n) => n > 0), 11);
    const width = (kWidth - 2 * kMargin) / (last + 1);
    const most = Math.log10(Math.max(...buckets) + 1);
    const bars = buckets.slice(0, last + 1).flatMap((n, i) => {
      const x = kMargin + i * width;
      const high = n === 0 ? 0 : Math.max(2, (Math.log10(n + 1) / most) * (kFloor - 14));
      const range = i === 0 ? "at most 1 µs" : `${duration(2 ** (i - 1) * 1e-6)} to ${duration(2 ** i * 1e-6)}`;
      const label = i % (last > 13 ? 3 : 2) === 0 ? [s("text", { x: x + width / 2, y: kHeight - 6, class: "tick", text: duration(2 ** i * 1e-6) })] : [];
      return [
        s("rect", { x: x + 1, y: kFloor - high, width: Math.max(width - 2, 1), height: high, class: "bar" },
          s("title", { text: `${range}: ${count(n)} wake-ups (${percent(n / all)})` })),
        ...label,
      ];
    });
    this.#svg.replaceChildren(s("line", { x1: 0, x2: kWidth, y1: kFloor + 0.5, y2: kFloor + 0.5, class: "axis" }), ...bars);
  }
}
