// SPDX-License-Identifier: Apache-2.0
import { readFileSync, statSync } from "node:fs";
import { parseKeyFile, type ClientKey } from "./key_file.js";

/**
 * The key in this file, as `tendond keygen` writes it. Throws an Error, "FILE: what is wrong": it cannot be read, it is a folder
 * or a pipe, others may read it, it is no key file, or the key is weak.
 */
export function readClientKey(file: string): ClientKey {
  try {
    const status = statSync(file);
    if (!status.isFile()) throw new RangeError("it is not a regular file"); // before it is opened: a pipe would wait for ever
    // Windows has no such bits: they are all set there.
    if (process.platform !== "win32" && (status.mode & 0o077) !== 0) {
      throw new RangeError(`others may read this key: run \`chmod 600 ${file}\``);
    }
    return parseKeyFile(readFileSync(file, "utf8"));
  } catch (error) {
    throw new Error(`${file}: ${(error as Error).message}`);
  }
}
