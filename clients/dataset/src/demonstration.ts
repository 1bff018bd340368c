// SPDX-License-Identifier: Apache-2.0
// Reads the JSON lines written by tendon.demonstration of clients/python.
import { createReadStream } from "node:fs";
import { createInterface } from "node:readline";
import type { Vec3 } from "./recording.js";

/** The state of the robot when a state of the hand has arrived. */
export interface Moment {
  /** s, sampling time of the hand in the server's clock. */
  readonly t: number;
  /** "engaged", "clutched" … */
  readonly phase: string;
  /** The position of the tool in the frame of the robot, m. */
  readonly position: Vec3;
  /** m, of the tool. Undefined if the pose is held. */
  readonly target?: Vec3 | undefined;
  /** N, on the tool. Undefined if it was not measured. */
  readonly contact?: Vec3 | undefined;
}

const kKind = "tendon demonstration";
const kVersion = 1;

function vec3(name: string, value: unknown): Vec3 {
  if (Array.isArray(value) && value.length === 3 && value.every(Number.isFinite)) return value as unknown as Vec3;
  throw new Error(`${name}: expected three numbers`);
}

function momentOf(line: Record<string, unknown>): Moment {
  const { sampled_ns: sampled, phase, position_m: position, target_m: target, contact_n: contact } = line;
  if (typeof sampled !== "number") throw new Error("sampled_ns: expected a number");
  if (typeof phase !== "string") throw new Error("phase: expected a text");
  return {
    t: sampled * 1e-9,
    phase,
    position: vec3("position_m", position),
    target: target == null ? undefined : vec3("target_m", target),
    contact: contact == null ? undefined : vec3("contact_n", contact),
  };
}

/**
 * Throws an Error with the file and line if this is not a demonstration. Ignores an incomplete last line, blank lines
 * and a byte order mark.
 */
export async function readDemonstration(file: string): Promise<Moment[]> {
  const moments: Moment[] = [];
  let number = 0;
  let begun = false;
  let broken: Error | undefined;
  for await (const text of createInterface({ input: createReadStream(file) })) {
    if (broken) throw broken;
    ++number;
    const json = text.trim();  // this also removes a byte order mark
    if (json === "") continue;
    try {
      const line = JSON.parse(json) as Record<string, unknown>;
      if (!begun && (line?.["kind"] !== kKind || line["version"] !== kVersion)) {
        throw new Error(`expected {"kind":"${kKind}","version":${kVersion}}`);
      }
      if (begun && line?.["kind"] === kKind) throw new Error("expected one demonstration in a file, found a second");
      if (begun) moments.push(momentOf(line));
      begun = true;
    } catch (error) {
      broken = new Error(`${file}, line ${number}: ${error instanceof Error ? error.message : String(error)}`);
      if (!(error instanceof SyntaxError) || !begun) throw broken;
    }
  }
  if (!begun) throw new Error(`${file}: expected a demonstration, found an empty file`);
  return moments;
}
