// SPDX-License-Identifier: Apache-2.0
// Conversion of datagram bodies, with gen/codec.ts. Protobuf is only used in these two files and in fields.ts.
// Encoding trusts its input, except that texts and lists are truncated to their bounds. Decoding never throws and
// returns undefined for invalid input.
import { create, fromBinary, toBinary, type DescMessage, type MessageShape } from "@bufbuild/protobuf";
import * as gen from "./gen/codec.js";
import * as pb from "./gen/tendon_pb.js";
import * as limits from "./limits.js";
import type { Contact, Echo, Hello, PlainFrame, Refused, Request, Welcome } from "./messages.js";
import type { Nanoseconds } from "./time.js";

export type { Bye, ControlAck, Echo } from "./messages.js";

export interface Control {
  readonly id: number;
  /** Undefined if it is unknown in this version or invalid. */
  readonly request?: Request | undefined;
  /** Name of the field that is out of bounds. */
  readonly invalid?: string | undefined;
}

export type Frame = PlainFrame | { readonly kind: "control"; readonly value: Control };

export interface DataContent {
  readonly sent: Nanoseconds;
  readonly echo: Echo | undefined;
  /** In order, with all values within bounds. */
  readonly frames: readonly Frame[];
  /**
   * Number of frames and echoes with a value out of bounds. They are omitted, except requests (see Control.invalid)
   * and answers (see Code.INVALID) with a valid id.
   */
  readonly invalid: number;
}

// ---- Data. Protobuf merges concatenated messages, so a datagram can be written in pieces.

export function encodeHead(sent: Nanoseconds, echo: Echo | undefined): Uint8Array {
  const head = create(pb.DatagramSchema, { txTimeNs: sent, ...(echo && { echo: gen.writeEcho(echo) }) });
  return toBinary(pb.DatagramSchema, head);
}

/** Encodes a further piece of a Data body: one frame. */
export function encodeFrame(frame: Frame): Uint8Array {
  const body = frame.kind === "control" ? writeControl(frame.value) : gen.writeFrame(frame);
  return toBinary(pb.DatagramSchema, create(pb.DatagramSchema, { frames: [{ body }] }));
}

/** Returns undefined if the body is not protobuf, has too many frames, or does not have a valid time. */
export function decodeData(body: Uint8Array): DataContent | undefined {
  const datagram = parse(pb.DatagramSchema, body);
  if (!datagram || datagram.frames.length > limits.kMaxFrames) return undefined;
  const sent = datagram.txTimeNs;
  if (sent < -limits.kMaxTime || sent > limits.kMaxTime) return undefined;
  const frames: Frame[] = [];
  let invalid = 0;
  for (const { body } of datagram.frames) {
    if (body.case === undefined || body.case === "states") continue; // sent by a newer peer, or not requested
    const frame = body.case === "control" ? readControl(body.value) : gen.readFrame(body);
    if (!frame || (frame.kind === "control" && frame.value.invalid !== undefined)) ++invalid;
    const told = frame ?? refusedAck(body);
    if (told) frames.push(told);
  }
  const echo = datagram.echo && gen.refusedEcho(datagram.echo) === undefined ? gen.readEcho(datagram.echo) : undefined;
  if (datagram.echo && !echo) ++invalid;
  return { sent, echo, frames, invalid };
}

// Requests and answers that are out of bounds are replaced, because dropping them would block the following ones.

/** Returns undefined if the id is 0. */
function readControl({ id, op }: pb.Control): Frame | undefined {
  if (id === 0) return undefined;
  const request = gen.readRequest(op);
  return { kind: "control", value: typeof request === "string" ? { id, invalid: request } : { id, request } };
}

const writeControl = ({ id, request }: Control): pb.Frame["body"] =>
  ({ case: "control", value: create(pb.ControlSchema, { id, ...(request && { op: gen.writeRequest(request) }) }) });

/** Returns undefined for other frames, or if the id is 0. */
function refusedAck(body: pb.Frame["body"]): Frame | undefined {
  if (body.case !== "controlAck" || body.value.id === 0) return undefined;
  const detail = "a field of the answer is out of bounds";
  return { kind: "controlAck", value: { id: body.value.id, code: pb.Code.INVALID, detail } };
}

// ---- Handshake

export const encodeHelloMessage = (hello: Hello): Uint8Array => toBinary(pb.HelloSchema, gen.writeHello(hello));

export function decodeHelloMessage(bytes: Uint8Array): Hello | undefined {
  const hello = parse(pb.HelloSchema, bytes);
  return hello && gen.refusedHello(hello) === undefined ? gen.readHello(hello) : undefined;
}

export function encodeAnswerMessage(answer: Welcome | Refused): Uint8Array {
  const body: pb.Answer["body"] = "code" in answer
    ? { case: "refused", value: gen.writeRefused(answer) }
    : { case: "welcome", value: gen.writeWelcome(answer) };
  return toBinary(pb.AnswerSchema, create(pb.AnswerSchema, { body }));
}

export function decodeAnswerMessage(bytes: Uint8Array): Welcome | Refused | undefined {
  const body = parse(pb.AnswerSchema, bytes)?.body;
  switch (body?.case) {
    case "welcome":
      return gen.refusedWelcome(body.value) === undefined ? gen.readWelcome(body.value) : undefined;
    case "refused":
      return gen.refusedRefused(body.value) === undefined ? gen.readRefused(body.value) : undefined;
    default:
      return undefined;
  }
}

function parse<Schema extends DescMessage>(schema: Schema, bytes: Uint8Array): MessageShape<Schema> | undefined {
  try {
    return fromBinary(schema, bytes, { readUnknownFields: false });
  } catch {
    return undefined;
  }
}

// ---- Validation of values before sending: true if a peer accepts them

export const isContact = (contact: Contact): boolean => gen.refusedContact(gen.writeContact(contact)) === undefined;
export const isRequest = (request: Request): boolean => typeof gen.readRequest(gen.writeRequest(request)) !== "string";
