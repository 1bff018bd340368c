// SPDX-License-Identifier: Apache-2.0
// Checks that the client produces the bytes of protocol/vectors for every message, plain and sealed.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import { fromJson, toBinary, type JsonValue } from "@bufbuild/protobuf";
import {
  decodeAnswerMessage, decodeData, decodeHelloMessage, encodeFrame, encodeHead,
} from "../../../clients/typescript/src/codec.js";
import { AesKey, kHasAes } from "../../../clients/typescript/src/aes.js";
import {
  CipherSuite, concat, decodeHeader, decodeHello, encodeAnswer, encodeHello, encodeRetry,
} from "../../../clients/typescript/src/datagram.js";
import * as pb from "../../../clients/typescript/src/gen/tendon_pb.js";
import { ClientHandshake } from "../../../clients/typescript/src/handshake.js";
import { parseKeyFile } from "../../../clients/typescript/src/key_file.js";
import { Code, kFeatureLocalModel, Role } from "../../../clients/typescript/src/messages.js";
import { keyId, keyOfSuite2, rekey } from "../../../clients/typescript/src/noise.js";
import { ReplayWindow } from "../../../clients/typescript/src/replay_window.js";
import { NoiseSeal, PlainSeal, type Seal } from "../../../clients/typescript/src/seal.js";
import { Session } from "../../../clients/typescript/src/session.js";
import { kFeatureAesGcm } from "../../../clients/typescript/src/suites.js";
import { kSecond } from "../../../clients/typescript/src/time.js";
import { fromHex, toHex } from "./support/bytes.js";
import { readMessage1 } from "./support/responder.js";
import { readVectors } from "./support/vectors.js";

const kHello = {
  versionMin: 1, versionMax: 1, role: Role.CONTROLLER, name: "wall", features: [kFeatureLocalModel],
};

interface DataVector {
  readonly name: string;
  readonly direction: "client_to_server" | "server_to_client";
  readonly packet_number: string;
  readonly epoch?: number;
  readonly key?: string;
  readonly message: JsonValue;
  readonly body: string;
  readonly datagram: string;
}

for (const file of ["plain.json", "sealed.json", ...(kHasAes ? ["sealed_aes.json"] : [])]) {
  const vectors = readVectors(file);
  const aes: boolean = vectors.suite === 2;
  const suites = aes ? [CipherSuite.AesGcm, CipherSuite.Noise] : [CipherSuite.Noise];
  const opening: CipherSuite = vectors.suite === 0 ? CipherSuite.Plain : CipherSuite.Noise;
  const key: Uint8Array | undefined = vectors.psk && fromHex(vectors.psk);
  /** Returns the random bytes in the order in which the client draws them. */
  const random = (size: number): Uint8Array => fromHex(size === 16 ? vectors.client_random : vectors.client_ephemeral);
  const datagram = (of: { readonly datagram: string }): Uint8Array => fromHex(of.datagram);

  describe(file, () => {
    it("the client says Hello, and again with the cookie, in the very bytes", () => {
      const handshake = new ClientHandshake(kHello, key, random, 0n, suites);
      handshake.tick(0n);
      const first = toHex(handshake.nextDatagram(0n)!);
      if (vectors.hello.first_datagram) assert.equal(first, vectors.hello.first_datagram);
      handshake.receive(1n, datagram(vectors.retry));
      const again = handshake.nextDatagram(1n)!;
      assert.equal(toHex(key ? again : fromHex(first)), vectors.hello.datagram);
      if (key) assert.equal(toHex(keyId(key)), vectors.key_id);
    });

    for (const kind of ["welcome", "refused"] as const) {
      it(`the client understands ${kind}, and the server's bytes are reproduced`, () => {
        const handshake = new ClientHandshake(kHello, key, random, 0n, suites);
        handshake.receive(1n, datagram(vectors[kind]));
        assert.equal(handshake.outcome?.kind, kind === "welcome" ? "accepted" : "refused");
        if (handshake.outcome?.kind === "accepted") {
          assert.equal(handshake.outcome.connectionId, vectors.connection_id);
          assert.equal(handshake.outcome.welcome.deviceName, "simulated");
        } else {
          assert.equal(handshake.outcome!.refused.detail, "one controller");
        }
        const connectionId = kind === "welcome" ? vectors.connection_id : 0;
        const payload = toBinary(pb.AnswerSchema, fromJson(pb.AnswerSchema, vectors[kind].message));
        assert.equal(toHex(payload), vectors[kind].body);
        let content: Uint8Array = payload;
        if (key) {
          const read = readMessage1(key, fromHex(vectors.hello.prologue), fromHex(vectors.hello.noise_message));
          const features = aes ? [...kHello.features, kFeatureAesGcm] : kHello.features;
          assert.deepEqual(decodeHelloMessage(read!.payload), { ...kHello, features });
          const answered = read!.answer(fromHex(vectors[kind].server_ephemeral), payload);
          assert.equal(toHex(answered.hash), vectors[kind].handshake_hash);
          const sealing = (key: Uint8Array): string => toHex(aes ? keyOfSuite2(key, answered.hash) : key);
          assert.equal(sealing(answered.receiveKey), vectors[kind].client_to_server_key);
          assert.equal(sealing(answered.sendKey), vectors[kind].server_to_client_key);
          content = answered.message2;
        }
        const answer = { suite: opening, connectionId, random: fromHex(vectors.client_random), content };
        assert.equal(toHex(encodeAnswer(answer)), vectors[kind].datagram);
      });
    }

    it("retry and hello are reproduced", () => {
      const random16 = fromHex(vectors.client_random);
      const retry = encodeRetry({ suite: opening, random: random16, cookie: fromHex(vectors.cookie) });
      assert.equal(toHex(retry), vectors.retry.datagram);
      assert.equal(toHex(encodeHello(decodeHello(datagram(vectors.hello))!)), vectors.hello.datagram);
    });

    for (const vector of vectors.data as DataVector[]) {
      it(`${vector.name}: closed and opened byte for byte`, () => {
        const body = toBinary(pb.DatagramSchema, fromJson(pb.DatagramSchema, vector.message));
        assert.equal(toHex(body), vector.body);
        const content = decodeData(body)!;
        assert.equal(content.invalid, 0);
        assert.equal(toHex(concat(encodeHead(content.sent, content.echo), ...content.frames.map(encodeFrame))), vector.body);

        const sealed = datagram(vector);
        const header = decodeHeader(sealed)!;
        assert.equal(header.packetNumber, BigInt(vector.packet_number));
        const [close, open] = seals(vector);
        assert.equal(toHex(close.close(0n, vectors.connection_id, header.packetNumber, body)), vector.datagram);
        assert.deepEqual(open.open(0n, header, sealed), body);
      });
    }

    /** Returns the seal that is used to close the datagram of the vector, and the one that is used to open it. */
    function seals(vector: DataVector): [Seal, Seal] {
      if (!key) return [new PlainSeal(), new PlainSeal()];
      const first = fromHex(vectors.welcome[`${vector.direction}_key`]);
      if (!aes) assert.equal(toHex(vector.epoch === 1 ? rekey(first) : first), vector.key);
      const renewAfter = { datagrams: 1n, time: 600n * kSecond };
      const closing = new NoiseSeal({ sendKey: first, receiveKey: first }, 0n, renewAfter, vectors.suite);
      if (vector.epoch === 1) closing.close(0n, 1, 0n, new Uint8Array(0));
      return [closing, new NoiseSeal({ sendKey: first, receiveKey: first }, 0n, undefined, vectors.suite)];
    }

    for (const dropped of vectors.dropped ?? []) {
      it(`${dropped.name}: is dropped and counted as ${dropped.counter}`, () => {
        const { client_to_server_key, server_to_client_key } = vectors.welcome;
        const keys = { sendKey: fromHex(client_to_server_key), receiveKey: fromHex(server_to_client_key) };
        const seal = new NoiseSeal(keys, 0n, undefined, vectors.suite);
        const session = new Session({ connectionId: vectors.connection_id, seal }, 0n);
        session.receive(0n, datagram(dropped));
        const { received, duplicated, malformed, forged, oldKey } = session.stats;
        const expected = { received: 0, duplicated: 0, malformed: 0, forged: 0, oldKey: 0 };
        expected[dropped.counter === "old_key" ? "oldKey" : (dropped.counter as "forged" | "malformed")] = 1;
        assert.deepEqual({ received, duplicated, malformed, forged, oldKey }, expected);
        assert.equal(session.nextEvent(), undefined);
      });
    }
  });
}

describe("primitives.json", () => {
  for (const vector of readVectors("primitives.json").aes256_gcm) {
    const nonce = fromHex(vector.nonce);
    const asInNoise = nonce.subarray(0, 4).every((byte) => byte === 0);
    it(vector.source, { skip: !kHasAes || !asInNoise }, () => {
      const number = new DataView(nonce.buffer, nonce.byteOffset).getBigUint64(4);
      const key = new AesKey(fromHex(vector.key));
      const header = fromHex(vector.associated_data);
      assert.equal(toHex(key.encrypt(number, header, fromHex(vector.text))), vector.sealed);
      assert.equal(toHex(key.decrypt(number, header, fromHex(vector.sealed))!), vector.text);
    });
  }
});

describe("replay.json", () => {
  for (const { name, packet_numbers, accept } of readVectors("replay.json").scripts) {
    it(name, () => {
      const window = new ReplayWindow();
      const accepted = packet_numbers.map((number: number) => {
        if (window.contains(BigInt(number))) return false;
        window.insert(BigInt(number));
        return true;
      });
      assert.deepEqual(accepted, accept);
    });
  }
});

describe("key_files.json", () => {
  for (const { name, text, accept, role, key, key_id } of readVectors("key_files.json").files) {
    it(`${accept ? "accepted" : "refused"}: ${name}`, () => {
      if (accept) {
        const read = parseKeyFile(text);
        assert.equal(toHex(read.key), key);
        assert.equal(toHex(keyId(read.key)), key_id);
        assert.equal(read.role, role === "controller" ? Role.CONTROLLER : Role.OBSERVER);
      } else {
        assert.throws(() => parseKeyFile(text), (error: Error) => {
          assert.ok(error instanceof RangeError);
          for (const word of text.split(/\s+/)) assert.ok(word.length < 40 || !error.message.includes(word), "tells the key");
          return true;
        });
      }
    });
  }
});

describe("bounds.json", () => {
  /** Returns whether the codec accepts all values in the body. */
  const isTaken = ({ message, body }: { readonly message: string; readonly body: string }): boolean => {
    const bytes = fromHex(body);
    if (message === "Hello") return decodeHelloMessage(bytes) !== undefined;
    if (message === "Answer") return decodeAnswerMessage(bytes) !== undefined;
    return decodeData(bytes)?.invalid === 0;
  };

  it("the bounds of tendon.proto are those of the codec", () => {
    // This client never requests states that are encoded in columns.
    const bounds = readVectors("bounds.json").bounds.filter((vector: any) => !vector.field.startsWith("DeviceStates."));
    assert.ok(bounds.length > 300);
    const wrong = bounds.filter((vector: any) => isTaken(vector) !== vector.accepted);
    assert.deepEqual(wrong.map((vector: any) => `${vector.field} ${vector.value}`), []);
  });

  it("a request out of bounds names its field, and an answer is refused", () => {
    const requests = new Set<string>();
    const lists = new Map([["FieldMaterial", "materials"], ["FieldFixture", "fixtures"], ["FieldDepthTable", "tables"]]);
    for (const { message, field, body } of readVectors("bounds.json").bounds) {
      const isFrame = message === "Datagram" && !field.startsWith("Datagram.");
      const content = isFrame ? decodeData(fromHex(body)) : undefined;
      const [frame] = content?.invalid ? content.frames : [];
      if (frame?.kind === "control") {
        const [of, ...rest] = field.split(".");
        requests.add(of);
        const invalid = rest[0] === "rotation" ? "rotation" : rest.join(".");
        assert.equal(frame.value.invalid, lists.get(of) ?? invalid, field);
        assert.equal(frame.value.request, undefined, field);
      } else if (frame) {
        assert.equal(frame.kind, "controlAck", field);
        assert.deepEqual([frame.value.code, frame.value.device, frame.value.handle], [Code.INVALID, undefined, undefined], field);
      }
    }
    assert.equal(requests.size, 20);
  });
});
