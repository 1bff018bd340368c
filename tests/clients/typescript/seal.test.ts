// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { createCipheriv } from "node:crypto";
import { describe, it } from "node:test";
import { CipherSuite, decodeHeader } from "../../../clients/typescript/src/datagram.js";
import { ReplayWindow } from "../../../clients/typescript/src/replay_window.js";
import { NoiseSeal } from "../../../clients/typescript/src/seal.js";
import { kUsableSuites } from "../../../clients/typescript/src/suites.js";
import { kSecond, type Nanoseconds } from "../../../clients/typescript/src/time.js";
import { ascii, flipped } from "./support/bytes.js";
import { Random } from "./support/random.js";

const kId = 7;
const kBody = ascii("the hand is at x");

interface Pair {
  readonly a: NoiseSeal;
  readonly z: NoiseSeal;
}

function pairOf(suite: CipherSuite, datagrams: bigint): Pair {
  const random = new Random(4);
  const [first, second] = [random.bytes(32), random.bytes(32)];
  const renewAfter = { datagrams, time: 600n * kSecond };
  return {
    a: new NoiseSeal({ sendKey: first, receiveKey: second }, 0n, renewAfter, suite),
    z: new NoiseSeal({ sendKey: second, receiveKey: first }, 0n, renewAfter, suite),
  };
}

function open(seal: NoiseSeal, now: Nanoseconds, datagram: Uint8Array): Uint8Array | undefined {
  const header = decodeHeader(datagram);
  const body = header && seal.open(now, header, datagram);
  return typeof body === "string" ? undefined : body;
}

for (const suite of kUsableSuites) {
  const pair = (datagrams = 1n << 20n): Pair => pairOf(suite, datagrams);

  describe(`a sealed datagram of suite ${suite}`, () => {
    it("opens at the other end, and not when any one of its bits has changed", () => {
      const { a, z } = pair();
      const datagram = a.close(0n, kId, 5n, kBody);
      assert.equal(datagram.length, 16 + kBody.length + 16);
      for (let at = 0; at < datagram.length; ++at) assert.equal(open(z, 0n, flipped(datagram, at)), undefined, `byte ${at}`);
      assert.deepEqual(open(z, 0n, datagram), kBody);
      assert.equal(open(a, 0n, datagram), undefined, "sent back to its sender");
    });
  });

  describe(`keys of suite ${suite}`, () => {
    it("are renewed after 2²⁰ datagrams or 600 s, whichever comes first", () => {
      assert.deepEqual(NoiseSeal.kRenewAfter, { datagrams: 1n << 20n, time: 600n * kSecond });
      const { a } = pair(3n);
      const epochs = [0n, 1n, 2n, 3n, 4n].map((n) => decodeHeader(a.close(0n, kId, n, kBody))!.epoch);
      assert.deepEqual(epochs, [0, 0, 0, 1, 1]);
      const { z } = pair();
      assert.equal(decodeHeader(z.close(600n * kSecond - 1n, kId, 0n, kBody))!.epoch, 0);
      assert.equal(decodeHeader(z.close(600n * kSecond, kId, 1n, kBody))!.epoch, 1);
      assert.equal(decodeHeader(z.close(601n * kSecond, kId, 2n, kBody))!.epoch, 1);
    });

    it("are those of Noise's REKEY, each direction by itself", () => {
      const key = new Random(4).bytes(32);
      const { a, z } = pair(1n);
      a.close(0n, kId, 0n, kBody);
      const second = a.close(0n, kId, 1n, kBody);
      const nonce = Buffer.from("00000000ffffffffffffffff", "hex");
      const cipher = suite === CipherSuite.AesGcm
        ? createCipheriv("aes-256-gcm", key, nonce) : createCipheriv("chacha20-poly1305", key, nonce, { authTagLength: 16 });
      const next = Uint8Array.from(cipher.update(Buffer.alloc(32)));
      const renewed = new NoiseSeal({ sendKey: key, receiveKey: next }, 0n, undefined, suite);
      assert.deepEqual(renewed.open(0n, { ...decodeHeader(second)!, epoch: 0 }, second), kBody);
      assert.equal(decodeHeader(z.close(0n, kId, 0n, kBody))!.epoch, 0);
    });

    it("follow the sender through more than 256 epochs with every third lost", () => {
      const { a, z } = pair(2n);
      for (let n = 0n; n < 1200n; ++n) {
        const datagram = a.close(0n, kId, n, kBody);
        if (n % 3n !== 0n) assert.deepEqual(open(z, 0n, datagram), kBody, `number ${n}`);
      }
    });

    it("are good for 2 s after the next has been used, and no longer", () => {
      const { a, z } = pair(1n);
      const [old, late, fresh] = [a.close(0n, kId, 0n, kBody), a.close(0n, kId, 1n, kBody), a.close(0n, kId, 2n, kBody)];
      assert.ok(open(z, 0n, old));
      assert.ok(open(z, kSecond, late));
      assert.ok(open(z, 3n * kSecond - 1n, old));
      assert.equal(open(z, 3n * kSecond, old), undefined);
      assert.ok(open(z, 3n * kSecond, late));
      assert.ok(open(z, 3n * kSecond, fresh));
      assert.equal(open(z, 3n * kSecond, old), undefined, "two epochs back");
    });

    it("stay for a forged datagram of the next epoch, and for one two ahead", () => {
      const { a, z } = pair(1n);
      const [first, second, third] = [a.close(0n, kId, 0n, kBody), a.close(0n, kId, 1n, kBody), a.close(0n, kId, 2n, kBody)];
      assert.equal(open(z, 0n, flipped(second, 20)), undefined);
      assert.equal(open(z, 0n, third), undefined);
      assert.ok(open(z, 10n * kSecond, first), "still the present epoch");
      assert.ok(open(z, 10n * kSecond, second));
      assert.ok(open(z, 10n * kSecond, third));
    });
  });
}

describe("ReplayWindow", () => {
  it("agrees with a set of all inserted numbers up to 1983 behind", () => {
    for (let seed = 1; seed <= 100; ++seed) {
      const random = new Random(seed);
      const window = new ReplayWindow();
      const inserted = new Set<bigint>();
      let highest = -1n;
      for (let i = 0; i < 3000; ++i) {
        const leap = random.uniform() < 0.01 ? 5000 : 4;
        const back = random.uniform() < 0.1 ? 2100 : 40;
        const number = highest + BigInt(random.below(leap) - random.below(back)) + 1n;
        if (number < 0n) continue;
        const known = inserted.has(number) || (number <= highest && highest - number >= 1984n);
        assert.equal(window.contains(number), known, `seed ${seed}: ${number}, highest ${highest}`);
        if (known) continue;
        window.insert(number);
        inserted.add(number);
        highest = number > highest ? number : highest;
        assert.equal(window.highest, highest);
        assert.equal(window.missing, highest + 1n - BigInt(inserted.size));
        if (i % 10 === 0) {
          // An authentic but malformed datagram is not echoed, with the newest number or with an earlier one.
          for (const of of [highest, highest - BigInt(random.below(40))]) {
            let mask = 0;
            for (let bit = 0; bit < 32; ++bit) {
              if (inserted.has(of - 1n - BigInt(bit))) mask |= 1 << bit;
            }
            assert.equal(window.maskBefore(of), mask >>> 0);
          }
        }
      }
    }
  });

  it("keeps numbers far beyond 2⁵³ apart", () => {
    const window = new ReplayWindow();
    window.insert(2n ** 59n);
    assert.equal(window.contains(2n ** 59n), true);
    assert.equal(window.contains(2n ** 59n + 1n), false);
    assert.equal(window.contains(2n ** 59n - 1n), false);
  });
});
