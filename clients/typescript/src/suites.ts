// SPDX-License-Identifier: Apache-2.0
import { kHasAes } from "./aes.js";
import { CipherSuite } from "./datagram.js";

/**
 * Encrypting suites in order of preference. The name of suite 2 is also the feature with which a client offers and a
 * server selects it.
 */
const kNames = [[CipherSuite.AesGcm, "aes-256-gcm"], [CipherSuite.Noise, "chacha20-poly1305"]] as const;
export const kFeatureAesGcm = kNames[0][1];

/** Suites of this runtime. Suite 2 requires Node. */
export const kUsableSuites: readonly CipherSuite[] = kNames
  .map(([suite]) => suite)
  .filter((suite) => suite !== CipherSuite.AesGcm || kHasAes);

export const namesOf = (suites: readonly CipherSuite[]): string =>
  kNames.filter(([suite]) => suites.includes(suite)).map(([, name]) => name).join(", ");
