// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { createCipheriv, createHash } from "node:crypto";
import { describe, it } from "node:test";
import { concat } from "../../../clients/typescript/src/datagram.js";
import { decrypt, encrypt, Initiator, keyId, rekey } from "../../../clients/typescript/src/noise.js";
import { ascii, flipped, fromHex, toHex } from "./support/bytes.js";
import { Random } from "./support/random.js";
import { readMessage1 } from "./support/responder.js";
import { readVectors } from "./support/vectors.js";

const [kVector] = readVectors("noise.json").vectors;
const kPsk = fromHex(kVector.init_psks[0]);
const kNothing = new Uint8Array(0);

describe("Noise_NNpsk0_25519_ChaChaPoly_SHA256", () => {
  const payload = (i: number): Uint8Array => fromHex(kVector.messages[i].payload);
  const message = (i: number): Uint8Array => fromHex(kVector.messages[i].ciphertext);
  const begin = (): Initiator =>
    new Initiator(kPsk, fromHex(kVector.init_prologue), fromHex(kVector.init_ephemeral), payload(0));

  it("reproduces the public vector's bytes as initiator and as responder", () => {
    const initiator = begin();
    assert.equal(toHex(initiator.message1), kVector.messages[0].ciphertext);
    const read = readMessage1(kPsk, fromHex(kVector.init_prologue), message(0));
    assert.deepEqual(read?.payload, payload(0));
    const responder = read!.answer(fromHex(kVector.resp_ephemeral), payload(1));
    assert.equal(toHex(responder.message2), kVector.messages[1].ciphertext);

    const finished = initiator.readMessage2(message(1));
    assert.ok(finished);
    assert.deepEqual(finished.payload, payload(1));
    assert.equal(toHex(finished.hash), kVector.handshake_hash);
    assert.equal(toHex(responder.hash), kVector.handshake_hash);
    for (const i of [2, 3, 4, 5]) {
      const number = BigInt((i - 2) >> 1);
      const key: Uint8Array = i % 2 === 0 ? finished.sendKey : finished.receiveKey;
      const theirs: Uint8Array = i % 2 === 0 ? responder.receiveKey : responder.sendKey;
      assert.equal(toHex(encrypt(key, number, kNothing, payload(i))), kVector.messages[i].ciphertext);
      assert.deepEqual(decrypt(theirs, number, kNothing, message(i)), payload(i));
    }
  });

  it("takes the true message 2 after any number of false ones", () => {
    const initiator = begin();
    for (let at = 0; at < message(1).length; ++at) {
      assert.equal(initiator.readMessage2(flipped(message(1), at)), undefined);
    }
    assert.equal(initiator.readMessage2(new Uint8Array(47)), undefined);
    assert.equal(initiator.readMessage2(new Uint8Array(63)), undefined, "a public key of low order");
    assert.ok(initiator.readMessage2(message(1)));
  });

  it("does not open with another key, prologue or ephemeral key", () => {
    const other = flipped(kPsk, 31);
    assert.equal(readMessage1(other, fromHex(kVector.init_prologue), message(0)), undefined);
    assert.equal(readMessage1(kPsk, ascii("another"), message(0)), undefined);
    const stranger = new Initiator(kPsk, fromHex(kVector.init_prologue), fromHex(kVector.resp_ephemeral), payload(0));
    assert.equal(stranger.readMessage2(message(1)), undefined);
  });
});

describe("the cipher", () => {
  it("is node:crypto's ChaCha20-Poly1305, header and number included", () => {
    const random = new Random(1);
    for (const size of [0, 1, 15, 16, 17, 64, 181, 1168]) {
      const [key, header, body] = [random.bytes(32), random.bytes(16), random.bytes(size)];
      const number = random.bits() >> 4n;
      const nonce = Buffer.alloc(12);
      nonce.writeBigUInt64LE(number, 4);
      const cipher = createCipheriv("chacha20-poly1305", key, nonce, { authTagLength: 16 });
      cipher.setAAD(header, { plaintextLength: size });
      const expected = Buffer.concat([cipher.update(body), cipher.final(), cipher.getAuthTag()]);
      assert.equal(toHex(encrypt(key, number, header, body)), toHex(expected));
      assert.deepEqual(decrypt(key, number, header, expected), body);
      assert.equal(decrypt(key, number, flipped(header, 3), expected), undefined);
      assert.equal(decrypt(key, number + 1n, header, expected), undefined);
    }
  });

  it("renews a key as Noise's REKEY", () => {
    const key = new Random(2).bytes(32);
    const nonce = Buffer.from("00000000ffffffffffffffff", "hex");
    const cipher = createCipheriv("chacha20-poly1305", key, nonce, { authTagLength: 16 });
    assert.equal(toHex(rekey(key)), cipher.update(Buffer.alloc(32)).toString("hex"));
  });

  it("names a key by the front of its hash", () => {
    const key = new Random(3).bytes(32);
    const hash = createHash("sha256").update(concat(ascii("tendon-key-id"), key)).digest();
    assert.deepEqual(keyId(key), Uint8Array.from(hash.subarray(0, 8)));
  });
});
