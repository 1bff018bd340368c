// SPDX-License-Identifier: Apache-2.0
import { Arming } from "./arming.js";
import { Coupling } from "./coupling.js";
import type { ChartEvents } from "./chart.js";
import { h, mark, say } from "./dom.js";
import { Scrubber } from "./scrubber.js";
import { contactOf } from "./space/figure.js";
import type { Shown } from "./space/stage.js";
import { Stream, type Message, type PortsMessage, type ReportsMessage, type ServerMessage, type StatesMessage } from "./stream.js";
import { Track, noHandle, type HandleSample } from "./track.js";
import { View, type Facts } from "./view.js";
import { count, digits, duration, kDisarmed, kDisarmedBit, kSafety, moment } from "./words.js";

/** Number of steps to keep: two minutes at 1 kHz. */
const kKept = 120_000;
const kWindows = [0.5, 2, 5, 20, 60] as const;
/** ms per frame: enough for hand motion, and saves battery. */
const kFrameMs = 33;
/** ms per frame next to the 3-D view, which is drawn in every frame. */
const kBesideSpaceMs = 66;

export class Live {
  readonly element: HTMLElement;
  readonly #track = new Track(kKept);
  /** The newest states of the other devices, 60 per second, while they are shown in 3-D. */
  readonly #beside = new Map<number, { track: Track; zero: number }>();
  readonly #stream: Stream;
  readonly #view: View;
  readonly #coupling: Coupling;
  readonly #scrubber: Scrubber;
  readonly #arming = new Arming();
  readonly #pause: HTMLButtonElement;
  readonly #device: HTMLSelectElement;
  readonly #window: HTMLSelectElement;
  readonly #about = h("span", { class: "quiet about" });
  #server: ServerMessage | undefined;
  #reports: ReportsMessage | undefined;
  #watched = 0;
  #zero: number | undefined;
  #open = false;
  /** The shown time window while paused; undefined: it follows. */
  #still: { from: number; to: number } | undefined;
  #hover: number | undefined;
  #drawn = 0;
  #spaceDirty = true;
  #said = "";
  #dirty = true;
  #stopped = false;

  constructor(readonly told: (server: ServerMessage | undefined, words: string) => void) {
    this.#pause = h("button", { type: "button", id: "pause", "aria-pressed": "false", click: () => this.#setStill(this.#still ? undefined : this.#following()) }, "Pause");
    this.#device = h("select", { id: "device", "aria-label": "Device", change: () => this.#watch(Number(this.#device.value)) });
    this.#window = h("select", { id: "window", "aria-label": "Time shown", change: () => this.#still && this.#setStill(this.#around()) },
      ...kWindows.map((s) => h("option", { value: s, selected: s === 5 }, `${s} s`)));
    const zoom = (factor: number): void => {
      const { from, to } = this.#still ?? this.#following();
      const [middle, half] = [(from + to) / 2, ((to - from) / 2) * factor];
      if (half < 0.001) return;
      this.#setStill({ from: middle - half, to: Math.min(middle + half, Math.max(this.#track.last, middle)) });
    };
    const events: ChartEvents = {
      zoom: (from, to) => this.#setStill({ from, to }),
      reset: () => this.#setStill(undefined),
      hover: (time) => {
        this.#hover = time;
        this.#dirty = this.#spaceDirty = true;
      },
      changed: () => {
        this.#dirty = this.#spaceDirty = true;
      },
    };
    this.#view = new View(events);
    this.#coupling = new Coupling(events);
    this.#scrubber = new Scrubber((from, to) => this.#setStill({ from, to }));
    this.#scrubber.element.hidden = true;
    this.element = h("main", { class: "live" },
      h("div", { class: "bar" },
        h("label", { class: "field" }, "Device ", this.#device), this.#about, h("span", { class: "space" }),
        h("label", { class: "field" }, "Show ", this.#window),
        h("span", { class: "group" },
          h("button", { type: "button", id: "zoom-in", "aria-label": "Zoom in", title: "Zoom in", click: () => zoom(0.5) }, "+"),
          h("button", { type: "button", id: "zoom-out", "aria-label": "Zoom out", title: "Zoom out", click: () => zoom(2) }, "−")),
        this.#pause),
      this.#arming.element, this.#scrubber.element, this.#coupling.element, this.#view.element);
    this.#stream = new Stream((message) => this.#take(message), (open) => this.#changed(open));
    this.#loop();
  }

  repaint(): void {
    this.#scrubber.repaint();
    this.#view.repaint();
    this.#coupling.repaint();
    this.#dirty = true;
  }

  /** Called when the user switches between 2-D and 3-D. */
  chosen(): void {
    this.#dirty = this.#spaceDirty = true;
    this.#say();
  }

  #take(message: Message): void {
    this.#dirty = this.#spaceDirty = true;
    if (message.type === "states") this.#takeStates(message);
    else if (message.type === "ports") this.#takePorts(message);
    else if (message.type === "reports") this.#reports = message.device === this.#watched ? message : this.#reports;
    else this.#takeServer(message);
  }

  #takeStates(message: StatesMessage): void {
    if (message.device !== this.#watched) return this.#takeBeside(message);
    for (let i = 0; i < message.tick.length; ++i) {
      const sampled = message.sampled_us[i]! / 1e6;
      // The server was restarted, and its clock may have a new origin.
      if (this.#zero === undefined || sampled - this.#zero < this.#track.last) {
        this.#zero = sampled;
        this.#track.clear();
        this.#coupling.clear();
        this.#setStill(undefined);
      }
      push(this.#track, message, i, sampled - this.#zero);
    }
  }

  /** Its times are those of the device's steps. */
  #takePorts(message: PortsMessage): void {
    if (message.device !== this.#watched || this.#zero === undefined) return;
    for (const row of message.rows) this.#coupling.push(row.at_us / 1e6 - this.#zero, row);
  }

  #takeBeside(message: StatesMessage): void {
    for (let i = 0; i < message.tick.length; ++i) {
      const sampled = message.sampled_us[i]! / 1e6;
      let device = this.#beside.get(message.device);
      if (!device || sampled - device.zero < device.track.last) {
        device = { track: new Track(kKeptBeside), zero: sampled };
        this.#beside.set(message.device, device);
      }
      push(device.track, message, i, sampled - device.zero);
    }
  }

  #takeServer(server: ServerMessage): void {
    const before = this.#server?.devices.map((d) => d.name).join("\n");
    this.#server = server;
    if (server.devices.map((d) => d.name).join("\n") !== before) {
      this.#device.replaceChildren(...server.devices.map((d) => h("option", { value: d.number, selected: d.number === this.#watched }, d.name || `device ${d.number}`)));
      const first = server.devices[0];
      if (first && !server.devices.some((d) => d.number === this.#watched)) this.#watch(first.number);
    }
    this.#tell();
  }

  #changed(open: boolean): void {
    this.#open = open;
    this.#dirty = true;
    this.#tell();
  }

  #tell(): void {
    this.told(this.#open ? this.#server : undefined, this.#open ? (this.#server?.words ?? "asking tendon-dash") : "tendon-dash does not answer; still trying");
  }

  #watch(device: number): void {
    this.#watched = device;
    this.#zero = undefined;
    this.#reports = undefined;
    this.#track.clear();
    this.#coupling.clear();
    this.#view.clear();
    this.#setStill(undefined);
    // Discards the previous states, which had a lower rate.
    this.#beside.delete(device);
    this.#say();
  }

  #say(): void {
    const line = `watch ${this.#watched}${this.#view.space() ? " beside" : ""}`;
    if (line === this.#said) return;
    this.#said = line;
    this.#stream.say(line, true);
  }

  #following(): { from: number; to: number } {
    const length = Number(this.#window.value);
    return { from: this.#track.last - length, to: this.#track.last };
  }

  #around(): { from: number; to: number } {
    const length = Number(this.#window.value);
    const to = Math.min(this.#still!.to, this.#track.last);
    return { from: to - length, to };
  }

  #setStill(still: { from: number; to: number } | undefined): void {
    this.#still = still;
    mark(this.#pause, "aria-pressed", String(still !== undefined));
    say(this.#pause, still ? "Go on" : "Pause");
    this.#scrubber.element.hidden = still === undefined;
    this.#scrubber.repaint();
    this.#dirty = true;
  }

  stop(): void {
    this.#stopped = true;
  }

  #loop(): void {
    const frame = (now: number): void => {
      if (this.#stopped) return;
      requestAnimationFrame(frame);
      if (!this.element.isConnected) return;
      if (this.#spaceDirty && this.#view.space()) this.#drawSpace();
      if (!this.#dirty || now - this.#drawn < (this.#view.space() ? kBesideSpaceMs : kFrameMs)) return;
      this.#drawn = now;
      this.#dirty = false;
      this.#draw();
    };
    requestAnimationFrame(frame);
  }

  /** Called in every screen frame, because hand motion looks rough at 30 Hz. */
  #drawSpace(): void {
    this.#spaceDirty = false;
    const { from, to } = this.#still ?? this.#following();
    const cursor = this.#hover !== undefined && this.#still ? this.#hover : to;
    // The other devices are shown with the same age relative to their newest state as the watched one.
    const back = this.#track.last - cursor;
    const shown = (this.#server?.devices ?? []).map((d): Shown => {
      const watched = d.number === this.#watched;
      const track = watched ? this.#track : (this.#beside.get(d.number)?.track ?? kNothing);
      return { name: d.name || `device ${d.number}`, track, time: track.last - back, handle: d.handle, workspace: d.workspace_m, watched };
    });
    if (shown.length > 0) this.#view.drawSpace(shown, this.#still ? { from, to, at: cursor } : undefined);
  }

  #draw(): void {
    const { from, to } = this.#still ?? this.#following();
    const space = this.#view.space();
    const info = this.#server?.devices.find((d) => d.number === this.#watched);
    say(this.#about, info ? `${info.model}, ${count(info.loop_hz)} steps per second, at most ${digits(info.max_force_n)} N` : "");
    const cursor = this.#hover !== undefined && this.#still ? this.#hover : to;
    const facts = this.#facts();
    this.#view.draw(this.#track, from, to, cursor, this.#still ? moment(cursor) : "", facts);
    this.#coupling.draw(this.#open ? this.#server : undefined, this.#watched, from, to, cursor, !space);
    this.#arming.draw(this.#open ? this.#server : undefined, this.#watched, facts.state);
    if (this.#still) this.#scrubber.draw([this.#track], from, to);
    mark(this.element, "data-states", String(this.#track.end));
  }

  #facts(): Facts {
    const loop = this.#reports?.loop ?? undefined;
    const engines = this.#reports?.engines ?? [];
    const slowest = engines.filter((e) => e.round_trip_ms).sort((a, b) => b.round_trip_ms!.median - a.round_trip_ms!.median)[0];
    const lossiest = [...engines].sort((a, b) => lossOf(b) - lossOf(a))[0];
    const words = loop ? kSafety[loop.safety] : undefined;
    const disarmed = this.#track.end > this.#track.begin && (this.#track.reasons[this.#track.end - 1]! & kDisarmedBit) !== 0;
    const connected = this.#open && this.#server?.contact === "open";
    const holders = this.#server?.devices.find((d) => d.number === this.#watched)?.channels.filter((c) => c.holder !== "") ?? [];
    return {
      state: !connected
        ? { level: "off", name: "Not connected", meaning: this.#open ? (this.#server?.words ?? "") : "tendon-dash does not answer" }
        : loop?.fault
          ? { level: "bad", name: "Fault", meaning: loop.fault }
          : disarmed
            ? kDisarmed
            : (words ?? { level: "off", name: "Unknown", meaning: "the server has not reported the device's state" }),
      engines,
      noEngines: holders.length > 0 ? `${holders.map((c) => `${c.holder} on channel ${c.name}`).join(", ")}.` : "No engine sends forces.",
      delay: slowest
        ? { name: "Delay", value: duration(slowest.round_trip_ms!.median / 1e3), note: `${slowest.name} and back; 99\u00a0%: ${duration(slowest.round_trip_ms!.p99 / 1e3)}` }
        : { name: "Delay", value: "–", note: "no engine sends forces" },
      loss: lossiest
        ? { name: "Loss", value: `${digits(100 * lossOf(lossiest), 2)} %`, note: `of the datagrams of ${lossiest.name}` }
        : { name: "Loss", value: "–", note: "no engine sends forces" },
      lateness: {
        buckets: loop?.lateness_us_log2_total ?? [],
        what: "Since this dashboard was started",
        more: loop
          ? `In the last second ${count(loop.steps)} steps, ${count(loop.missed)} missed, ${count(loop.overruns)} too late for the control law, ${count(loop.unseen)} without a position. ${count(loop.missed_total)} missed of ${count(loop.steps_total)} since.`
          : "",
      },
      gives: !disarmed && (!loop || (loop.fault === "" && (loop.safety === "armed" || loop.safety === "unguarded"))),
      degraded: loop?.degraded ?? "",
    };
  }
}

/** Number of steps to keep of other devices: two minutes. */
const kKeptBeside = 7200;
const kNothing = new Track();

function push(track: Track, message: StatesMessage, i: number, t: number): void {
  const number = (value: number | null | undefined): number => value ?? NaN;
  const handle = handleOf(message, i);
  track.push({
    t,
    x: number(message.position_m[0][i]), y: number(message.position_m[1][i]), z: number(message.position_m[2][i]),
    wx: number(message.wanted_n[0][i]), wy: number(message.wanted_n[1][i]), wz: number(message.wanted_n[2][i]),
    ax: number(message.applied_n[0][i]), ay: number(message.applied_n[1][i]), az: number(message.applied_n[2][i]),
    permitted: number(message.permitted_n[i]), energy: number(message.energy_j[i]),
    reasons: message.reasons[i]!, mode: message.mode[i]!, age: message.force_age_ms[i]! / 1e3, late: NaN,
    ...(handle && { handle }),
  });
}

/** Returns undefined if the batch contains no data of the handle or a field. */
function handleOf(message: StatesMessage, i: number): HandleSample | undefined {
  const { orientation, torque_nm: torque, hand_force_n: hand, grip_rad: grip, grip_n: gripForce, buttons, stiffness_n_per_m: stiffness, field, field_depth_m: depth, field_proxy_m: proxy } = message;
  if (!orientation && !torque && !hand && !grip && !gripForce && !buttons && !stiffness && !field) return undefined;
  const into = noHandle();
  const number = (value: number | null | undefined): number => value ?? NaN;
  if (orientation) [into.qw, into.qx, into.qy, into.qz] = orientation.map((column) => number(column[i])) as [number, number, number, number];
  if (torque) [into.tx, into.ty, into.tz] = torque.map((column) => number(column[i])) as [number, number, number];
  if (hand) [into.hx, into.hy, into.hz] = hand.map((column) => number(column[i])) as [number, number, number];
  if (grip) into.grip = number(grip[i]);
  if (gripForce) into.gripForce = number(gripForce[i]);
  if (buttons) into.buttons = buttons[i]!;
  if (field) into.field = number(field[i]);
  if (depth) into.depth = number(depth[i]);
  if (proxy) [into.px, into.py, into.pz] = proxy.map((column) => number(column[i])) as [number, number, number];
  const contact = stiffness && contactOf(stiffness.map((column) => number(column[i])), message.wanted_n.map((column) => number(column[i])) as [number, number, number]);
  if (contact) {
    [into.nx, into.ny, into.nz] = contact.normal;
    into.gap = contact.gap;
  }
  return into;
}

const lossOf = (engine: { lost: number; received: number }): number => engine.lost / Math.max(engine.lost + engine.received, 1);
