// SPDX-License-Identifier: Apache-2.0
import { fileURLToPath } from "node:url";

/** The root of the repository, from clients/typescript/build/tests/clients/typescript/support. */
export const kRoot = fileURLToPath(new URL("../../../../../../..", import.meta.url));
