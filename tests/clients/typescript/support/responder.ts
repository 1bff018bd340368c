// SPDX-License-Identifier: Apache-2.0
import { x25519 } from "@noble/curves/ed25519";
import { concat } from "../../../../clients/typescript/src/datagram.js";
import { SymmetricState, type Finished } from "../../../../clients/typescript/src/noise.js";

/** The responder of NNpsk0, for tests. The client is always the initiator. */
export interface Answered extends Omit<Finished, "payload"> {
  readonly message2: Uint8Array;
}

/** Returns the payload of message 1 and a function that answers it, or undefined if it is not authentic. */
export function readMessage1(
  psk: Uint8Array,
  prologue: Uint8Array,
  message1: Uint8Array,
): { payload: Uint8Array; answer: (secret: Uint8Array, payload: Uint8Array) => Answered } | undefined {
  const theirs = message1.slice(0, 32);
  const opened = SymmetricState.begin(prologue).mixKeyAndHash(psk).mixEphemeral(theirs).decrypt(message1.slice(32));
  if (!opened) return undefined;
  const [before, payload] = opened;
  return {
    payload,
    answer(secret, reply) {
      const publicKey = x25519.getPublicKey(secret);
      const mixed = before.mixEphemeral(publicKey).mixKey(x25519.getSharedSecret(secret, theirs));
      const [state, sealed] = mixed.encrypt(reply);
      const [receiveKey, sendKey] = state.split();
      return { message2: concat(publicKey, sealed), sendKey, receiveKey, hash: state.hash };
    },
  };
}
