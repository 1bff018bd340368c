// SPDX-License-Identifier: Apache-2.0
// Noise_NNpsk0_25519_ChaChaPoly_SHA256 (Noise rev. 34), for Node and browsers; WebCrypto has no ChaCha20.
import { chacha20poly1305 } from "@noble/ciphers/chacha";
import { x25519 } from "@noble/curves/ed25519";
import { hmac } from "@noble/hashes/hmac";
import { sha256 } from "@noble/hashes/sha2";
import { concat } from "./datagram.js";

export const kKeySize = 32;
const kTagSize = 16;
/** Nonce of REKEY. */
const kMaxNonce = 0xffff_ffff_ffff_ffffn;
const kName = "Noise_NNpsk0_25519_ChaChaPoly_SHA256"; // this is longer than a hash, so the hash is used
const kNothing = new Uint8Array(0);

const ascii = (text: string): Uint8Array => new TextEncoder().encode(text);

/** 4 zero bytes and the number in little-endian order. */
function nonce(number: bigint): Uint8Array {
  const bytes = new Uint8Array(12);
  new DataView(bytes.buffer).setBigUint64(4, number, true);
  return bytes;
}

/** Returns ciphertext and tag. */
export const encrypt = (key: Uint8Array, number: bigint, header: Uint8Array, plain: Uint8Array): Uint8Array =>
  chacha20poly1305(key, nonce(number), header).encrypt(plain);

/** Returns undefined if authentication fails. */
export function decrypt(key: Uint8Array, number: bigint, header: Uint8Array, sealed: Uint8Array): Uint8Array | undefined {
  if (sealed.length < kTagSize) return undefined;
  try {
    return chacha20poly1305(key, nonce(number), header).decrypt(sealed);
  } catch {
    return undefined;
  }
}

/** Returns the next key, from which `key` cannot be derived. */
export const rekey = (key: Uint8Array): Uint8Array =>
  encrypt(key, kMaxNonce, kNothing, new Uint8Array(kKeySize)).slice(0, kKeySize);

/** Identifies the key to the server without revealing it: 8 bytes. */
export const keyId = (key: Uint8Array): Uint8Array => sha256(concat(ascii("tendon-key-id"), key)).slice(0, 8);

/** The hash and key that both sides have mixed so far. An invalid message cannot change them. */
export class SymmetricState {
  private constructor(
    readonly hash: Uint8Array,
    readonly chainingKey: Uint8Array,
    /** This is empty before the first key is mixed in. */
    readonly key: Uint8Array = kNothing,
    readonly number: bigint = 0n,
  ) {}

  static begin(prologue: Uint8Array): SymmetricState {
    const hash = sha256(ascii(kName));
    return new SymmetricState(hash, hash).mixHash(prologue);
  }

  mixHash(data: Uint8Array): SymmetricState {
    return new SymmetricState(sha256(concat(this.hash, data)), this.chainingKey, this.key, this.number);
  }
  mixKey(material: Uint8Array): SymmetricState {
    const [chainingKey, key] = hkdf(this.chainingKey, material, 2);
    return new SymmetricState(this.hash, chainingKey!, key!);
  }
  mixKeyAndHash(material: Uint8Array): SymmetricState {
    const [chainingKey, hash, key] = hkdf(this.chainingKey, material, 3);
    return new SymmetricState(sha256(concat(this.hash, hash!)), chainingKey!, key!);
  }
  /** Token "e" in a pattern with a pre-shared key: hashed and mixed into the key. */
  mixEphemeral(publicKey: Uint8Array): SymmetricState {
    return this.mixHash(publicKey).mixKey(publicKey);
  }

  encrypt(plain: Uint8Array): [SymmetricState, Uint8Array] {
    const sealed = encrypt(this.key, this.number, this.hash, plain);
    return [this.#after(sealed), sealed];
  }
  decrypt(sealed: Uint8Array): [SymmetricState, Uint8Array] | undefined {
    const plain = decrypt(this.key, this.number, this.hash, sealed);
    return plain && [this.#after(sealed), plain];
  }
  /** Returns the keys of both directions, initiator → responder first. */
  split(): [Uint8Array, Uint8Array] {
    const [first, second] = hkdf(this.chainingKey, kNothing, 2);
    return [first!, second!];
  }

  #after(sealed: Uint8Array): SymmetricState {
    return new SymmetricState(sha256(concat(this.hash, sealed)), this.chainingKey, this.key, this.number + 1n);
  }
}

/** HKDF over HMAC-SHA-256 as specified by Noise. */
function hkdf(chainingKey: Uint8Array, material: Uint8Array, outputs: number): Uint8Array[] {
  const temporary = hmac(sha256, chainingKey, material);
  const out: Uint8Array[] = [];
  for (let i = 1; i <= outputs; ++i) {
    out.push(hmac(sha256, temporary, concat(out.at(-1) ?? kNothing, Uint8Array.of(i))));
  }
  return out;
}

export interface Finished {
  /** Payload of message 2. */
  readonly payload: Uint8Array;
  /** Encrypts initiator → responder. */
  readonly sendKey: Uint8Array;
  /** Decrypts responder → initiator. */
  readonly receiveKey: Uint8Array;
  /** The hash of the handshake, which is equal on both sides. */
  readonly hash: Uint8Array;
}

/** Derives the key of suite 2 for one direction, bound to Hello and Answer, and unlike all keys of suite 1. */
export const keyOfSuite2 = (key: Uint8Array, hash: Uint8Array): Uint8Array =>
  hmac(sha256, key, concat(ascii("tendon-suite-2"), hash));

/** The initiator of NNpsk0: psk, e → and ← e, ee. `secret` is the ephemeral key: 32 new random bytes for each attempt.
 */
export class Initiator {
  /** e, payload, tag. */
  readonly message1: Uint8Array;
  readonly #secret: Uint8Array;
  readonly #state: SymmetricState;

  constructor(psk: Uint8Array, prologue: Uint8Array, secret: Uint8Array, payload: Uint8Array) {
    const publicKey = x25519.getPublicKey(secret);
    const [state, sealed] = SymmetricState.begin(prologue).mixKeyAndHash(psk).mixEphemeral(publicKey).encrypt(payload);
    this.message1 = concat(publicKey, sealed);
    this.#secret = secret;
    this.#state = state;
  }

  /** Returns undefined if the sender does not know the key. In this case, nothing is changed. */
  readMessage2(message: Uint8Array): Finished | undefined {
    if (message.length < kKeySize + kTagSize) return undefined;
    const theirs = message.slice(0, kKeySize);
    let shared: Uint8Array;
    try {
      shared = x25519.getSharedSecret(this.#secret, theirs);
    } catch {
      return undefined; // a public key of low order
    }
    const opened = this.#state.mixEphemeral(theirs).mixKey(shared).decrypt(message.slice(kKeySize));
    if (!opened) return undefined;
    const [state, payload] = opened;
    const [sendKey, receiveKey] = state.split();
    return { payload, sendKey, receiveKey, hash: state.hash };
  }
}
