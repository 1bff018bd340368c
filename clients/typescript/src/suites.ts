// SPDX-License-Identifier: Apache-2.0
import { kHasAes } from "./aes.js";
import { CipherSuite } from "./datagram.js";

/**
 * The suites that seal, the preferred one first. The name of suite 2 is also the feature by which a client offers it and
 * a server chooses it.
 */
const kNames = [[CipherSuite.AesGcm, "aes-256-gcm"], [CipherSuite.Noise, "chacha20-poly1305"]] as const;
export const kFeatureAesGcm = kNames[0][1];

/** Those that can be spoken here: suite 2 takes Node. */
export const kUsableSuites: readonly CipherSuite[] = kNames
  .map(([suite]) => suite)
  .filter((suite) => suite !== CipherSuite.AesGcm || kHasAes);

export const namesOf = (suites: readonly CipherSuite[]): string =>
  kNames.filter(([suite]) => suites.includes(suite)).map(([, name]) => name).join(", ");
