# SPDX-License-Identifier: Apache-2.0
"""Writes the C++ values of the wire (protocol/wire/generated/messages.h): enums, structs, and what they form."""

from __future__ import annotations

import re

import page
import python
from model import CPP, Enum, Field, Member, Message, Range, Wire, constant
from prose import WIDTH, Words, wrapped

HEAD = """\
// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once
"""

# Messages without a value, or with one written by hand.
_BY_HAND = ("Datagram", "Frame", "DeviceStates", "Vec3", "Quat", "Echo", "Control", "Answer")

_SCALARS = {
    "integer": {"uint32": "std::uint32_t", "fixed32": "std::uint32_t", "uint64": "std::uint64_t"},
    "number": {"double": "double"},
    "bool": {"bool": "bool"},
    "text": {"string": "std::string"},
}
_ZEROS = {"bool": "false", "double": "0", "std::uint32_t": "0", "std::uint64_t": "0"}
_ZEROS |= {kind: f"{kind}::Zero()" for kind in ("Vec3", "Mat3")}

_STANDARD = {
    "array": r"std::array", "cstddef": r"std::byte", "cstdint": r"std::uint", "optional": r"std::optional", "span": r"std::span",
    "string": r"std::string",
    "variant": r"std::variant", "vector": r"std::vector",
}  # fmt: skip


def text(wire: Wire) -> str:
    return _Values(wire).text()


class _Values:
    """Enums and structs."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._words = Words(wire, CPP, "empty")
        self._core = {name for names in wire.cpp_headers.values() for name in names}
        self._lines: list[str] = []

    def text(self) -> str:
        for enum in self._wire.enums.values():
            if enum.name not in self._core:
                self._enum(enum)
        for message in python.messages(self._wire):
            if message.name not in (*_BY_HAND, *self._core):
                self._parts(message)
                self._message(message)
        for name, doc, fields in (
            ("Request", "Reliable: the content of a Control.", self._wire.requests()),
            ("Answer", "To a Hello.", self._wire.messages["Answer"].fields),
        ):
            kinds = ", ".join(self._wire.messages[one.type].type_name(CPP) for one in fields)
            self._lines += ["", *_doc(doc), f"using {name} = std::variant<{kinds}>;"]
        self._lines += self._fits_columns()
        body = "\n".join(self._lines)
        standard = [f"#include <{name}>" for name, used in _STANDARD.items() if re.search(used, body)]
        headers = {*self._wire.cpp_headers, "core/base/time.h", "protocol/limits.h"}
        own = [f'#include "{name}"' for name in sorted(headers)]
        about = "// The messages of tendon.proto as plain values. An empty member stands for an absent field."
        front = [*standard, "", *own, "", about, "", "namespace tendon {"]
        return "\n".join([HEAD, *front, body, "", "}  // namespace tendon", ""])

    def _enum(self, enum: Enum) -> None:
        self._lines += ["", *_doc(f"{self._words.say(enum.doc, 'Frame')} Part of the wire: never renumber.")]
        self._lines.append(f"enum class {enum.name} : std::uint8_t {{")
        for value in enum.known:
            line = f"  {constant(value.short)} = {value.number},"
            self._lines += _commented(line, self._words.say(value.doc, "Frame"))
        self._lines.append("};")

    # ---- Structs ----

    def _parts(self, message: Message) -> None:
        """Writes the values of several fields. A box is written inside the message."""
        for part in (member.part for member in message.members(CPP)):
            if part is not None and part.type not in self._core and "::" not in part.type:
                self._struct(part.type, part.doc, part.members, message, message.values["parts"][part.name])

    def _message(self, message: Message) -> None:
        doc, members = self._words.of_message(message), message.members(CPP)
        inner = [
            (part.type.split("::")[1], part.members)
            for part in (member.part for member in members)
            if part is not None and "::" in part.type
        ]
        self._struct(message.type_name(CPP), doc, members, message, message.values, inner)

    def _struct(self, name, doc, members, message, values, inner=()) -> None:  # type: ignore[no-untyped-def]
        self._lines += ["", *_doc(doc), f"struct {name} {{"]
        for inner_name, inner_members in inner:
            self._lines.append(f"struct {inner_name} {{")
            for member in inner_members:
                self._lines += _commented(self._declared(member, message), member.field.unit)
            self._lines.append("};")
        own, heading = name == message.type_name(CPP), ""
        for member in members:
            above = _heading(message, member) if own else ""
            if above != heading:
                heading = above
                self._lines += wrapped(self._words.say(heading, message.name), "  ", "// ")
            if member.field and member.field.repeated and member.field.kind == "number" and not member.field.is_matrix:
                self._lines.append(f"  std::uint32_t size = 0;  ///< number of entries of `{member.name}`")
            self._lines += _commented(self._declared(member, message), self._comment(member, message, own))
        for oneof in message.oneofs if own else ():
            kinds = [message.wrapper(one.name) or one.type for one in message.oneof(oneof)]
            self._lines.append(f"  std::variant<{', '.join(kinds)}> {oneof}{{}};")
        if values.get("equal"):
            self._lines += ["", f"  bool operator==(const {name}&) const = default;"]
        self._lines.append("};")

    def _declared(self, member: Member, message: Message) -> str:
        kind = self._type(member)
        if member.optional:
            return f"  std::optional<{kind}> {member.name}{{}};"
        zero = message.default(member.wire, CPP) or _ZEROS.get(kind) or self._first(kind)
        return f"  {kind} {member.name}{f' = {zero}' if zero else '{}'};"

    def _first(self, kind: str) -> str:
        return f"{kind}::{constant(self._wire.enums[kind].known[0].short)}" if kind in self._wire.enums else ""

    def _type(self, member: Member) -> str:
        one = member.field
        if one is None:
            assert member.part is not None
            return member.part.type.rsplit("::", 1)[-1]
        if hint := self._wire.messages[one.message].hint(one.name, CPP):
            return hint
        if one.kind == "bytes":
            least, most = one.size
            return f"std::array<std::byte, {most}>" if least == most else "std::vector<std::byte>"
        if one.is_matrix:
            return "Mat3"
        if one.is_time and not one.repeated:
            return "PeerTime" if one.is_instant else "Duration"
        if one.kind in ("message", "enum"):
            kind = self._wire.messages[one.type].type_name(CPP) if one.type in self._wire.messages else one.type
        else:
            kind = _SCALARS[one.kind][one.type]
        if not one.repeated:
            return kind
        if one.kind in ("message", "text"):
            return f"std::vector<{kind}>"
        assert isinstance(one.bound.entries, tuple)
        return f"std::array<{kind}, {one.bound.entries[1]}>"

    # ---- Comments ----

    def _comment(self, member: Member, message: Message, own: bool) -> str:
        if member.part is not None:
            about = self._words.say(member.part.doc, message.name).rstrip(".")
            both = (about[:1].lower() + about[1:], self._words.of_part(member.part))
            return "; ".join(text for text in both if text)
        one = member.field
        assert one is not None
        absent = "empty" if member.optional else (message.default(member.wire, CPP) or "0") if own else None
        said, bound = re.sub("(?:^|; )absent is refused", "", self._words.of_field(one, absent)), _bound(one)
        unit = "" if one.is_time else one.unit
        if not bound or said.startswith(f"{bound}: "):
            return said
        front = ", ".join(text for text in (unit, bound) if text)
        said = said.removeprefix(unit).lstrip(".,: ") if unit else said
        return f"{front}{'. ' if said[0].isupper() else ': '}{said}" if said else front

    # ---- Columns ----

    def _fits_columns(self) -> list[str]:
        columns = {one.name for one in self._wire.messages["DeviceStates"].fields} | {"device"}
        unfit = []
        for member in self._wire.messages["DeviceState"].members(CPP):
            if member.wire in columns:
                continue
            kind, value = self._type(member), f"state.{member.name}"
            if member.optional:
                unfit.append(f"!{value}")
            elif kind.startswith("std::array") or kind in ("Duration", "PeerTime"):
                unfit.append(f"{value} == {kind}{{}}")
            elif kind == "Vec3":
                unfit.append(f"{value}.isZero(0)")
            elif kind.startswith("std::"):
                unfit.append(f"{value} == 0" if kind in _ZEROS else f"{value}.empty()")
            else:
                unfit.append(f"!{value}" if kind == "bool" else f"{value} == 0")
        doc = "Returns true if DeviceStates can carry the state, because all other members are empty or 0."
        head = "inline bool fits_columns(const DeviceState& state) noexcept {"
        return ["", *_doc(doc), head, f"  return {' && '.join(unfit)};", "}"]


def _heading(message: Message, member: Member) -> str:
    """Returns the line above the fields to which the member belongs."""
    heading = ""
    for one in message.fields:
        heading = one.heading or heading
        if one.name == member.wire:
            break
    return heading


def _doc(text: str, indent: str = "") -> list[str]:
    return wrapped(text, indent, "/// ") if text else []


def _commented(line: str, comment: str) -> list[str]:
    if not comment:
        return [line]
    if "\n" not in comment and len(line) + len(comment) + 7 <= WIDTH:
        return [f"{line}  ///< {comment}"]
    return [*_doc(comment, "  "), line]


# ---- Bounds ----

_NANOSECONDS = {"s": 10**9, "ms": 10**6, "µs": 10**3, "ns": 1}


def _bound(one: Field) -> str:
    """Returns the bounds of a field in words; empty if there are none but the usual ones."""
    if one.repeated:
        if not isinstance(one.bound.entries, tuple) or one.kind not in ("message", "text"):
            return ""
        least, most = one.bound.entries
        said = f"at most {most}" if least == 0 else f"{least} … {most}"
        return f"{said} of at most {one.bound.bytes.most} bytes" if one.bound.bytes else said
    if one.kind == "bytes":
        least, most = one.size
        return f"{least} bytes" if least == most else f"{least} … {most} bytes"
    if one.bound.bytes:
        return f"at most {one.bound.bytes.most} bytes"
    if one.is_unit_vector:
        return "unit vector"
    bound = one.bound.value
    if bound is None or one.kind == "message":
        return ""
    if one.is_time:
        return _span(one, bound)
    if one.kind == "integer":
        if bound.most is not None:
            return f"{bound.least} … {page.number(bound.most, one)}"
        return "" if "1, 2, 3" in one.doc or bound.least == "0" else f"≥ {bound.least}"
    if (bound.least, bound.most) == ("-1e12", "1e12"):
        return ""
    beside = " or +infinity" if bound.infinity else " or 0" if bound.zero else ""
    if bound.most == "1e12":
        return f"{'>' if bound.beyond else '≥'} {bound.least}{beside}"
    return page.range_of(bound, one, "")


def _span(one: Field, bound: Range) -> str:
    if bound.most is None or bound.most == "2^60":
        return ""
    unit = _NANOSECONDS[one.unit]
    least, most = int(bound.least) * unit, int(bound.most) * unit

    def said(span: int) -> str:
        name = next(name for name, size in _NANOSECONDS.items() if span % size == 0)
        return f"{span // _NANOSECONDS[name]} {name}"

    return f"{said(least)} … {said(most)}" if least > 0 else f"at most {said(most)}"
