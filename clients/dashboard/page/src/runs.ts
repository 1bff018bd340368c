// SPDX-License-Identifier: Apache-2.0
import { h, say } from "./dom.js";
import { readRecording, type DeviceTrack, type Recording } from "./recording.js";
import { Scrubber } from "./scrubber.js";
import type { Shown } from "./space/stage.js";
import type { HandleInfo } from "./stream.js";
import { quantiles, type Track } from "./track.js";
import { View, type Facts } from "./view.js";
import { bytes, count, dateTime, duration, moment, percent } from "./words.js";

interface Entry {
  readonly name: string;
  readonly size_bytes: number;
  readonly modified_unix_s: number;
}

const kMostRuns = 2;

/** The recordings of a folder: a list, or one or two of them in the view of a live device. */
export class Runs {
  readonly element = h("main", { class: "recordings" });
  #open: Run[] = [];
  #scrubber: Scrubber | undefined;
  #asked = 0;
  #from = 0;
  #to = 0;
  #cursor: number | undefined;
  #due = false;

  repaint(): void {
    this.#scrubber?.repaint();
    for (const run of this.#open) run.view.repaint();
    this.#draw();
  }

  /** Without names, shows the list. Otherwise shows one or two recordings, starting `from` s after their beginnings. */
  async show(names: readonly string[], from: number): Promise<void> {
    const asked = ++this.#asked;
    for (const run of this.#open) run.view.destroy();
    this.#open = [];
    this.#scrubber = undefined;
    const wanted = names.filter((name) => name !== "").slice(0, kMostRuns);
    const said = h("p", { class: "progress", role: "status", text: wanted.length > 0 ? "Reading …" : "Looking …" });
    this.element.replaceChildren(said);
    try {
      if (wanted.length === 0) {
        const entries = (await (await fetch("api/recordings")).json()) as Entry[];
        if (asked === this.#asked) this.element.replaceChildren(list(entries));
        return;
      }
      const read: Recording[] = [];
      for (const name of wanted) {
        read.push(await readRecording(`recordings/${encodeURIComponent(name)}`, name, from, (n) => say(said, `Reading ${name}: ${count(n)} steps …`)));
        if (asked !== this.#asked) return;
      }
      this.#present(read);
    } catch (error) {
      if (asked !== this.#asked) return;
      this.element.replaceChildren(h("p", { class: "error", role: "alert", text: error instanceof Error ? error.message : String(error) }), h("a", { href: "#/recordings" }, "All recordings"));
    }
  }

  #present(read: readonly Recording[]): void {
    const moved = (from: number, to: number): void => {
      [this.#from, this.#to] = [from, to];
      this.#later();
    };
    const events = {
      zoom: moved,
      reset: () => moved(this.#begin, this.#end),
      hover: (time: number | undefined) => {
        this.#cursor = time;
        this.#later();
      },
      changed: () => this.#later(),
    };
    const names = read.map((r) => r.name);
    this.#open = read.map((recording) => new Run(recording, addressOf(names), new View(events), () => this.#later()));
    this.#scrubber = new Scrubber(moved);
    const zoom = (factor: number): void => {
      const [middle, half] = [(this.#from + this.#to) / 2, ((this.#to - this.#from) / 2) * factor];
      if (half >= 0.001) moved(Math.max(middle - half, this.#begin), Math.min(middle + half, this.#end));
    };
    const bar = h("div", { class: "bar" }, h("a", { href: "#/recordings" }, "‹ All recordings"), h("span", { class: "space" }),
      names.length === 2 && h("a", { href: addressOf([...names].reverse()) }, "Swap sides"),
      h("span", { class: "group" },
        h("button", { type: "button", id: "zoom-in", "aria-label": "Zoom in", title: "Zoom in", click: () => zoom(0.5) }, "+"),
        h("button", { type: "button", id: "zoom-out", "aria-label": "Zoom out", title: "Zoom out", click: () => zoom(2) }, "−")),
      h("button", { type: "button", id: "whole", click: () => moved(this.#begin, this.#end) }, "All of it"));
    this.element.replaceChildren(bar, this.#scrubber.element, h("div", { class: read.length === 2 ? "runs two" : "runs" }, ...this.#open.map((run) => run.element)));
    this.#cursor = undefined;
    moved(this.#begin, Math.min(this.#end, this.#begin + 10));
  }

  get #begin(): number {
    return Math.min(...this.#open.map((run) => run.track.first));
  }

  get #end(): number {
    return Math.max(...this.#open.map((run) => run.track.last), this.#begin + 0.01);
  }

  #later(): void {
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => {
      this.#due = false;
      this.#draw();
    });
  }

  #draw(): void {
    if (!this.#scrubber || this.#open.length === 0) return;
    this.#scrubber.draw(this.#open.map((run) => run.track), this.#from, this.#to);
    // Starts at the beginning, because the end of a recording is not representative.
    const cursor = this.#cursor ?? this.#from;
    for (const run of this.#open) run.draw(this.#from, this.#to, cursor);
    if (this.#open.length < 2) return;
    const all = this.#open.map((run) => run.view.extents());
    const widest = all[0]!.map((_, i): [number, number] => [Math.min(...all.map((one) => one[i]![0])), Math.max(...all.map((one) => one[i]![1]))]);
    for (const run of this.#open) run.view.share(widest);
  }
}

const addressOf = (names: readonly string[]): string => `#/recordings/${names.map(encodeURIComponent).join("/")}`;

/** A recording contains only the properties of the handle that are in its scene. */
const kUntold: HandleInfo = { operator_from_device: null, buttons: [], orientation_measured: false, max_torque_nm: 0, gripper_open_rad: null, max_gripper_force_n: 0, group: "", hand: "any" };

class Run {
  readonly element: HTMLElement;
  #device: DeviceTrack;
  #facts: { key: string; facts: Facts } | undefined;

  /** `address` is the URL of all shown recordings from their beginning. */
  constructor(
    readonly recording: Recording,
    address: string,
    readonly view: View,
    changed: () => void,
  ) {
    this.#device = recording.devices[0]!;
    const device = h("select", { "aria-label": "Device", hidden: recording.devices.length < 2, change: () => {
      this.#device = recording.devices[device.selectedIndex]!;
      this.view.clear();
      changed();
    } }, ...recording.devices.map((d) => h("option", {}, d.name || "first device")));
    const when = new Date(Number(recording.began / 1_000_000n));
    const { from, next } = recording;
    const part = from > 0 || next !== undefined
      ? h("div", { class: "alert part" }, `This recording is shown in parts. This part: ${moment(this.track.first)} to ${moment(this.track.last)}.`,
        from > 0 && h("a", { href: address }, "From the beginning"), next !== undefined && h("a", { href: `${address}?from=${next}` }, `Go on from ${moment(next)}`))
      : undefined;
    const facts = [recording.began > 10n ** 17n ? dateTime(when) : "simulated", duration(this.track.last - this.track.first), `${count(this.track.length)} steps`, recording.scene?.version].filter(Boolean).join(" · ");
    this.element = h("section", { class: "run", "data-run": recording.name },
      h("div", { class: "head" }, h("h2", { text: recording.name }), h("span", { class: "quiet", text: facts }), device),
      part,
      ...recording.remarks.map((text) => h("div", { class: "alert", text })),
      view.element,
      recording.scene && h("details", {}, h("summary", { text: "Scene" }), h("pre", { text: recording.scene.text })));
  }

  get track(): Track {
    return this.#device.track;
  }

  draw(from: number, to: number, cursor: number): void {
    const key = `${this.#device.name} ${from} ${to}`;
    if (this.#facts?.key !== key) this.#facts = { key, facts: this.#compute(from, to) };
    if (this.view.space()) this.view.drawSpace([this.#shown(cursor)], { from: Math.max(from, this.track.first), to: Math.min(to, this.track.last), at: cursor });
    this.view.draw(this.track, from, to, cursor, moment(Math.min(Math.max(cursor, this.track.first), this.track.last)), this.#facts.facts);
  }

  #shown(time: number): Shown {
    const { name, track, frame } = this.#device;
    return { name, track, time, handle: frame ? { ...kUntold, operator_from_device: frame } : null, workspace: null, watched: true };
  }

  #compute(from: number, to: number): Facts {
    const track = this.track;
    const [first, last] = [track.at(from), track.after(to)];
    const buckets = new Array<number>(24).fill(0);
    const late = track.column("late");
    let faults = 0;
    for (let i = first; i < last; ++i) {
      const us = late[i]! * 1e6;
      ++buckets[us <= 1 ? 0 : Math.min(Math.ceil(Math.log2(us) - 1e-9), 23)]!;
      if (track.mode[i] === 6) ++faults;
    }
    const [age, oldest] = quantiles(track, "age", from, to, [0.5, 0.99]);
    const missed = countMissed(track, first, last);
    return {
      state: faults > 0
        ? { level: "bad", name: "Fault", meaning: `in ${count(faults)} of the ${count(last - first)} steps shown` }
        : { level: "off", name: "Recorded", meaning: last - first === track.length ? `all ${count(track.length)} steps are shown` : `${count(last - first)} of ${count(track.length)} steps are shown` },
      engines: [],
      noEngines: "A recording holds no reports of engines: see the age of the force.",
      delay: age! > 0
        ? { name: "Age of the force", value: duration(age!), note: `since the motion that it answers; 99\u00a0%: ${duration(oldest!)}` }
        : { name: "Age of the force", value: "–", note: "no force was in use" },
      loss: { name: "Missing steps", value: count(missed), note: missed > 0 ? `${percent(missed / (last - first + missed))} of this time has no step` : "in this time" },
      lateness: { buckets: last > first ? buckets : [], what: "In this time", more: "" },
      gives: true,
      degraded: "",
    };
  }
}

function countMissed(track: Track, first: number, last: number): number {
  if (last - first < 2) return 0;
  const step = (track.t[last - 1]! - track.t[first]!) / (last - 1 - first);
  let missed = 0;
  for (let i = first + 1; i < last; ++i) {
    const gap = track.t[i]! - track.t[i - 1]!;
    if (gap > 1.6 * step) missed += Math.round(gap / step) - 1;
  }
  return missed;
}

function list(entries: readonly Entry[]): HTMLElement {
  if (entries.length === 0) {
    return h("div", { class: "list" }, h("p", { class: "empty", text: "There is no recording in the folder of tendon-dash yet. tendond --record run.mcap makes one." }));
  }
  const chosen = new Set<string>();
  const compare = h("button", { type: "button", id: "compare", class: "primary", disabled: true, click: () => {
    location.hash = addressOf([...chosen]);
  } }, "Compare two");
  const rows = entries.map((entry) => {
    const box = h("input", { type: "checkbox", "aria-label": `Compare ${entry.name}`, change: () => {
      if (box.checked) chosen.add(entry.name);
      else chosen.delete(entry.name);
      compare.disabled = chosen.size !== 2;
      compare.textContent = chosen.size === 1 ? "Choose one more to compare" : "Compare two";
    } });
    return h("tr", {}, h("td", {}, box), h("td", {}, h("a", { href: addressOf([entry.name]) }, entry.name)),
      h("td", { text: bytes(entry.size_bytes) }), h("td", { class: "date", text: dateTime(new Date(entry.modified_unix_s * 1e3)) }));
  });
  return h("div", {}, h("div", { class: "bar" }, h("span", { class: "quiet", text: `${count(entries.length)} ${entries.length === 1 ? "recording" : "recordings. Open one, or choose two to see them side by side"}.` }), h("span", { class: "space" }), compare),
    h("div", { class: "list" }, h("table", {},
      h("thead", {}, h("tr", {}, h("th", {}), h("th", { text: "Name" }), h("th", { text: "Size" }), h("th", { class: "date", text: "Last written" }))), h("tbody", {}, ...rows))));
}
