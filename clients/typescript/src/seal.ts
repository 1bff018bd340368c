// SPDX-License-Identifier: Apache-2.0
// Protects the body of a Data datagram. There is no protection, or authenticated encryption with key renewal.
import { AesKey } from "./aes.js";
import { CipherSuite, concat, DatagramType, encodeHeader, kHeaderSize, type Header } from "./datagram.js";
import { decrypt, encrypt, rekey } from "./noise.js";
import { kSecond, type Nanoseconds } from "./time.js";

export interface Seal {
  readonly suite: CipherSuite;
  /** Number of bytes that close() adds. */
  readonly overhead: number;
  /** Returns the datagram. */
  close(now: Nanoseconds, connectionId: number, packetNumber: bigint, body: Uint8Array): Uint8Array;
  /** Returns the body, "forged" if it is not authentic, or "oldKey" if the key has expired or is too far ahead. */
  open(now: Nanoseconds, header: Header, datagram: Uint8Array): Uint8Array | "forged" | "oldKey";
}

export class PlainSeal implements Seal {
  readonly suite = CipherSuite.Plain;
  readonly overhead = 0;

  close(_now: Nanoseconds, connectionId: number, packetNumber: bigint, body: Uint8Array): Uint8Array {
    const header = { type: DatagramType.Data, epoch: 0, suite: this.suite, connectionId, packetNumber };
    return concat(encodeHeader(header), body);
  }
  open(_now: Nanoseconds, _header: Header, datagram: Uint8Array): Uint8Array {
    return datagram.subarray(kHeaderSize);
  }
}

/** A key of suite 1 that has the same interface as AesKey. */
class ChaChaKey {
  constructor(private readonly key: Uint8Array) {}

  encrypt(number: bigint, header: Uint8Array, plain: Uint8Array): Uint8Array {
    return encrypt(this.key, number, header, plain);
  }
  decrypt(number: bigint, header: Uint8Array, sealed: Uint8Array): Uint8Array | undefined {
    return decrypt(this.key, number, header, sealed);
  }
  rekey(): ChaChaKey {
    return new ChaChaKey(rekey(this.key));
  }
}

type SealingKey = ChaChaKey | AesKey;

/**
 * Suites 1 and 2: ChaCha20-Poly1305 or AES-256-GCM with the packet number as nonce and the header as associated data.
 */
export class NoiseSeal implements Seal {
  /** The sender renews its key after this number of datagrams, or after this time. */
  static readonly kRenewAfter = { datagrams: 1n << 20n, time: 600n * kSecond };
  /** After a renewal, the previous key can be used for this time. */
  static readonly kOverlap = 2n * kSecond;

  readonly overhead = 16;

  #sendKey: SealingKey;
  #sendEpoch = 0;
  #renewed: Nanoseconds;
  #closed = 0n;

  #receiveKey: SealingKey;
  #nextReceiveKey: SealingKey;
  #receiveEpoch = 0;
  #before: { readonly key: SealingKey; readonly until: Nanoseconds } | undefined;

  constructor(
    keys: { readonly sendKey: Uint8Array; readonly receiveKey: Uint8Array },
    opened: Nanoseconds,
    private readonly renewAfter: { readonly datagrams: bigint; readonly time: Nanoseconds } = NoiseSeal.kRenewAfter,
    readonly suite: CipherSuite = CipherSuite.Noise,
  ) {
    const Key = suite === CipherSuite.AesGcm ? AesKey : ChaChaKey;
    this.#sendKey = new Key(keys.sendKey);
    this.#receiveKey = new Key(keys.receiveKey);
    this.#nextReceiveKey = this.#receiveKey.rekey();
    this.#renewed = opened;
  }

  close(now: Nanoseconds, connectionId: number, packetNumber: bigint, body: Uint8Array): Uint8Array {
    if (this.#closed >= this.renewAfter.datagrams || now - this.#renewed >= this.renewAfter.time) {
      this.#sendKey = this.#sendKey.rekey();
      this.#sendEpoch = (this.#sendEpoch + 1) % 256;
      this.#renewed = now;
      this.#closed = 0n;
    }
    ++this.#closed;
    const header = encodeHeader({
      type: DatagramType.Data, epoch: this.#sendEpoch, suite: this.suite, connectionId, packetNumber,
    });
    return concat(header, this.#sendKey.encrypt(packetNumber, header, body));
  }

  open(now: Nanoseconds, header: Header, datagram: Uint8Array): Uint8Array | "forged" | "oldKey" {
    const opened = (key: SealingKey): Uint8Array | "forged" =>
      key.decrypt(header.packetNumber, datagram.subarray(0, kHeaderSize), datagram.subarray(kHeaderSize)) ?? "forged";
    switch ((header.epoch - this.#receiveEpoch + 256) % 256) {
      case 0:
        return opened(this.#receiveKey);
      case 1: {
        const body = opened(this.#nextReceiveKey);
        if (body !== "forged") {
          this.#before = { key: this.#receiveKey, until: now + NoiseSeal.kOverlap };
          this.#receiveKey = this.#nextReceiveKey;
          this.#nextReceiveKey = this.#receiveKey.rekey();
          this.#receiveEpoch = header.epoch;
        }
        return body;
      }
      case 255:
        return this.#before && now < this.#before.until ? opened(this.#before.key) : "oldKey";
      default:
        return "oldKey";
    }
  }
}
