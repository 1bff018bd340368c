// SPDX-License-Identifier: Apache-2.0
import { h, say, theme } from "./dom.js";
import { shares, type Shares, type Track } from "./track.js";
import { digits, kReasons, percent, type ReasonWords } from "./words.js";

const kLimiting = kReasons.reduce((bits, reason) => (reason.limits ? bits | (1 << reason.bit) : bits), 0);
const kHeight = 8;

interface Lane {
  readonly row: HTMLElement;
  readonly share: HTMLElement;
  readonly canvas: HTMLCanvasElement;
}

/** Reasons why the force differed from the requested one: a summary, and a timeline for each reason. */
export class Lanes {
  readonly element: HTMLElement;
  readonly #sentence = h("p", { class: "why" });
  readonly #list = h("div", { class: "lanes" });
  readonly #lanes = new Map<number, Lane>();
  #seen: ReasonWords[] = [];

  constructor() {
    this.element = h("section", { class: "panel reasons" }, h("h3", { text: "Why the force is not what was asked for" }), this.#sentence, this.#list);
  }

  draw(track: Track, from: number, to: number): void {
    const found = shares(track, from, to, kLimiting);
    const { share } = found;
    say(this.#sentence, found.n === 0 ? "No states in this time." : sentence(found, to - from));
    // A lane stays visible after it was shown once, because changing rows are hard to read.
    const now = kReasons.filter((reason) => share.has(reason.bit) || this.#seen.includes(reason));
    if (now.length !== this.#seen.length) {
      this.#seen = now;
      this.#list.replaceChildren(...now.map((reason) => this.#lane(reason).row));
    }
    for (const reason of now) {
      const lane = this.#lane(reason);
      say(lane.share, percent(share.get(reason.bit) ?? 0));
      this.#paint(lane.canvas, track, reason.bit, from, to);
    }
  }

  clear(): void {
    this.#seen = [];
    this.#list.replaceChildren();
  }

  #lane(reason: ReasonWords): Lane {
    const known = this.#lanes.get(reason.bit);
    if (known) return known;
    const share = h("span", { class: "share" });
    const canvas = h("canvas", { height: kHeight });
    const row = h("div", { class: "lane", "data-reason": reason.bit },
      h("div", { class: "label" }, h("b", { text: reason.name }), h("span", { class: "meaning", text: reason.meaning }), share), canvas);
    const lane = { row, share, canvas };
    this.#lanes.set(reason.bit, lane);
    return lane;
  }

  #paint(canvas: HTMLCanvasElement, track: Track, bit: number, from: number, to: number): void {
    const ratio = window.devicePixelRatio;
    const width = canvas.clientWidth;
    if (width === 0) return;
    canvas.width = width * ratio;
    canvas.height = kHeight * ratio;
    const paint = canvas.getContext("2d")!;
    paint.scale(ratio, ratio);
    paint.fillStyle = theme("lane");
    paint.fillRect(0, 0, width, kHeight);
    paint.fillStyle = theme(bit === 8 || bit === 6 ? "bad" : "wanted");
    for (let px = 0, i = track.at(from); px < width; ++px) {
      const end = track.at(from + ((px + 1) / width) * (to - from));
      let set = false;
      for (; i < end; ++i) set ||= ((track.reasons[i]! >>> bit) & 1) === 1;
      if (set) paint.fillRect(px, 0, 1, kHeight);
    }
  }
}

function sentence({ share, any, apart, served }: Shares, span: number): string {
  const time = span >= 1 ? `${Number(span.toPrecision(3))} s` : `${Number((1e3 * span).toPrecision(3))} ms`;
  if (!served) return `In these ${time} no fresh force came.`;
  if (any === 0) return `In these ${time} the hand felt what the engines asked for.`;
  const most = kReasons.filter((r) => r.limits && share.has(r.bit)).sort((a, b) => share.get(b.bit)! - share.get(a.bit)!)[0]!;
  const by = Number.isNaN(apart[0]) ? "" : `: it differed by ${digits(apart[0], 2)} N (median), ${digits(apart[1], 2)} N (95th percentile)`;
  return `For ${percent(any)} of the time with forces, in these ${time}, the hand did not feel what the engines asked for${by}. The main reason: ${most.meaning}.`;
}
