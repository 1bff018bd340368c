// SPDX-License-Identifier: Apache-2.0
// Reads the JSON lines written by tendon.demonstration of clients/python.
import { createReadStream } from "node:fs";
import { createInterface } from "node:readline";
import type { Pose, Wrench } from "./episodes.js";
import type { Quat, Vec3 } from "./geometry.js";

/** The state of the robot when a state of the hand has arrived. */
export interface Moment {
  /** s, sampling time of the hand in the server's clock. */
  readonly t: number;
  /** "engaged", "clutched" … */
  readonly phase: string;
  /** The pose of the tool in the frame of the robot. */
  readonly pose: Pose;
  /** The requested pose. It is undefined if the pose is held. */
  readonly target?: Pose | undefined;
  /** The name of the sender of the target. */
  readonly sender: string;
  /** The contact force on the tool. It is undefined if it was not measured. */
  readonly contact?: Wrench | undefined;
}

const kKind = "tendon demonstration";
const kVersion = 1;

type Line = Record<string, unknown>;

function numbers<T>(line: Line, name: string, count: number): T {
  const value = line[name];
  if (Array.isArray(value) && value.length === count && value.every(Number.isFinite)) return value as unknown as T;
  throw new Error(`${name}: expected ${["", "one number", "", "three numbers", "four numbers"][count]}`);
}

const has = (line: Line, name: string): boolean => line[name] !== undefined && line[name] !== null;

function poseOf(line: Line, prefix: "" | "target_"): Pose {
  const grip = line[`${prefix}grip`];
  if (grip !== undefined && !Number.isFinite(grip)) throw new Error(`${prefix}grip: expected a number`);
  return {
    position: numbers<Vec3>(line, prefix === "" ? "position_m" : "target_m", 3),
    orientation: has(line, `${prefix}orientation`) ? numbers<Quat>(line, `${prefix}orientation`, 4) : undefined,
    grip: grip as number | undefined,
  };
}

function momentOf(line: Line): Moment {
  const { sampled_ns: sampled, phase, sender = "operator" } = line;
  if (typeof sampled !== "number") throw new Error("sampled_ns: expected a number");
  if (typeof phase !== "string") throw new Error("phase: expected a text");
  if (typeof sender !== "string" || sender === "") throw new Error("sender: expected a text");
  return {
    t: sampled * 1e-9,
    phase,
    pose: poseOf(line, ""),
    target: has(line, "target_m") ? poseOf(line, "target_") : undefined,
    sender,
    contact: has(line, "contact_n")
      ? { force: numbers<Vec3>(line, "contact_n", 3), torque: has(line, "contact_nm") ? numbers<Vec3>(line, "contact_nm", 3) : undefined }
      : undefined,
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
