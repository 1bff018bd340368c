// SPDX-License-Identifier: Apache-2.0
import { Role } from "./messages.js";
import { kKeySize } from "./noise.js";

export interface ClientKey {
  /** The maximum role of a client with this key. A controller may also be an observer. */
  readonly role: Role;
  readonly key: Uint8Array;
}

/**
 * In 32 random bytes there are about 30 different values. A random key has fewer than 18 with a probability of 10⁻¹¹.
 */
const kFewestDifferent = 18;
const kExpected = "expected one line, `controller` or `observer` and 64 hexadecimal digits";

/**
 * Parses a key file, which is written by `tendond keygen`. The file contains one line with `controller` or `observer`
 * and 64 hexadecimal digits. A line is ignored if it is empty or if it begins with #. Throws a RangeError with a
 * message that does not contain the key if the text is malformed or the key is weak.
 */
export function parseKeyFile(text: string): ClientKey {
  const lines = text.split("\n").map((line) => line.trim()).filter((line) => line !== "" && !line.startsWith("#"));
  if (lines.length > 1) throw new RangeError(`${kExpected}, got several lines`);
  const [word, digits, ...more] = (lines[0] ?? "").split(/[ \t]+/);
  if (digits === undefined || more.length > 0) throw new RangeError(kExpected);
  const role = word === "controller" ? Role.CONTROLLER : word === "observer" ? Role.OBSERVER : undefined;
  if (role === undefined) throw new RangeError(`${kExpected}, got a line that begins with neither`);
  if (digits.length !== 2 * kKeySize) {
    throw new RangeError(`the key is too ${digits.length < 2 * kKeySize ? "short" : "long"}: ${kExpected}`);
  }
  if (!/^[0-9a-f]*$/i.test(digits)) throw new RangeError("the key contains characters that are not hexadecimal digits");
  const key = Uint8Array.from({ length: kKeySize }, (_, i) => Number.parseInt(digits.slice(2 * i, 2 * i + 2), 16));
  const weak = weakness(key);
  if (weak) throw new RangeError(`the key is weak: ${weak}; create one with \`tendond keygen NAME\``);
  return { role, key };
}

/** Returns the reason if the key is weak, or undefined. */
function weakness(key: Uint8Array): string | undefined {
  if (new Set(key).size < kFewestDifferent) return "it repeats the same few bytes";
  const steps = new Set(Array.from(key.subarray(1), (byte, i) => (byte - key[i]!) & 0xff));
  if (steps.size < kFewestDifferent) return "its bytes follow a pattern";
  if (key.every((byte) => byte >= 0x20 && byte < 0x7f)) return "it is typed text";
  return undefined;
}
