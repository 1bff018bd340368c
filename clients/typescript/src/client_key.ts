// SPDX-License-Identifier: Apache-2.0
import { readFileSync, statSync } from "node:fs";
import { parseKeyFile, type ClientKey } from "./key_file.js";

/**
 * Reads a key file written by `tendond keygen`. Throws an Error, "FILE: what is wrong", if the file is unreadable,
 * not a regular file, readable by other users, or malformed, or if the key is weak.
 */
export function readClientKey(file: string): ClientKey {
  try {
    const status = statSync(file);
    if (!status.isFile()) throw new RangeError("it is not a regular file"); // opening a pipe would block
    // There are no permission bits in Windows, so all of them are set.
    if (process.platform !== "win32" && (status.mode & 0o077) !== 0) {
      throw new RangeError(
        "other users can read or write this key; run `chmod 600` on it, and create a new key if others may have read it",
      );
    }
    return parseKeyFile(readFileSync(file, "utf8"));
  } catch (error) {
    throw new Error(`${file}: ${(error as Error).message}`);
  }
}
