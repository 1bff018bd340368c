# SPDX-License-Identifier: Apache-2.0
"""Writes the C++ code of the wire (protocol/wire/generated/): the values, the lists of fields, and the schema for
AnyOrder."""

from __future__ import annotations

import re
import shutil
import subprocess

import cpp_values
from cpp_values import HEAD
from model import CPP, ROOT, Field, Member, Message, Range, Wire, constant

# Messages whose code is written by hand.
_BY_HAND = ("Datagram", "Frame", "DeviceStates", "Vec3", "Quat")

# Constants of fields/field.h. Each contains the value that the Writer uses for a duration out of bounds.
_PERIODS = {
    "valid_for_us": "kValidity", "period_us": "kValidity", "max_silence_us": "kMaxSilence", "duration_ms": "kPulse",
    "wait_ms": "kWait", "lease_ms": "kWait", "timeout_ms": "kTimeout",
}  # fmt: skip

# Enums that begin with 0 in C++ and with 1 on the wire.
_ENUMS_FROM_0 = ("PortRole",)

_SHAPES = {
    "bool": "kFlag", "uint32": "kCount32", "uint64": "kCount64", "sint64": "kCount64", "fixed32": "kBits32",
    "sfixed64": "kBits64", "double": "kBits64", "float": "kBits32", "string": "kText", "bytes": "kBytes",
}  # fmt: skip


def _words(name: str) -> list[str]:
    return re.findall(r"[A-Z][a-z0-9]*", name)


# ---- Bounds ----


def _within(bound: Range | None) -> str:
    """Returns the bound of a double; empty if it is the usual one."""
    if bound is None or (bound.least, bound.most) == ("-1e12", "1e12"):
        return ""
    if not (bound.beyond or bound.infinity or bound.zero or bound.most == "1e12"):
        return f"Within{{{bound.least}, {bound.most}}}"
    said = [f".least = {bound.least}"]
    said += [f".most = {bound.most}"] if bound.most != "1e12" else []
    said += [f".{flag} = true" for flag in ("beyond", "infinity", "zero") if getattr(bound, flag)]
    return f"Within{{{', '.join(said)}}}"


def _counts(bound: Range | None) -> str:
    if bound is None:
        return ""
    said = [f".least = {bound.least}"] if bound.least != "0" else []
    said += [f".most = {_spaced(bound.most)}"] if bound.most is not None else []
    return f"Counts{{{', '.join(said)}}}" if said else ""


def _spaced(number: str) -> str:
    """A million as 1'000'000."""
    return f"{int(number):,}".replace(",", "'") if len(number) > 5 else number


# ---- Fields ----


def _front(name: str, value: str) -> str:
    return f"\ninline constexpr auto k{name}Fields = [](auto& way, auto& {value}) TENDON_INLINE"


class _List:
    """Writes the list of one message."""

    def __init__(self, wire: Wire, message: Message):
        self.wire, self.message = wire, message
        last = _words(message.name)[-1].lower()
        self.value = "wanted" if last == "field" else last  # `field` is a template
        self.members = message.members(CPP)
        self.late = self._checked_late()

    def text(self) -> str:
        out = _front(self.message.name, self.value) + " {\n"
        oneofs = set()
        for one in self.message.fields:
            if one.oneof is None:
                out += "".join(f"  {line}\n" for line in self._lines(one))
            elif one.oneof not in oneofs:
                oneofs.add(one.oneof)
                out += self._oneof(one.oneof)
            out += self._checks(one)
        return out + "};\n"

    def _path(self, name: str) -> str:
        return f"{self.value}.{name}"

    def _told(self, one: Field) -> str:
        """Returns the name for a refusal. It contains the path within the request."""
        outer = self._request_around()
        return f'"{outer}{one.name}"'

    def _request_around(self) -> str:
        for parent in self.wire.messages.values():
            if parent.name in [one.type for one in self.wire.requests()]:
                for one in parent.fields:
                    if one.type == self.message.name:
                        return f"{one.name}."
        return ""

    def _checked_late(self) -> list[str]:
        """Returns the fields whose bounds are checked after a oneof, because a missing oneof is reported first."""
        first = self.message.values.get("checked_first", [])
        oneofs = [name for name in first if name in self.message.oneofs]
        if not oneofs:
            return []
        return [one.name for one in self.message.fields if one.oneof is None and one.name not in first]

    def _lines(self, one: Field) -> list[str]:
        """Returns the lines for a field."""
        for member in self.members:
            if member.part is None and member.wire == one.name:
                return [self._line(one, member, self._path(member.name))]
            if member.part is None:
                continue
            for index, inner in enumerate(member.part.members):
                if inner.wire == one.name:
                    return self._in_part(member, index, inner)
        raise ValueError(f"no member: {self.message.name}.{one.name}")

    def _in_part(self, part: Member, index: int, inner: Member) -> list[str]:
        assert part.part is not None and inner.field is not None
        one, whole = inner.field, self._path(part.name)
        first = part.part.members[0]
        assert first.field is not None
        if part.part.there == "always":
            return [self._line(one, inner, f"{whole}.{inner.name}")]
        numbers = ", ".join(f"field<{member.field.number}>" for member in part.part.members if member.field)
        if part.part.there == "box":
            return [] if index else [f"way.box({numbers}, {self._told(first.field)}, {whole});"]
        if one.repeated:
            return [] if index else [f"way.{part.name}({numbers}, {self._told(first.field)}, {whole});"]
        verb = "part" if part.part.there == "any" or index == 0 else "rest"
        line = self._line(one, inner, f"part.{inner.name}")
        line = line.replace("way.number(", "way.present(") if one.explicit else line
        return [f"way.{verb}({self._place(one)}, {whole}, [&](auto& part) TENDON_INLINE {{ {line} }});"]

    def _place(self, one: Field) -> str:
        """Returns a field with its wire type, so that the Reader can ask for it."""
        kind = {"double": "kFixed64", "fixed32": "kFixed32", "uint32": "kVarint"}.get(one.type, "kLength")
        return f"field<{one.number}, {kind}>"

    def _line(self, one: Field, member: Member, to: str) -> str:
        verb, *beside = self._visit(one, member, to)
        arguments = [f"field<{one.number}>", self._told(one), to, *[text for text in beside if text]]
        return f"way.{verb}({', '.join(arguments)});"

    def _visit(self, one: Field, member: Member, to: str) -> list[str]:
        """Returns the function of the way, and its arguments after the member."""
        bound = one.bound
        if one.kind == "message":
            return self._message(one, member)
        if one.kind == "enum":
            known = self.wire.enums[one.type].known
            ends = [f"{one.type}::{constant(value.short)}" for value in (known[0], known[-1])]
            return ["choice", *ends, "1" if one.type in _ENUMS_FROM_0 else ""]
        if one.kind == "text":
            most = (bound.bytes.most if bound.bytes else None) or ""
            return ["texts", self._entries(one), most] if one.repeated else ["text", most]
        if one.kind == "bytes":
            return ["bytes", "Entries{{{}, {}}}".format(*one.size)]
        if one.kind == "bool":
            return ["flag"]
        if one.is_matrix:
            return ["matrix"]
        if one.repeated and one.type == "double":
            least, _ = bound.entries  # type: ignore[misc]
            return ["numbers", to.rsplit(".", 1)[0] + ".size", str(least), _within(bound.value)]
        if one.repeated:
            return ["counts"]
        if one.type == "double":
            if one.explicit and self.message.default(one.name, CPP):
                return ["radius"]
            return ["maybe" if member.optional else "number", _within(bound.value)]
        if one.type == "fixed32":
            return ["bits"]
        if one.is_time:
            return self._time(one)
        return ["count", "" if one.name in self.late else _counts(bound.value)]

    def _message(self, one: Field, member: Member) -> list[str]:
        if one.type in ("Vec3", "Quat"):
            if member.optional:
                return ["maybe"]
            if one.type == "Quat":
                return ["rotation"]
            if one.name in self.message.values.get("plain", {}).get(CPP, []):
                return ["vector_unless_zero"]
            return ["normal" if one.is_unit_vector and self.message.name != "PortSurface" else "vector"]
        list_of = f"k{one.type}Fields"
        return ["messages", self._entries(one), list_of] if one.repeated else ["message", list_of]

    def _entries(self, one: Field) -> str:
        least, most = one.bound.entries  # type: ignore[misc]
        return f"Entries{{{least}, {most}}}"

    def _time(self, one: Field) -> list[str]:
        if one.name in _PERIODS:
            return ["period", _PERIODS[one.name]]
        if one.type == "sfixed64":
            return ["time"]
        if one.type == "sint64":
            return ["difference"]
        most = (one.bound.value.most if one.bound.value else None) or ""
        if one.type == "uint32":
            unit = f"std::chrono::{'microseconds' if one.name.endswith('_us') else 'milliseconds'}"
            return ["period", f"Period{{{unit}(1), {{}}, {unit}({most}), Period::Else::kNearest}}"]
        return ["duration", "" if most in ("", "2^60") else f"Duration({_spaced(most)})"]

    # ---- Several fields ----

    def _oneof(self, name: str) -> str:
        arms = self.message.oneof(name)
        whole = "control.request" if self.message.name == "Control" else self._path(name)
        if self.message.name == "Answer":
            whole = self.value
        out = ""
        if self.message.name != "Control":  # an unknown request is not refused
            out += f'  way.one_of("{name}", {", ".join(self._place(one) for one in arms)});\n'
        for late in self.late:
            one = self.message.field(late)
            member = next(member for member in self.members if member.wire == late)
            assert one.bound.value is not None
            holds = f"{self._path(member.name)} <= {one.bound.value.most}"
            out += f"  way.require({self._told(one)}, [&] {{ return {holds}; }});\n"
        calls = []
        for one in arms:
            wrapped = self.message.wrapper(one.name)
            kind = wrapped or self.wire.messages[one.type].type_name(CPP)
            fields = f"k{wrapped or one.type}Fields"
            calls.append(f'way.arm({self._place(one)}, "{one.name}", kind<{kind}>, {whole}, {fields})')
        return out + f"  static_cast<void>({' || '.join(calls)});\n"

    def wrappers(self) -> str:
        """Writes the lists for scalars in a oneof that have their own type of value."""
        out = ""
        for name in self.message.oneofs:
            for one in self.message.oneof(name):
                if (kind := self.message.wrapper(one.name)) is None:
                    continue
                value = _words(kind)[0].lower()
                to, bound = f"{value}.{one.name}", _counts(one.bound.value)
                line = f"way.present(field<{one.number}>, {self._told(one)}, {to}, {bound});"
                out += _front(kind, value) + f" {{ {line} }};\n"
        return out

    def _checks(self, behind: Field) -> str:
        """Writes the checks that need no field after this one."""
        out = ""
        for check in self.message.checks:
            names = [one for one in self.message.fields if re.search(rf"\b{one.name}\b", check)]
            if max(names, key=lambda one: one.number) is not behind:
                continue
            told = min(names, key=lambda one: check.index(one.name))
            holds = check.replace(" or ", " || ")
            for one in names:
                member = next(member for member in self.members if member.wire == one.name)
                holds = re.sub(rf"\b{one.name}\b", self._path(member.name), holds)
            holds = re.sub(r"sum\(([\w.]+)\) <= ([\w.]+)", r"is_part(\1, \2)", holds)
            out += f"  way.require({self._told(told)}, [&] {{ return {holds}; }});\n"
        if self.message.name == "PortSurface" and behind is self.message.fields[-1]:
            out += f'  way.require("normal", [&] {{ return is_sound({self.value}); }});\n'
        return out


# ---- Files ----


def _in_order(wire: Wire, roots: list[str]) -> list[Message]:
    """Returns the messages so that each comes after those that it contains."""
    out: list[Message] = []

    def add(message: Message) -> None:
        for one in message.fields:
            if one.kind == "message":
                add(wire.messages[one.type])
        if message not in out:
            out.append(message)

    for name in roots:
        add(wire.messages[name])
    return out


def _lists(wire: Wire, what: str, includes: list[str], messages: list[Message]) -> str:
    out = HEAD + "\n" + "".join(f'#include "{name}"\n' for name in includes)
    out += f"\n// Lists of fields for {what}; see fields/field.h.\n\nnamespace tendon::wire {{\n"
    for message in messages:
        fields = _List(wire, message)
        out += fields.wrappers() + fields.text()
    return out + "\n}  // namespace tendon::wire\n"


def _shape(one: Field) -> str:
    kind = {"message": "kMessage", "enum": "kCount32"}.get(one.kind) or _SHAPES[one.type]
    return f"Shape::{kind}" + ("s" if one.repeated else "")


def _schema(wire: Wire) -> str:
    out = HEAD + '\n#include <array>\n\n#include "protocol/wire/any_order.h"\n'
    out += "\n// The schema of each message, for AnyOrder.\n\nnamespace tendon::wire::schema {\n"
    for message in _in_order(wire, list(wire.messages)):
        shapes = []
        for one in message.fields:
            inside = f", &k{one.type}" if one.kind == "message" else ", nullptr" if one.oneof else ""
            shapes.append(f"FieldShape{{{one.number}, {_shape(one)}{inside}{', true' if one.oneof else ''}}}")
        out += f"\ninline constexpr std::array k{message.name}Shapes = {{{', '.join(shapes)}}};\n"
        out += f"inline constexpr Schema k{message.name}{{k{message.name}Shapes}};\n"
    return out + "\n}  // namespace tendon::wire::schema\n"


def _formatted(text: str) -> str:
    command = ["clang-format", f"--assume-filename={ROOT}/protocol/wire/generated/a.h"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


def files(wire: Wire) -> dict[str, str]:
    """Returns the text of each file, by its path in the repository. Returns nothing if there is no clang-format."""
    return {path: _formatted(text) for path, text in _made(wire).items()} if shutil.which("clang-format") else {}


def _made(wire: Wire) -> dict[str, str]:
    requests = _in_order(wire, ["Control", "ControlAck", "Bye"])
    handshake = _in_order(wire, ["Hello", "Answer"])
    frames = [one for one in _in_order(wire, ["Datagram"]) if one not in requests]

    def lists(what: str, messages: list[Message], *includes: str) -> str:
        known = [one for one in messages if one.name not in _BY_HAND]
        return _lists(wire, what, sorted(["protocol/messages.h", "protocol/wire/fields/field.h", *includes]), known)

    folder, frame = "protocol/wire/generated/", "protocol/wire/frame.h"
    return {
        folder + "messages.h": cpp_values.text(wire),
        folder + "frame_fields.h": lists("frames", frames, frame),
        folder + "request_fields.h": lists("requests and their answers", requests, frame),
        folder + "handshake_fields.h": lists("the handshake", handshake, "protocol/wire/handshake_codec.h"),
        folder + "schema.h": _schema(wire),
    }
