// SPDX-License-Identifier: Apache-2.0
// The configuration and the statistics of a guest.
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
  /** For the server's log; at most 64 bytes. */
  readonly name?: string;
  /** Names of the device and its channel, on a server with several, at most 24 bytes each; empty: the first one. */
  readonly device?: string;
  readonly channel?: string;
  /**
   * When another controller holds the channel's lease: keep asking until we have it. We ask again when the server says
   * that the lease may be over.
   */
  readonly takeLease?: boolean;
  /** The 32 bytes that the server knows too: everything is encrypted, and only loopback does without. */
  readonly key?: Uint8Array | undefined;
  /** With a key: by which suites the session may be sealed; the server chooses. Default: all that this runtime has. */
  readonly suites?: readonly CipherSuite[];
  /** Calls of the callback per second, 0.001 … 100 000; 0 = one for every new state. */
  readonly rateHz?: number;
  /** States per second to ask the server for; 0 = what the server gives by itself. */
  readonly stateHz?: number;
  /**
   * How long the server may take a force as fresh, counted from its arrival; at most 10 s. 0 = derived from the period T
   * at which forces really leave, that is the asked one or, when the physics is slower, the time between the states of
   * the last two forces: max(3 T, 20 ms). Two forces in a row may be lost and the third is still in time.
   */
  readonly validForMs?: number;
  /** Forces that a hand cannot tell from the last one sent are not sent. Absent: every force is. */
  readonly deadband?: ForceDeadband | undefined;
  /**
   * The server leaves out states that we can predict. With rateHz = r the callback is called at multiples of 1/r with
   * the state predicted for that instant, tick and sampling time included. It never sees a tick twice, nor an older
   * one, and nothing is predicted for longer than maxSilenceUs. With rateHz = 0 it sees only the states that come.
   * Absent: we ask for every state.
   */
  readonly stateDeadband?: StateDeadband | undefined;
  /**
   * For an observer: ask for the forces that the engines want (DeviceState.forceWanted), and once a second for reports on
   * the device's loop and its engines. A server that does not know this feature leaves them out.
   */
  readonly diagnostics?: boolean;
  /** Ask for the joints of the device (DeviceState.joints, HandleDescription.joints): 16 bytes each in every state. */
  readonly joints?: boolean;
  /** Ask for the outputs of the device (HandleDescription.outputs: lamps, vibration), to set them with setOutput(). */
  readonly outputs?: boolean;
  /**
   * Names of the ways in which this engine answers, which Touch.way counts from 1: observers are told, and a recording
   * holds, by which a force was made. At most 8, each of 1 to 24 bytes, no two alike.
   */
  readonly ways?: readonly string[];
  /** The Hellos of one attempt go unanswered for so long before it is given up. */
  readonly patienceMs?: number;
  /** First wait before the next attempt. */
  readonly retryMinMs?: number;
  /** Longest wait before the next attempt. */
  readonly retryMaxMs?: number;
  /** Gives that many random bytes for the handshakes; by default the system's. */
  readonly random?: (size: number) => Uint8Array;
}

/**
 * greeting: an attempt is under way. open: states come in, forces go out. unanswered, refused, lost: nobody answered, the
 * server said no, the session has ended; waiting for the next attempt. stopped: for good, by stop(), by what the callback
 * threw, or because another program with the same key has taken this place.
 */
export type Phase = "greeting" | "open" | "unanswered" | "refused" | "lost" | "stopped";

export interface ClientStats {
  phase: Phase;
  /** Why the last attempt or session ended: the server's words where it had any. */
  code: Code;
  reason: string;
  /** Of the present session, or of the last one. */
  link: LinkStats | undefined;
  attempts: number;
  /** Of these, answered with a Welcome. */
  sessions: number;
  /** States that came in. */
  states: number;
  /** States that were predicted and that the callback saw. */
  statesForetold: number;
  /** States that came in and were replaced by a newer one before a callback was due. */
  statesSkipped: number;
  /** Forces sent. */
  forces: number;
  /** Forces not sent: not finite, or out of bounds. */
  forcesUnusable: number;
  /** What was wrong with the newest of them; empty: none. */
  unusable: string;
  /** What of the present session's answers is not sent, and why; empty: nothing. */
  leftOut: string;
  /** Forces not sent: a hand could not tell them from the one before. */
  forcesAlike: number;
  /** Name of the client that has taken the channel from us; empty: nobody. */
  leaseLostTo: string;
}

const kDefaults: Required<Omit<ClientConfig, "key" | "deadband" | "stateDeadband">> = {
  name: "guest", device: "", channel: "", takeLease: false, rateHz: 0, stateHz: 0, validForMs: 0, diagnostics: false,
  joints: false, outputs: false, ways: [], patienceMs: 2000, retryMinMs: 100, retryMaxMs: 2000, random: randomBytes,
  suites: kUsableSuites,
};

/** Throws a RangeError "FIELD = VALUE: expected …" when a value is impossible. */
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
    expect(full.ways.indexOf(way) === i, `ways[${i}]`, way, "no name twice");
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
