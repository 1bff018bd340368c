// SPDX-License-Identifier: Apache-2.0

export interface ChannelInfo {
  readonly name: string;
  readonly rule: string;
  readonly lease_ms: number;
  readonly holder: string;
}
/** Description of a handle. Quaternions are w, x, y, z. */
export interface HandleInfo {
  readonly operator_from_device: readonly [number, number, number, number] | null;
  readonly buttons: readonly string[];
  readonly orientation_measured: boolean;
  readonly max_torque_nm: number;
  readonly gripper_open_rad: number | null;
  readonly max_gripper_force_n: number;
  readonly group: string;
  readonly hand: "any" | "left" | "right";
}
export interface DeviceInfo {
  readonly number: number;
  readonly name: string;
  readonly model: string;
  readonly loop_hz: number;
  readonly max_force_n: number;
  readonly workspace_m: readonly [readonly [number, number, number], readonly [number, number, number]] | null;
  /** Null: not received. */
  readonly handle: HandleInfo | null;
  readonly channels: readonly ChannelInfo[];
  /** Why it cannot be armed from here now; empty: it can. */
  readonly arming_objection: string;
}
export type Order = "arm" | "disarm" | "engage" | "disengage";
export interface PressInfo {
  readonly device: number;
  readonly order: Order;
  readonly state: "under_way" | "done" | "failed";
  readonly words: string;
}
export interface ServerMessage {
  readonly type: "server";
  readonly address: string;
  readonly contact: "greeting" | "open" | "unanswered" | "refused" | "lost";
  readonly words: string;
  readonly version: string;
  readonly recordings: boolean;
  readonly arms: boolean;
  readonly press: PressInfo | null;
  readonly devices: readonly DeviceInfo[];
}
type Numbers = readonly (number | null)[];
type Triple = readonly [Numbers, Numbers, Numbers];
export interface StatesMessage {
  readonly type: "states";
  readonly device: number;
  readonly tick: readonly number[];
  readonly sampled_us: readonly number[];
  readonly position_m: Triple;
  readonly wanted_n: Triple;
  readonly applied_n: Triple;
  readonly permitted_n: readonly (number | null)[];
  readonly energy_j: readonly (number | null)[];
  readonly reasons: readonly number[];
  readonly mode: readonly number[];
  readonly force_age_ms: readonly number[];
  // Absent if no state has them: the stiffness of the engines, row-major, the handle, and the rendered field.
  readonly stiffness_n_per_m?: readonly Numbers[];
  readonly orientation?: readonly [Numbers, Numbers, Numbers, Numbers];
  readonly torque_nm?: Triple;
  readonly hand_force_n?: Triple;
  readonly grip_rad?: Numbers;
  readonly grip_n?: Numbers;
  readonly buttons?: readonly number[];
  /** The generation. */
  readonly field?: Numbers;
  readonly field_depth_m?: Numbers;
  readonly field_proxy_m?: Triple;
}
export interface Delays {
  readonly median: number;
  readonly p99: number;
}
export interface LoopReport {
  readonly span_s: number;
  readonly steps: number;
  readonly missed: number;
  readonly overruns: number;
  readonly unseen: number;
  readonly safety: string;
  readonly fault: string;
  readonly degraded: string;
  readonly lateness_us_log2: readonly number[];
  readonly lateness_us_log2_total: readonly number[];
  readonly steps_total: number;
  readonly missed_total: number;
}
export interface EngineReport {
  readonly channel: string;
  readonly name: string;
  readonly span_s: number;
  readonly forces: number;
  readonly late_server: number;
  readonly late_network: number;
  readonly late_engine: number;
  readonly late_unknown: number;
  readonly worst_late_ms: number;
  readonly longest_gap_ms: number;
  readonly round_trip_ms: Delays | null;
  readonly to_server_ms: Delays | null;
  readonly to_client_ms: Delays | null;
  readonly clock_error_ms: number;
  readonly received: number;
  readonly lost: number;
  readonly state_one_in: number;
  readonly forces_refused: boolean;
  /** N, largest error estimate of its forces; null: none. */
  readonly error_n: number | null;
  /** Method of that force; empty: unspecified. */
  readonly way: string;
  readonly words: string;
}
export interface ReportsMessage {
  readonly type: "reports";
  readonly device: number;
  readonly link: { readonly round_trip_ms: number; readonly received: number; readonly lost: number };
  readonly loop: LoopReport | null;
  readonly engines: readonly EngineReport[];
}
type Place = readonly [number, number, number];
/** One end of a coupling. Positions are relative to the offset, in the axes and scale of this end, as are forces. */
export interface PortEnd {
  readonly phase: string;
  readonly position_m: Place;
  readonly force_n: Place;
  /** Null: not measured. */
  readonly contact_n: Place | null;
  /** J of this end; null: without an account. */
  readonly account_j: number | null;
  readonly round_trip_ms: number | null;
  /** Of the detected surface. */
  readonly stiffness_n_per_m: number | null;
  readonly share: number | null;
}
export interface PortRow {
  readonly at_us: number;
  readonly role: "leader" | "follower" | null;
  readonly own: PortEnd;
  /** Null: not received. */
  readonly peer: PortEnd | null;
  readonly position_scale: number | null;
  readonly force_scale: number | null;
  /** J of the leader. */
  readonly pair_j: number | null;
}
export interface PortsMessage {
  readonly type: "ports";
  readonly device: number;
  readonly rows: readonly PortRow[];
}
export type Message = ServerMessage | StatesMessage | ReportsMessage | PortsMessage;

/** The connection to tendon-dash, which reconnects automatically. */
export class Stream {
  #socket: WebSocket | undefined;
  #wait = 250;
  #first = "";

  constructor(
    readonly receive: (message: Message) => void,
    readonly changed: (open: boolean) => void,
  ) {
    this.#open();
  }

  /** Sends a line. If `first` is true, sends it again after each reconnection. */
  say(line: string, first = false): void {
    if (first) this.#first = line;
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(line);
  }

  #open(): void {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    this.#socket = socket;
    socket.onopen = () => {
      this.#wait = 250;
      if (this.#first) socket.send(this.#first);
      this.changed(true);
    };
    socket.onmessage = ({ data }) => this.receive(JSON.parse(data as string) as Message);
    socket.onclose = () => {
      this.changed(false);
      setTimeout(() => this.#open(), this.#wait);
      this.#wait = Math.min(2 * this.#wait, 4000);
    };
  }
}
