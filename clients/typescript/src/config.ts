// SPDX-License-Identifier: Apache-2.0
// Configuration and statistics of a client.
import { randomBytes } from "@noble/hashes/utils";
import { checkForceDeadband, checkStateDeadband, type ForceDeadband } from "./deadband.js";
import type { CipherSuite } from "./datagram.js";
import { expect } from "./expect.js";
import { kMaxLabel, kMaxLoopHz, kMaxName, kMaxValidForMs, kMaxWays } from "./limits.js";
import type { Code, StateDeadband } from "./messages.js";
import { kKeySize } from "./noise.js";
import type { LinkStats } from "./session.js";
import { kUsableSuites, namesOf } from "./suites.js";

export interface ClientConfig {
  /** This name is used in the log of the server. It has at most 64 bytes. */
  readonly name?: string;
  /** The device and its channel, with names of at most 24 bytes. Empty: the first one of the server. */
  readonly device?: string;
  readonly channel?: string;
  /**
   * If another controller has the lease of the channel, this client keeps asking for it. It sends the request again
   * when the server reports that the lease may have ended.
   */
  readonly takeLease?: boolean;
  /** 32 bytes shared with the server for encryption. Without a key, only loopback is accepted. */
  readonly key?: Uint8Array | undefined;
  /** Cipher suites offered for an encrypted session. The server selects one. Default: all suites of this runtime. */
  readonly suites?: readonly CipherSuite[];
  /** How often the callback is called per second, 0.001 … 100 000. If it is 0, it is called for each new state. */
  readonly rateHz?: number;
  /** The number of states per second that the server should send. 0: the default of the server. */
  readonly stateHz?: number;
  /**
   * How long after its arrival the server may use a force; at most 10 s. 0: max(3 T, 20 ms) with the period T between
   * forces, which is the requested period or, if the engine is slower, the time between the states that the last two
   * forces answer. 3 T tolerates the loss of two consecutive forces.
   */
  readonly validForMs?: number;
  /** Omit forces that a human cannot distinguish from the last one sent. Absent: every force is sent. */
  readonly deadband?: ForceDeadband | undefined;
  /**
   * The server omits states that can be predicted by the client. If rateHz = r > 0, the callback runs at multiples of
   * 1/r with the state predicted for that time, including tick and sampling time. Ticks always increase. A state is not
   * predicted for longer than maxSilenceUs. If rateHz = 0, the callback receives only received states. Absent: all
   * states are requested.
   */
  readonly stateDeadband?: StateDeadband | undefined;
  /**
   * For observers: requests the forces of the engines before limiting (DeviceState.forceWanted), and reports on the
   * loop of the device and its engines once per second. Servers that do not support this feature omit them.
   */
  readonly diagnostics?: boolean;
  /** Requests the joints of the device (DeviceState.joints, HandleDescription.joints): 16 bytes per joint and state. */
  readonly joints?: boolean;
  /** Requests access to the outputs of the device (HandleDescription.outputs: lamps, vibration), for setOutput(). */
  readonly outputs?: boolean;
  /** Requests that the server can render a field (use, pose, truth). */
  readonly fields?: boolean;
  /**
   * The names of the methods that are used by this engine to compute forces. Touch.way is an index into this list,
   * starting at 1. Observers and recordings receive the names. There can be at most 8 different names, and each of them
   * has 1 to 24 bytes.
   */
  readonly ways?: readonly string[];
  /** The time to wait for an answer in an attempt. */
  readonly patienceMs?: number;
  /** The time to wait before the first retry. It is doubled after each attempt. */
  readonly retryMinMs?: number;
  readonly retryMaxMs?: number;
  /** Returns random bytes for the handshakes. Default: those of the system. */
  readonly random?: (size: number) => Uint8Array;
}

/**
 * greeting: waiting for an answer to the handshake. open: session open. unanswered, refused, lost: waiting for the
 * next attempt because the server did not answer, refused the client, or the session ended. stopped: final, after
 * stop(), an exception of the callback, or replacement by another program with the same key.
 */
export type Phase = "greeting" | "open" | "unanswered" | "refused" | "lost" | "stopped";

export interface ClientStats {
  phase: Phase;
  /** The reason for the end of the last attempt or session, and the message of the server if there is one. */
  code: Code;
  reason: string;
  /** The statistics of the current session or the last one. */
  link: LinkStats | undefined;
  attempts: number;
  /** The number of attempts that were accepted by the server. */
  sessions: number;
  states: number;
  /** The number of predicted states that were passed to the callback. */
  statesPredicted: number;
  /** The number of received states that were replaced by a newer one before the callback was called. */
  statesSkipped: number;
  forces: number;
  /** The number of forces that were not sent because they are not finite or out of bounds. */
  forcesUnusable: number;
  /** The reason for the newest force that was unusable. Empty if there is none. */
  unusable: string;
  /** The part of the forces that was omitted, and the reason. Empty if there is none. */
  leftOut: string;
  /** The number of forces that were not sent because they are within the deadband. */
  forcesAlike: number;
  /** The client that has taken over this channel. Empty if there is none. */
  leaseLostTo: string;
}

const kDefaults: Required<Omit<ClientConfig, "key" | "deadband" | "stateDeadband">> = {
  name: "guest", device: "", channel: "", takeLease: false, rateHz: 0, stateHz: 0, validForMs: 0, diagnostics: false,
  joints: false, outputs: false, fields: false, ways: [], patienceMs: 2000, retryMinMs: 100, retryMaxMs: 2000, random: randomBytes,
  suites: kUsableSuites,
};

/** Throws a RangeError "FIELD = VALUE: expected …" if a value is invalid. */
export function checked(config: ClientConfig): Required<ClientConfig> {
  const given = Object.fromEntries(Object.entries(config).filter(([, value]) => value !== undefined));
  const full: Required<ClientConfig> = {
    key: undefined, deadband: undefined, stateDeadband: undefined, ...kDefaults, ...given,
  };
  const expectAtMost = (most: number, text: string, field: string): void => {
    const size = new TextEncoder().encode(text).length;
    expect(size <= most, `${field}.size`, size, `at most ${most} bytes`);
  };
  const { key, rateHz, stateHz, validForMs, patienceMs, retryMinMs, retryMaxMs } = full;
  expectAtMost(kMaxName, full.name, "name");
  expectAtMost(kMaxLabel, full.device, "device");
  expectAtMost(kMaxLabel, full.channel, "channel");
  expect(full.ways.length <= kMaxWays, "ways.size", full.ways.length, `at most ${kMaxWays} names`);
  for (const [i, way] of full.ways.entries()) {
    expect(way !== "", `ways[${i}].size`, 0, "at least 1 byte");
    expectAtMost(kMaxLabel, way, `ways[${i}]`);
    expect(full.ways.indexOf(way) === i, `ways[${i}]`, way, "unique names");
  }
  expect(!key || key.length === kKeySize, "key.size", key?.length, `${kKeySize} bytes`);
  const usable = full.suites.length > 0 && full.suites.every((suite) => kUsableSuites.includes(suite));
  expect(usable, "suites", `[${full.suites.join(", ")}]`, `numbers of some of ${namesOf(kUsableSuites)}`);
  expect(rateHz === 0 || (rateHz >= 1e-3 && rateHz <= 1e5), "rateHz", rateHz, "0, or 0.001 to 100000");
  expect(Number.isInteger(stateHz) && stateHz >= 0 && stateHz <= kMaxLoopHz, "stateHz", stateHz,
    `a whole number from 0 to ${kMaxLoopHz}`);
  expect(validForMs >= 0 && validForMs <= kMaxValidForMs, "validForMs", validForMs, `0 to ${kMaxValidForMs}`);
  if (full.deadband) checkForceDeadband(full.deadband);
  if (full.stateDeadband) checkStateDeadband(full.stateDeadband);
  expect(patienceMs > 0, "patienceMs", patienceMs, "more than 0");
  expect(retryMinMs > 0, "retryMinMs", retryMinMs, "more than 0");
  expect(retryMaxMs >= retryMinMs, "retryMaxMs", retryMaxMs, "at least retryMinMs");
  return full;
}
