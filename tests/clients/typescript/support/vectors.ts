// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { kRoot } from "./paths.js";

export const readVectors = (name: string): any => JSON.parse(readFileSync(join(kRoot, "protocol/vectors", name), "utf8"));
