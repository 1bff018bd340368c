// SPDX-License-Identifier: Apache-2.0
import { connect, type Guest } from "./connect.js";
import type { ClientStats } from "./config.js";
import type { Physics, Watch } from "./force_client.js";
import { Code, type LinkReport } from "./messages.js";
import type { Options } from "./options.js";
import { NoSuchHost, udp } from "./udp.js";

/** Prints one line to stderr. Escapes control characters, so that text of a server cannot start a line or move the
 * cursor. */
function say(program: string | undefined, sentence: string): void {
  const escaped = sentence.replace(/[\x00-\x1f\x7f-\x9f]/g, (c) =>
    c === "\n" ? "\\n" : c === "\t" ? "\\t" : `\\x${c.charCodeAt(0).toString(16).padStart(2, "0")}`);
  process.stderr.write(`${program ?? "tendon"}: ${escaped}\n`);
}

/** Whether further attempts are pointless. */
const isFinal = (code: Code): boolean => code !== Code.BUSY && code !== Code.SHUTDOWN;

/** Describes the state of the connection in one sentence. Empty if there is nothing to report. */
function sentence(guest: Guest, { server, key }: Options): string {
  const { phase, code, reason } = guest.stats();
  switch (phase) {
    case "open": {
      const { deviceName, loopHz, server: program } = guest.welcome!;
      return `connected to ${deviceName} at ${server} (${program}, ${loopHz} Hz)`;
    }
    case "unanswered":
      return `no answer from ${server}; is tendond running there${key ? ", and does it have this key" : ""}? Retrying`;
    case "refused":
      return `${server} refused the connection: ${reason}${isFinal(code) ? "" : "; retrying"}`;
    case "lost":
      return `lost ${server}: ${reason}; retrying`;
    case "stopped":
      return code === Code.OK ? "" : `${server} has ended the session: ${reason}`;
    case "greeting":
      return "";
  }
}

function printSummary(stats: ClientStats, seconds: number, { name, json }: Options): void {
  const { sessions, states, statesSkipped, forces, forcesUnusable, link } = stats;
  if (json) {
    const summary = {
      duration_s: seconds, sessions, states, states_skipped: statesSkipped, forces, forces_unusable: forcesUnusable,
      lost_incoming: link?.lost ?? 0, lost_outgoing: link?.lostOutgoing ?? 0,
      round_trip_ms: link?.smoothedRoundTripMs ?? 0, round_trip_variation_ms: link?.roundTripVariationMs ?? 0,
    };
    console.log(JSON.stringify({ summary }));
  } else if (!link) {
    say(name, "was never connected");
  } else {
    say(name,
      `${seconds.toFixed(1)} s, ${states} states received (${statesSkipped} skipped), ` +
      `${forces} forces sent (${forcesUnusable} more unusable), datagrams lost: ${link.lost} incoming, ` +
      `${link.lostOutgoing} outgoing, round trip ${link.smoothedRoundTripMs.toFixed(2)} ± ` +
      `${link.roundTripVariationMs.toFixed(2)} ms`);
  }
}

function printReport(report: LinkReport, { name, json }: Options): void {
  if (!json) {
    if (report.words) say(name, `report of the server: ${report.words}`);
    return;
  }
  const ms = (ns: bigint): number => Number(ns) / 1e6;
  const delays = (of: LinkReport["roundTrip"]) => of && { median: ms(of.medianNs), p99: ms(of.p99Ns) };
  console.log(JSON.stringify({
    report: {
      number: Number(report.number), forces: Number(report.forces), late_server: Number(report.lateServer),
      late_network: Number(report.lateNetwork), late_engine: Number(report.lateEngine),
      late_unknown: Number(report.lateUnknown),
      refused: {
        not_finite: Number(report.refusedNotFinite), out_of_bounds: Number(report.refusedOutOfBounds),
        unknown_tick: Number(report.refusedUnknownTick), old_sequence: Number(report.refusedOldSequence),
      },
      worst_late_ms: ms(report.worstLateNs),
      longest_gap_ms: ms(report.longestGapNs), round_trip_ms: delays(report.roundTrip), to_server_ms: delays(report.toServer),
      to_client_ms: delays(report.toClient), clock_error_ms: ms(report.clockErrorNs), received: Number(report.received),
      lost: Number(report.lost), reordered: Number(report.reordered), duplicated: Number(report.duplicated),
    },
  }));
}

/**
 * Runs a client over UDP until durationS, SIGINT or SIGTERM, then sends a Bye. Returns the exit code: 0 if a session
 * was open at least once; 1 if connecting failed, the host is unknown, the server refused permanently, or the
 * callback threw. If another controller holds the device or the server shuts down, it keeps trying. Prints one
 * sentence to stderr for each change of the connection and a warning if forces were late. stdout contains only the
 * output of the callback and, with `json`, the server's report on the received forces once per second, and the
 * summary.
 */
export async function run(
  options: Options,
  callback: { readonly physics: Physics } | { readonly watch: Watch },
): Promise<0 | 1> {
  const { name, server, durationS } = options;
  const start = performance.now();
  let refused = false;
  let said = "";
  const guest = connect(udp(server), {
    ...options,
    onPhase(changed) {
      const text = sentence(changed, options);
      if (text && text !== said) say(name, (said = text));
      if (changed.phase !== "refused" || !isFinal(changed.stats().code)) return;
      refused = true;
      changed.stop();
    },
    onReport: (report) => printReport(report, options),
    onUnusable: (why) => say(name, `a force was not sent: ${why}`),
  }, callback);

  const stop = (): void => guest.stop();
  process.once("SIGINT", stop).once("SIGTERM", stop);
  const timer = durationS > 0 ? setTimeout(stop, 1000 * durationS) : undefined;
  try {
    await guest.ended;
    if (refused) return 1;
    const stats = guest.stats();
    printSummary(stats, (performance.now() - start) / 1000, options);
    return stats.sessions > 0 ? 0 : 1;
  } catch (error) {
    if (error instanceof NoSuchHost) say(name, error.message);
    else console.error(`${name}:`, error);
    return 1;
  } finally {
    clearTimeout(timer);
    process.off("SIGINT", stop).off("SIGTERM", stop);
  }
}
