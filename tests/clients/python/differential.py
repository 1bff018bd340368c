#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Passes the same random and damaged datagrams to the decoders in C++ (tests/fuzz/decode_lines) and in Python, and
compares the results bit by bit. The exit code is 0 if they are equal. Otherwise it is 1, and the first datagrams that
differ are printed."""

from __future__ import annotations

import argparse
import json
import random
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from conftest import ROOT
from golden import PAGE, golden_datagrams

from tendon import codec, limits
from tendon import tendon_pb2 as pb
from tendon.codec import DatagramType, Suite
from tendon.messages import (
    Bye,
    Control,
    ControlAck,
    Couple,
    DeviceReport,
    DeviceState,
    Disarm,
    Disengage,
    DropField,
    Engage,
    FieldBrick,
    FieldPose,
    FieldStatus,
    ForceCommand,
    Frame,
    LampColour,
    LinkReport,
    Mat3,
    OfferField,
    PeerReport,
    PortGrip,
    PortState,
    PortSurface,
    PortTurn,
    Rearm,
    Refused,
    SetOutput,
    SetScale,
    SetShare,
    SetStateDeadband,
    SetStateRate,
    UseField,
    Vec3,
    Welcome,
)

# ---- The result of the Python decoder in the format of decode_lines ----


def _double(number: float) -> str:
    return struct.pack(">d", number).hex()


def _vector(vector: Vec3) -> list[object]:
    return [_double(component) for component in vector]


def _text(text: str) -> str:
    return "x" + text.encode().hex()


def _bytes(value: bytes) -> str:
    return "x" + value.hex()


def _report(report: LinkReport) -> list[object]:
    words: list[object] = ["report", report.number, report.until_ns, report.span_ns, report.forces]
    words += [report.late_server, report.late_network, report.late_engine, report.worst_late_ns, report.longest_gap_ns]
    for delays in (report.round_trip, report.to_server, report.to_client):
        words += ["-"] if delays is None else ["measured", delays.median_ns, delays.p99_ns]
    words += [report.clock_offset_ns, _double(report.clock_drift_ppm), report.clock_error_ns]
    words += [report.received, report.lost, report.reordered, report.duplicated, _text(report.words)]
    words += [report.late_unknown, report.refused_not_finite, report.refused_out_of_bounds]
    words += [report.refused_unknown_tick, report.refused_old_sequence]
    return words


def _matrix(matrix: Mat3) -> list[object]:
    return [_double(entry + 0.0) for row in matrix for entry in row]  # −0 becomes 0: k · 0 may have either sign


def _handle_of(state: DeviceState) -> list[object]:
    words: list[object] = []
    if state.turning is not None:
        words += ["turning", *map(_double, state.turning.orientation), *_vector(state.turning.angular_velocity)]
    if state.torque_applied is not None:
        words += ["torque", *_vector(state.torque_applied)]
    if state.grip is not None:
        words += ["grip", _double(state.grip.opening), _double(state.grip.velocity)]
    if state.grip_applied is not None:
        words += ["grip-force", _double(state.grip_applied)]
    if state.hand_force is not None:
        words += ["hand", *_vector(state.hand_force)]
    if state.joints is not None:
        words += ["joints", len(state.joints.angles)]
        for angle, velocity in zip(state.joints.angles, state.joints.velocities):
            words += [_double(angle), _double(velocity)]
    if state.field is not None:
        words += ["field", state.field.generation, _double(state.field.depth), *_vector(state.field.proxy)]
    return words


def _frame(frame: Frame) -> list[object]:
    if isinstance(frame, DeviceState):
        return [
            *("state", frame.tick, frame.sampled_ns),
            *(*_vector(frame.position), *_vector(frame.velocity), *_vector(frame.force_applied)),
            *(_double(frame.energy), _double(frame.permitted_force)),
            *(frame.reasons, frame.force_sequence, frame.force_age_ns, int(frame.mode)),
            *([] if frame.force_wanted is None else ["wanted", *_vector(frame.force_wanted)]),
            *([] if frame.stiffness_wanted is None else ["stiffness", *_matrix(frame.stiffness_wanted)]),
            *(["buttons", frame.buttons] if frame.buttons else []),
            *_handle_of(frame),
        ]
    if isinstance(frame, ForceCommand):
        words: list[object] = ["force", frame.sequence, frame.based_on_tick, *_vector(frame.force)]
        words.append(frame.valid_for_us * 1000)
        if frame.model is not None:
            words += ["model", *_vector(frame.model.at), *_matrix(frame.model.stiffness)]
            words.append(_double(frame.model.valid_radius))
            if frame.model.contact is not None:
                words += ["contact", *_vector(frame.model.contact.normal), _double(frame.model.contact.gap)]
                table = frame.model.contact.table
                if table is not None:
                    words += ["table", *map(_double, (table.first, table.step, *table.force))]
        if frame.topology_changed:
            words.append("changed")
        if frame.error is not None:
            words += ["error", _double(frame.error)]
        if frame.torque is not None:
            words += ["torque", *_vector(frame.torque.torque)]
            model = frame.torque.model
            words += [] if model is None else ["model", *map(_double, model.at), *_matrix(model.stiffness)]
        if frame.grip_force is not None:
            words += ["grip-force", _double(frame.grip_force)]
        if frame.way:
            words += ["way", frame.way]
        if frame.field:
            words += ["field", frame.field]
        return words
    if isinstance(frame, Control):
        if frame.request is None:
            return ["control", frame.id, *(["refused", frame.invalid] if frame.invalid else ["unknown"])]
        if isinstance(frame.request, SetStateRate):
            return ["control", frame.id, "rate", frame.request.hz]
        if isinstance(frame.request, SetStateDeadband):
            asked = frame.request
            words = ["control", frame.id, "deadband", _double(asked.share), _double(asked.floor)]
            return [*words, asked.max_silence_us * 1000]
        if isinstance(frame.request, Couple):
            c = frame.request
            return [
                *("control", frame.id, "couple", c.device, c.channel, int(c.role) - 1, int(c.method)),
                *map(_double, (c.position_scale, c.force_scale, *c.rotation)),
                *(c.axes, *map(_double, (c.stiffness, c.mutual_damping, c.damping))),
                *(int(c.adapt_to_delay), int(c.purse), c.period_us * 1000, int(c.absolute)),
                *map(_double, (c.turn_stiffness, c.turn_damping, c.grip_stiffness, c.grip_damping, c.drift_rate)),
                *([] if c.rate is None else ["rate", *map(_double, (c.rate.dead_zone, c.rate.gain, c.rate.max_speed))]),
            ]
        if isinstance(frame.request, SetScale):
            scales = frame.request
            doubles = map(_double, (scales.position_scale, scales.force_scale))
            return ["control", frame.id, "scale", scales.device, *doubles]
        if isinstance(frame.request, SetShare):
            of = frame.request
            return ["control", frame.id, "share", of.device, of.channel, _double(of.share)]
        if isinstance(frame.request, (Engage, Disengage)):
            return ["control", frame.id, type(frame.request).__name__.lower(), frame.request.device]
        if isinstance(frame.request, OfferField):
            offer = frame.request
            return ["control", frame.id, "offer-field", _bytes(offer.field), offer.size, offer.offset, _bytes(offer.part)]
        if isinstance(frame.request, UseField):
            return ["control", frame.id, *_use_field(frame.request)]
        if isinstance(frame.request, DropField):
            return ["control", frame.id, "drop-field", _bytes(frame.request.field)]
        if isinstance(frame.request, SetOutput):
            wanted = frame.request
            words = ["control", frame.id, "output", wanted.device, wanted.output]
            if isinstance(wanted.setting, LampColour):
                return [*words, "rgb", wanted.setting.rgb]
            pulse = wanted.setting
            doubles = map(_double, (pulse.amplitude, pulse.frequency))
            return [*words, "vibration", *doubles, pulse.duration_ms * 1_000_000]
        return ["control", frame.id, {Rearm: "rearm", Disarm: "disarm"}.get(type(frame.request), "other")]
    if isinstance(frame, ControlAck):
        words = ["ack", frame.id, int(frame.code), _text(frame.detail)]
        if frame.handle is not None:
            axes = frame.handle.operator_from_device
            words += ["handle"] if axes is None else ["handle", "axes", *map(_double, axes)]
            words += [len(frame.handle.buttons), *map(_text, frame.handle.buttons)]
            words += [len(frame.handle.joints), *map(_text, frame.handle.joints)]
            for output in frame.handle.outputs:
                words += ["output", int(output.kind), _text(output.name)]
            words += [int(frame.handle.orientation_measured), _double(frame.handle.max_torque)]
            opens = frame.handle.gripper_open
            words += [] if opens is None else ["gripper", _double(opens)]
            words.append(_double(frame.handle.max_gripper_force))
            words += [_text(frame.handle.group), int(frame.handle.hand)]
        return words
    if isinstance(frame, LinkReport):
        return _report(frame)
    if isinstance(frame, DeviceReport):
        return [
            *("device", frame.number, frame.until_ns, frame.span_ns, frame.device, frame.steps),
            *(frame.missed, frame.overruns, frame.unseen),
            *(*frame.lateness, *[0] * (limits.LATENESS_BUCKETS - len(frame.lateness))),
            *(int(frame.safety), _text(frame.fault), _text(frame.degraded)),
        ]
    if isinstance(frame, PeerReport):
        return [
            *("peer", frame.device, frame.channel, _text(frame.name), frame.state_one_in, int(frame.forces_refused)),
            *_report(frame.link),
            *([] if frame.error is None else ["error", _double(frame.error)]),
            _text(frame.way),
        ]
    if isinstance(frame, PortState):
        return [
            *("port", frame.device, frame.channel, frame.epoch, frame.sequence, frame.answers_epoch, frame.answers),
            *(frame.time_ns, frame.round_trip_ns, int(frame.phase), frame.engagement, frame.buttons),
            *(*_vector(frame.position), *_vector(frame.velocity), *_vector(frame.force)),
            *([] if frame.contact_force is None else ["contact", *_vector(frame.contact_force)]),
            *map(_double, (frame.account, frame.need, frame.given, frame.taken)),
            *(*_vector(frame.wave_integral), _double(frame.wave_energy)),
            *_surface(frame.surface),
            *_turn(frame.turn),
            *_grip(frame.grip),
            _double(frame.energy_in),
            *([] if frame.share is None else ["share", _double(frame.share)]),
            *(_double(frame.position_scale), _double(frame.force_scale), int(frame.of_peer)),
        ]
    if isinstance(frame, FieldBrick):
        return ["brick", _bytes(frame.hash), _bytes(frame.weights)]
    if isinstance(frame, FieldStatus):
        return ["field-status", _bytes(frame.field), _bytes(frame.missing.ljust(128, b"\0"))]
    if isinstance(frame, FieldPose):
        return [
            *("pose", frame.device, frame.channel, frame.sequence, frame.time_ns, *_vector(frame.position)),
            *map(_double, frame.orientation),
            *(*_vector(frame.velocity), *_vector(frame.angular_velocity)),
        ]
    assert isinstance(frame, Bye)
    return ["bye", int(frame.code), _text(frame.reason)]


def _use_field(use: UseField) -> list[object]:
    words: list[object] = ["use-field", use.device, use.channel, use.generation, _bytes(use.field)]
    for one in use.materials:
        words += ["material", *map(_double, (one.stiffness, one.branch_stiffness, one.relaxation, one.friction))]
    for fixture in use.fixtures:
        words += ["fixture", int(fixture.kind), *_vector(fixture.at), *_vector(fixture.normal)]
        words += [_double(fixture.stiffness)]
        words += [] if fixture.most_force is None else [_double(fixture.most_force)]
    for table in use.tables:
        words += ["table", table.material, _double(table.step), *map(_double, table.force)]
    return words


def _surface(surface: PortSurface | None) -> list[object]:
    if surface is None:
        return []
    return ["surface", *_vector(surface.normal), _double(surface.offset), _double(surface.stiffness)]


def _turn(turn: PortTurn | None) -> list[object]:
    if turn is None:
        return []
    return ["turn", *map(_double, turn.turn), *_vector(turn.angular_velocity), *_vector(turn.torque)]


def _grip(grip: PortGrip | None) -> list[object]:
    if grip is None:
        return []
    values = (grip.opening, grip.velocity, grip.force, grip.account, grip.need, grip.given, grip.taken)
    return ["grip", *map(_double, values)]


def _data(body: bytes) -> list[object]:
    content = codec.read_data(body)
    if content is None:
        return ["-"]
    words: list[object] = [content.sent_ns]
    if content.echo is not None:
        echo = content.echo
        words += ["echo", echo.sent_ns, echo.received_ns, echo.packet_number, echo.received_mask]
    for frame in content.frames:
        words += _frame(frame)
    return [*words, "invalid", content.invalid]


def _answer(body: bytes) -> list[object]:
    said = codec.read_answer(body)
    if isinstance(said, Refused):
        return ["refused", int(said.code), _text(said.detail), said.version_min, said.version_max]
    if isinstance(said, Welcome):
        return [
            *("welcome", said.version, len(said.features), *map(_text, said.features), int(said.role)),
            *(_text(said.device_name), _double(said.max_force), _double(said.position_resolution)),
            *(said.loop_hz, said.timeout_ms * 1_000_000, _text(said.server)),
        ]
    return []


def _hello(body: bytes) -> list[object]:
    said = codec.read_hello(body)
    if said is None:
        return []
    features = [len(said.features), *map(_text, said.features)]
    return [said.version_min, said.version_max, int(said.role), _text(said.name), *features]


def verdict(datagram: bytes) -> str:
    header = codec.decode_header(datagram)
    if header is None:
        return "-"
    words: list[object] = [int(header.type), int(header.suite), header.epoch, header.connection_id, header.packet_number]
    plain = header.suite is Suite.PLAIN
    if header.type is DatagramType.DATA:
        words += _data(datagram[codec.HEADER_SIZE :]) if plain else []
    elif (hello := codec.decode_hello(datagram)) is not None:
        words += ["hello", "x" + hello.random.hex(), "x" + hello.cookie.hex(), len(hello.body)]
        words += _hello(hello.body) if plain else []
    elif (retry := codec.decode_retry(datagram)) is not None:
        words += ["retry", "x" + retry.random.hex(), "x" + retry.cookie.hex()]
    elif (answer := codec.decode_answer(datagram)) is not None:
        words += ["answer", "x" + answer.random.hex(), len(answer.body)]
        words += _answer(answer.body) if plain else []
    else:
        words.append("-")
    return " ".join(map(str, words))


# ---- Datagrams ----

_DOUBLES = [0.0, -0.0, 1.0, -2.5, 1e12, -1e12, 1.0000000000000002e12, -1.1e12, 5e-324, float("inf"), float("-inf"), float("nan")]
_TEXTS = ["", "a", "ä" * 16, "f" * 32, "f" * 33, "n" * 64, "n" * 65, "d" * 128, "d" * 129, "€" * 21, "€" * 22, "\0", "\U0010ffff"]
_SIZES = {"TYPE_UINT32": 32, "TYPE_FIXED32": 32, "TYPE_UINT64": 64, "TYPE_FIXED64": 64}


class Dice(random.Random):
    def whole(self, bits: int) -> int:
        edges = [0, 1, 2, 3, 16, 1000, 3_600_000, 3_600_001, 10_000_000, 10_000_001, 1_000_000, 1_000_001, 1 << 60, (1 << 60) + 1]
        value = self.choice([*edges, (1 << bits) - 1, self.getrandbits(bits), self.getrandbits(self.randrange(1, bits + 1))])
        return value & (1 << bits) - 1

    def fill(self, message: pb.Datagram, depth: int = 0) -> None:
        """Fills a random subset of the fields with values inside and outside of their bounds."""
        present = self.choice([0.3, 0.9, 0.97])
        for field in message.DESCRIPTOR.fields:
            if self.random() > present:
                continue
            kind = field.type
            if field.label == field.LABEL_REPEATED:
                many = getattr(message, field.name)
                for _ in range(self.choice([1, 1, 2, 3, 3, 4, 9, 9, 16, 17, 64, 65] if depth else [0, 1, 1, 2, 3])):
                    if kind == field.TYPE_MESSAGE:
                        self.fill(many.add(), depth + 1)
                    else:
                        many.append(self.value(field))
            elif kind == field.TYPE_MESSAGE:
                inside = getattr(message, field.name)
                inside.SetInParent()
                self.fill(inside, depth + 1)
                if field.name == "normal" and self.random() < 0.7:  # random vectors are not unit vectors
                    length = self.choice([1, 1, 1, 1, 1.0009, 1.0011, -0.9991, 0.9989])
                    inside.x, inside.y, inside.z = self.choice([(length, 0, 0), (0.6 * length, 0, 0.8 * length)])
                if isinstance(inside, pb.Quat) and self.random() < 0.7:  # and random quaternions are not rotations
                    length = self.choice([1, 1, 1, 1, 1.0009, 1.0011, -0.9991, 0.9989])
                    turns = [(length, 0, 0, 0), (0.6 * length, 0, 0.8 * length, 0)]
                    inside.w, inside.x, inside.y, inside.z = self.choice(turns)
            else:
                setattr(message, field.name, self.value(field))
        if isinstance(message, pb.DeviceReport) and self.random() < 0.7:  # a random report is hardly ever consistent
            message.steps = min(max(sum(message.lateness_us_log2), message.overruns, message.unseen), 2**64 - 1)

    def value(self, field: object) -> float | int | str | bool | bytes:
        kind = field.type  # type: ignore[attr-defined]
        if kind == field.TYPE_DOUBLE:  # type: ignore[attr-defined]
            good = [self.uniform(-10, 10)] * 120
            return self.choice([*_DOUBLES, *good])
        if kind == field.TYPE_STRING:  # type: ignore[attr-defined]
            return self.choice(_TEXTS)
        if kind == field.TYPE_BYTES:  # type: ignore[attr-defined]
            usual = {"hash": 16, "weights": 1024, "missing": 128, "field": 32, "part": 1000}[field.name]  # type: ignore[attr-defined]
            return self.randbytes(self.choice([usual, usual, usual, usual - 1, usual + 1, 0, 1]))
        if kind == field.TYPE_BOOL:  # type: ignore[attr-defined]
            return self.choice([False, True])
        if kind == field.TYPE_ENUM:  # type: ignore[attr-defined]
            return self.choice([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, -1, 1000])
        if kind in (field.TYPE_SFIXED64, field.TYPE_SINT64):  # type: ignore[attr-defined]
            edges = [0, 1, -1, 1 << 60, -(1 << 60), (1 << 60) + 1, -(1 << 60) - 1, (1 << 63) - 1, -(1 << 63)]
            return self.choice([*edges, *[self.randrange(10**12)] * 60])
        return self.whole(32 if kind in (field.TYPE_UINT32, field.TYPE_FIXED32) else 64)  # type: ignore[attr-defined]

    def made(self) -> bytes:
        """Returns a well-formed datagram with random values."""
        random16 = self.randbytes(16)
        kind = self.choice(["data"] * 8 + ["hello", "answer", "answer", "retry"])
        suite = Suite(self.choice([0] * 15 + [1]))
        if kind == "hello":
            hello = pb.Hello()
            self.fill(hello)
            body = hello.SerializeToString()[: self.choice([1000, 1001, 1150])]
            return codec.encode_hello(codec.HelloDatagram(random16, body, self.randbytes(16), suite))
        if kind == "answer":
            answer = pb.Answer()
            self.fill(answer)
            connection_id = self.getrandbits(32)
            return codec.encode_answer(codec.AnswerDatagram(random16, answer.SerializeToString(), connection_id, suite))
        if kind == "retry":
            return codec.encode_retry(codec.RetryDatagram(random16, self.randbytes(16), suite))
        suite = self.choice([suite, suite, suite, Suite.AES_GCM]) if suite is Suite.NOISE else suite
        epoch = 0 if suite is Suite.PLAIN else self.randrange(256)
        header = codec.Header(DatagramType.DATA, suite, epoch, self.getrandbits(32), self.whole(64))
        datagram = pb.Datagram()
        self.fill(datagram)
        return codec.encode_header(header) + datagram.SerializeToString()

    def damaged(self, datagram: bytes, others: list[bytes]) -> bytes:
        bytes_ = bytearray(datagram)
        for _ in range(self.choice([1, 1, 1, 2, 3, 8])):
            at = self.randrange(len(bytes_) + 1) if self.random() < 0.3 else self.randrange(min(len(bytes_), 120) + 1)
            end = min(len(bytes_), at + self.choice([1, 1, 2, 8, 40]))
            how = self.randrange(8)
            if how == 0 and at < len(bytes_):
                bytes_[at] ^= 1 << self.randrange(8)
            elif how == 1 and at < len(bytes_):
                bytes_[at] = self.choice([0, 1, 0x7F, 0x80, 0xFF, self.randrange(256)])
            elif how == 2:
                del bytes_[at:end]
            elif how == 3:
                bytes_[at:at] = self.randbytes(self.choice([1, 2, 8, 30]))
            elif how == 4:
                del bytes_[at:]
            elif how == 5:
                bytes_[at:at] = bytes_[at:end]
            elif how == 6:
                bytes_[at : at + 8] = struct.pack("<d", self.choice(_DOUBLES))
            else:
                other = self.choice(others)
                start = self.randrange(len(other))
                bytes_[at:end] = other[start : start + 40]
        return bytes(bytes_)


def datagrams(seed: int, count: int) -> Iterator[bytes]:
    dice = Dice(seed)
    golden = list(golden_datagrams(PAGE.read_text(encoding="utf-8")).values())
    yield from golden
    for _ in range(count - len(golden)):
        sound = dice.choice(golden) if dice.random() < 0.3 else dice.made()
        yield sound if dice.random() < 0.4 else dice.damaged(sound, golden)


def compare(decode_lines: Path, seed: int, count: int) -> tuple[dict[str, int], list[tuple[bytes, str, str]]]:
    """Returns the counts of each kind of datagram, and the datagrams on which the decoders differ with both results."""
    shown = list(datagrams(seed, count))
    lines = "".join(datagram.hex() + "\n" for datagram in shown)
    done = subprocess.run([decode_lines], input=lines, capture_output=True, text=True, check=True)
    theirs = done.stdout.splitlines()
    if len(theirs) != len(shown):
        raise RuntimeError(f"decode_lines has answered {len(theirs)} of {len(shown)} lines")
    told = {"datagrams": len(shown), "refused": 0, "with frames": 0, "with frames out of bounds": 0, "with a contact": 0}
    different = []
    for datagram, cpp in zip(shown, theirs):
        python = verdict(datagram)
        told["refused"] += python.endswith("-")
        told["with frames"] += any(word in python for word in ("state", "force", "control", "ack", "bye"))
        told["with a contact"] += "contact" in python
        told["with frames out of bounds"] += "invalid" in python and not python.endswith("invalid 0")
        if python != cpp:
            different.append((datagram, cpp, python))
    return told, different


def main() -> int:
    built = ROOT / "build" / "release" / "tests" / "decode_lines"
    example = "Example: differential.py --count 100000 --seed 7"
    line = argparse.ArgumentParser(description=__doc__, epilog=example)
    line.add_argument("--decode-lines", type=Path, default=built, metavar="PROGRAM", help="[%(default)s]")
    line.add_argument("--count", type=int, default=100_000, help="Datagrams [%(default)s]")
    line.add_argument("--seed", type=int, default=1, help="[%(default)s]")
    line.add_argument("--json", action="store_true", help="Print one JSON object on stdout")
    options = line.parse_args()
    told, different = compare(options.decode_lines, options.seed, options.count)
    print(json.dumps({**told, "different": len(different)}) if options.json else f"{told}, different: {len(different)}")
    for datagram, cpp, python in different[:10]:
        print(f"\n{datagram.hex()}\n  C++:    {cpp}\n  Python: {python}", file=sys.stderr)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
