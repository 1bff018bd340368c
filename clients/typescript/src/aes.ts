// SPDX-License-Identifier: Apache-2.0
// AES-256-GCM of suite 2, which is only available in Node. WebCrypto is asynchronous, and AES in plain JavaScript leaks
// the key through timing, so pages use suite 1.
import { concat } from "./datagram.js";

/** Node 20.16 or newer; undefined elsewhere. */
const crypto = globalThis.process?.getBuiltinModule?.("node:crypto");
export const kHasAes = crypto !== undefined;

const kTagSize = 16;
const kCipher = "aes-256-gcm";
/** Nonce of REKEY. */
const kMaxNonce = 0xffff_ffff_ffff_ffffn;

/** 4 zero bytes and the number in big-endian order, unlike suite 1. */
function nonce(number: bigint): Uint8Array {
  const bytes = new Uint8Array(12);
  new DataView(bytes.buffer).setBigUint64(4, number);
  return bytes;
}

/** A key of suite 2. Requires kHasAes. */
export class AesKey {
  readonly #key;

  constructor(key: Uint8Array) {
    this.#key = crypto!.createSecretKey(key);
  }

  encrypt(number: bigint, header: Uint8Array, plain: Uint8Array): Uint8Array {
    const cipher = crypto!.createCipheriv(kCipher, this.#key, nonce(number), { authTagLength: kTagSize });
    cipher.setAAD(header);
    return concat(cipher.update(plain), cipher.final(), cipher.getAuthTag());
  }

  /** Returns undefined if authentication fails. */
  decrypt(number: bigint, header: Uint8Array, sealed: Uint8Array): Uint8Array | undefined {
    if (sealed.length < kTagSize) return undefined;
    const decipher = crypto!.createDecipheriv(kCipher, this.#key, nonce(number), { authTagLength: kTagSize });
    decipher.setAAD(header);
    decipher.setAuthTag(sealed.subarray(sealed.length - kTagSize));
    const plain = decipher.update(sealed.subarray(0, sealed.length - kTagSize));
    try {
      return concat(plain, decipher.final());
    } catch {
      return undefined;
    }
  }

  /** Returns the next key, from which this one cannot be derived. */
  rekey(): AesKey {
    return new AesKey(this.encrypt(kMaxNonce, new Uint8Array(0), new Uint8Array(32)).slice(0, 32));
  }
}
