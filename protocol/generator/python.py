# SPDX-License-Identifier: Apache-2.0
"""Writes the values and the codec of the Python client."""

from __future__ import annotations

import re

from model import PYTHON, Enum, Field, Member, Message, Part, Range, Wire
from prose import WIDTH, Words, wrapped

FOLDER = "clients/python/tendon"

_HEAD = '''# SPDX-License-Identifier: Apache-2.0
# Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
"""{doc}"""

from __future__ import annotations
'''

# The functions of codec/fields.py.
_HELPERS = re.compile(
    r"\b(?:read_(?:vector|rotation|normal|matrix|text|texts|numbers|counts|each|inner|padded|box)|"
    r"write_(?:vector|rotation)|clip|entries|OutOfBounds)\b"
)

# These have hand-written code: the messages around frames, and columns of states.
_BY_HAND = {"Datagram", "Frame", "Vec3", "Quat", "Control", "Answer", "DeviceStates"}


def files(wire: Wire) -> dict[str, str]:
    """Returns the text of each file, by its path in the repository."""
    return {f"{FOLDER}/generated.py": _Values(wire).text(), f"{FOLDER}/codec/generated.py": _Codec(wire).text()}


def messages(wire: Wire) -> list[Message]:
    """Returns the messages. A message comes before those that contain it."""
    out: list[Message] = []

    def add(message: Message) -> None:
        if message.name in _BY_HAND or message in out:
            return
        for field in message.fields:
            if field.kind == "message":
                add(wire.messages[field.type])
        out.append(message)

    for message in wire.messages.values():
        add(message)
    return out


def snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def literal(text: str, kind: str) -> str:
    """Writes a bound in Python: 2**60, 10_000_000, 1e12."""
    if "^" in text:
        minus, text = ("-", text[1:]) if text[0] == "-" else ("", text)
        return f"-({text.replace('^', '**')})" if minus else text.replace("^", "**")
    return f"{int(text):_}" if kind == "integer" and len(text) > 4 else text


def type_of(field: Field, wire: Wire) -> str:
    """Returns the type of a member that is not None."""
    if field.is_matrix:
        return "Mat3"
    inner = {"integer": "int", "number": "float", "bool": "bool", "text": "str", "bytes": "bytes"}.get(field.kind)
    if inner is None:
        inner = wire.messages[field.type].type_name(PYTHON) if field.type in wire.messages else field.type
    return f"Sequence[{inner}]" if field.repeated else inner


def zero_of(field: Field, wire: Wire) -> str | None:
    if field.is_matrix or field.type == "Quat":
        return None
    if field.repeated:
        return "()"
    if field.type == "Vec3":
        return "ZERO"
    if field.kind == "enum":
        zero = next((value for value in wire.enums[field.type].known if value.number == 0), None)
        return f"{field.type}.{zero.short}" if zero else None
    return {"integer": "0", "number": "0.0", "bool": "False", "text": '""', "bytes": 'b""'}.get(field.kind)


def call(head: str, arguments: list[str], indent: str = "    ", tail: str = ")") -> list[str]:
    """Writes a call on one line, or with one line for each argument."""
    line = f"{indent}{head}{', '.join(arguments)}{tail}"
    if len(line) <= WIDTH:
        return [line]
    return [f"{indent}{head}", *(f"{indent}    {argument}," for argument in arguments), f"{indent}{tail}"]


class _Values:
    """Enums and data classes."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._words = Words(wire, PYTHON, "None")
        self._lines: list[str] = []

    def text(self) -> str:
        quat = self._words.of_message(self._wire.messages["Quat"]).replace("quaternion", "quaternion (w, x, y, z)", 1)
        self._lines += [
            *("", "from collections.abc import Sequence", "from dataclasses import dataclass"),
            *("from enum import IntEnum", "from math import inf", "from typing import Union", ""),
            *("from .limits import PROTOCOL_VERSION", ""),
            *("Vec3 = tuple[float, float, float]", "Mat3 = tuple[Vec3, Vec3, Vec3]", ""),
            *("Quat = tuple[float, float, float, float]", *_docstring(quat, "")),
            *("", "ZERO: Vec3 = (0.0, 0.0, 0.0)"),
        ]
        for enum in self._wire.enums.values():
            self._enum(enum)
        for message in messages(self._wire):
            for part in (member.part for member in message.members(PYTHON)):
                if part is not None and part.type:
                    whole = all(member.field and member.field.repeated for member in part.members)
                    self._class(part.type, part.doc, list(part.members), len(part.members) if whole else 1, message)
            for field in message.fields:
                if name := message.wrapper(field.name):
                    self._wrapper(name, message, field)
            self._class(
                message.type_name(PYTHON), self._words.of_message(message), list(message.members(PYTHON)),
                message.required(PYTHON), message,
            )  # fmt: skip
        requests = [self._wire.messages[field.type].type_name(PYTHON) for field in self._wire.requests()]
        self._lines += ["", "", *call("Request = Union[", requests, "", "]")]
        frames = [field.type for field in self._wire.frames() if field.type not in _BY_HAND]
        self._lines += ["", *call("PlainFrame = Union[", frames, "", "]"), *_docstring("Every frame but Control.", "")]
        answers = [field.type for field in self._wire.messages["Answer"].fields]
        self._lines += ["", *call("Answer = Union[", answers, "", "]")]
        head = _HEAD.format(doc="The messages of tendon.proto as plain values; `messages` has them, too.")
        body = "\n".join(self._lines)
        names = sorted(["Mat3", *re.findall(r"^(?:class )?([A-Z]\w+)(?=\(|:| = )", body, re.MULTILINE)])
        everything = call("__all__ = [", [f'"{name}"' for name in dict.fromkeys(names)], "", "]")
        return head + body.replace("\nVec3 = ", "\n" + "\n".join(everything) + "\n\nVec3 = ", 1) + "\n"

    def _enum(self, enum: Enum) -> None:
        self._lines += ["", "", f"class {enum.name}(IntEnum):"]
        if enum.doc:
            self._lines += [*_docstring(self._words.say(enum.doc, "Frame"), "    "), ""]
        for value in enum.known:
            self._lines += _commented(f"    {value.short} = {value.number}", self._words.say(value.doc, "Frame"))

    def _wrapper(self, name: str, message: Message, field: Field) -> None:
        member = Member(field.name, field, None, False, field.name)
        self._class(name, message.values["wrappers"][field.name]["doc"], [member], 0, message)

    def _class(self, name: str, doc: str, members: list[Member], required: int, message: Message) -> None:
        self._lines += ["", "", "@dataclass(frozen=True, slots=True)", f"class {name}:"]
        if doc:
            self._lines += [*_docstring(doc, "    "), ""]
        own = name == message.type_name(PYTHON)
        for index, member in enumerate(members):
            field = member.field
            if field is not None and field.heading and own:
                self._lines += wrapped(self._words.say(field.heading, message.name), "    ", "# ")
            line = f"    {member.name}: {self._type(member, message)}"
            if index >= required:
                line += f" = {self._default(member, message)}"
            self._lines += _commented(line, self._comment(member, message, own))
        for oneof in message.oneofs if own else ():
            cases = [message.wrapper(field.name) or field.type for field in message.oneof(oneof)]
            self._lines.append(f"    {oneof}: {' | '.join(cases)}")

    def _comment(self, member: Member, message: Message, own: bool) -> str:
        otherwise = message.default(member.wire, PYTHON) or "0"
        return self._words.of_member(member, "None" if member.optional else otherwise if own else None)

    def _type(self, member: Member, message: Message) -> str:
        if member.field is not None:
            kind = message.hint(member.wire, PYTHON) or type_of(member.field, self._wire)
        else:
            assert member.part is not None
            kind = member.part.type or "tuple[Vec3, Vec3]"
        return f"{kind} | None" if member.optional else kind

    def _default(self, member: Member, message: Message) -> str:
        if member.optional:
            return "None"
        default = message.default(member.wire, PYTHON)
        assert member.field is not None
        default = default or zero_of(member.field, self._wire)
        if default is None:
            raise ValueError(f"{message.name}.{member.wire} has no default: give it one in values.toml")
        return default


def _docstring(doc: str, indent: str) -> list[str]:
    lines = wrapped(f'"""{doc}', indent)
    if len(lines[-1]) + 3 > WIDTH:
        *head, last = lines[-1].rsplit(" ", 1)
        lines = [*lines[:-1], *head, f"{indent}{last}"]
    return [*lines[:-1], f'{lines[-1]}"""']


def _commented(line: str, comment: str) -> list[str]:
    if not comment:
        return [line]
    if len(line) + len(comment) + 4 <= WIDTH:
        return [f"{line}  # {comment}"]
    return [*wrapped(comment, "    ", "# "), line]


class _Codec:
    """A function that reads each message, and one that writes it."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._told = {field.type for field in wire.requests()}  # whose refusals name the field
        self._lines: list[str] = []

    def text(self) -> str:
        for enum in self._wire.enums.values():
            self._lines.append(f"_{snake(enum.name).upper()} = {{int(value): value for value in {enum.name}}}")
        for message in messages(self._wire):
            self._read(message)
            self._write(message)
        self._choices()
        body = "\n".join(self._lines)
        values = _names_in(body, self._wire)
        helpers = sorted(set(_HELPERS.findall(body)), key=lambda name: (name[0].islower(), name))
        doc = "The messages of tendon.proto: values to protobuf messages and back."
        maths = ["from math import inf"] if re.search(r"\binf\b", body) else []
        imports = [
            *("", *maths, "", "from .. import tendon_pb2 as pb"),
            *call("from ..generated import (", values, "", ")"),
            *call("from .fields import (", helpers, "", ")"),
            "",
        ]
        return _HEAD.format(doc=doc) + "\n".join(imports) + "\n" + body + "\n"

    # ---- Reading ----

    def _read(self, message: Message) -> None:
        name, value = snake(message.name), message.type_name(PYTHON)
        self._lines += ["", "", f"def read_{name}(m: pb.{message.name}) -> {value}:"]
        firsts = [part.members[0].wire for part in self._parts(message)]
        held = {member.wire: part for part in self._parts(message) for member in part.members}
        plain = {member.wire for member in message.members(PYTHON) if member.field and not member.optional}
        read: dict[str, str] = {}
        for place in message.in_order_of_checks:
            if place in message.oneofs:
                self._lines += [f'    case = m.WhichOneof("{place}")', *_refused("case is None", place)]
                continue
            field = message.field(place)
            part = held.get(place)
            empty = field.is_optional and place not in plain
            if part is not None:
                first = place in firsts and part.there == "first"
                empty = part.there in ("box", "any") or (field.is_optional and (first or _is_inner(field)))
            seldom = part is not None or (place in plain and field.is_optional)
            read[place] = self._read_field(message, field, empty, seldom)
            for check in message.checks:
                if re.findall(r"[a-z]\w+", check.replace("sum(", "("))[0] == place:
                    names = re.compile(r"\b(?!or\b|sum\b)[a-z]\w+")
                    terms = names.sub(lambda found: read.get(found[0], f"m.{found[0]}"), check)
                    self._lines += _refused(f"not ({terms})", place)
        arguments = [
            self._part(member.part, read) if member.part else read[member.wire] for member in message.members(PYTHON)
        ]
        for oneof in message.oneofs:
            self._read_oneof(message, oneof)
            arguments.append(oneof)
        self._lines += call(f"return {value}(", arguments)

    def _parts(self, message: Message) -> list[Part]:
        return [member.part for member in message.members(PYTHON) if member.part is not None]

    def _read_field(self, message: Message, field: Field, empty: bool, seldom: bool) -> str:
        """Writes the checks of a field, and returns an expression for its value. `empty`: the value is None if the
        field is absent. `seldom`: the field is usually absent."""
        name, bound = field.name, field.bound
        there = f'm.HasField("{name}")'
        if field.absent_is_refused and field.type != "Quat":
            self._lines += _refused(f"not {there}", name)
        if field.repeated:
            assert bound.entries is not None
            value, absent = self._read_repeated(field), "None" if empty else "()"
            if empty or (field.kind in ("integer", "number") and min(bound.entries) == 0):
                value = f"{value} if m.{name} else {absent}"
            self._assign(name, value)
            return name
        if field.kind == "message":
            value, absent = self._read_message(field), "ZERO" if field.type == "Vec3" and not empty else "None"
            if empty or (seldom and field.type == "Vec3"):
                value = f"{value} if {there} else {absent}"
            self._assign(name, value)
            return name
        if field.kind == "enum":
            self._lines.append(f"    {name} = _{snake(field.type).upper()}.get(m.{name})")
            self._lines += _refused(f"{name} is None", name)
            return name
        if field.kind == "text":
            assert bound.bytes and bound.bytes.most
            self._lines.append(f'    {name} = read_text("{name}", m.{name}, {bound.bytes.most})')
            return name
        if field.kind == "bytes":
            least, most = field.size
            within = f"len({name}) == {most}" if least == most else f"{least} <= len({name}) <= {most}"
            outside = f"len({name}) > {most}" if least == 0 else f"not {within}"
            self._lines += [f"    {name} = m.{name}", *_refused(outside, name)]
            return name
        default = message.default(name, PYTHON) if field.has_presence and not empty else None
        outside = self._outside(field, name)
        if empty or default:
            self._lines.append(f"    {name} = m.{name} if {there} else {default or 'None'}")
            if outside:
                known = f"{name} is not None and " if empty else ""
                self._lines += _refused(f"{known}{outside}", name)
            return name
        if not outside:
            return f"m.{name}"
        self._lines += [f"    {name} = m.{name}", *_refused(outside, name)]
        return name

    def _assign(self, name: str, value: str) -> None:
        line = f"    {name} = {value}"
        if len(line) > WIDTH:
            value, *absent = value.split(" if ")
            self._lines += [f"    {name} = (", f"        {value}", *(f"        if {rest}" for rest in absent), "    )"]
        else:
            self._lines.append(line)

    def _read_repeated(self, field: Field) -> str:
        name, bound = field.name, field.bound
        if field.is_matrix:
            return f'read_matrix("{name}", m.{name})'
        assert isinstance(bound.entries, tuple)
        fewest, most = bound.entries
        if field.kind == "text":
            assert bound.bytes
            return f'read_texts("{name}", m.{name}, {fewest}, {most}, {bound.bytes.most})'
        if field.kind == "message":
            return f'read_each("{name}", m.{name}, {fewest}, {most}, read_{snake(field.type)})'
        if field.kind == "number":
            assert bound.value and bound.value.most
            return f'read_numbers("{name}", m.{name}, {fewest}, {most}, {bound.value.least}, {bound.value.most})'
        return f'read_counts("{name}", m.{name}, {fewest}, {most})'

    def _read_message(self, field: Field) -> str:
        name = field.name
        if field.type == "Quat":
            return f'read_rotation("{name}", m.{name})'
        if field.type == "Vec3":
            return f'read_{"normal" if field.is_unit_vector else "vector"}("{name}", m.{name})'
        if field.message not in self._told:
            return f"read_{snake(field.type)}(m.{name})"
        return f'read_inner("{name}", read_{snake(field.type)}, m.{name})'

    def _outside(self, field: Field, value: str) -> str:
        """Returns the condition that a value is out of bounds. Empty: there is no bound."""
        bound = field.bound.value
        if bound is None:
            return ""
        least = literal(bound.least, field.kind)
        most = None if bound.most is None else literal(bound.most, field.kind)
        unsigned = field.kind == "integer" and field.type in ("uint32", "uint64", "fixed32", "fixed64")
        if unsigned and least == "0":
            return "" if most is None else f"{value} > {most}"
        if most is None:
            return f"{value} < {least}"
        within = f"{least} {'<' if bound.beyond else '<='} {value} <= {most}"
        others = [f"{value} == {other}" for other, also in (("inf", bound.infinity), ("0", bound.zero)) if also]
        return f"not ({' or '.join([within, *others])})" if others else f"not {within}"

    def _part(self, part: Part, read: dict[str, str]) -> str:
        names = [read[member.wire] for member in part.members]
        first = names[0]
        if part.there == "box":
            wires = [f'"{member.wire}"' for member in part.members]
            return f"read_box({wires[0]}, {names[0]}, {names[1]})"
        fields = [member.field for member in part.members]
        if all(field is not None and field.repeated for field in fields):
            inner = [first, *(f"read_padded({name}, len({first}))" for name in names[1:])]
            return f"{part.type}({', '.join(inner)}) if {first} else None"
        value = f"{part.type}({', '.join(names)})"
        if part.there == "any":
            absent = " and ".join(f"{name} is None" for name in names)
            zero = {name for name, field in zip(names, fields) if field and field.type == "Vec3"}
            inner = [f"{name} or ZERO" if name in zero else name for name in names]
            return f"None if {absent} else {part.type}({', '.join(inner)})"
        if fields[0] is not None and not fields[0].is_optional:
            return f"{value} if {first} else None"
        return f"None if {first} is None else {value}"

    def _read_oneof(self, message: Message, oneof: str) -> None:
        cases = message.oneof(oneof)
        kinds = [message.wrapper(field.name) or field.type for field in cases]
        self._lines.append(f"    {oneof}: {' | '.join(kinds)}")
        for index, (field, kind) in enumerate(zip(cases, kinds)):
            test = f'    {"if" if index == 0 else "elif"} case == "{field.name}":'
            self._lines.append("    else:" if index == len(cases) - 1 else test)
            if field.kind == "message":
                self._lines.append(f"        {oneof} = {self._read_message(field)}")
                continue
            outside = self._outside(field, f"m.{field.name}")
            self._lines += _refused(outside, field.name, "        ")
            self._lines.append(f"        {oneof} = {kind}(m.{field.name})")

    # ---- Writing ----

    def _write(self, message: Message) -> None:
        name, kind = snake(message.name), message.type_name(PYTHON)
        self._lines += ["", "", f"def write_{name}(m: pb.{message.name}, value: {kind}) -> None:"]
        for index, member in enumerate(message.members(PYTHON)):
            if member.part is None:
                assert member.field is not None
                indent = "    "
                if index >= message.required(PYTHON) and _is_seldom(member.field):
                    self._lines.append(f"    if value.{member.name}:")
                    indent = "        "
                self._write_field(message, member.field, f"value.{member.name}", member.optional, indent)
                continue
            part, value = member.part, f"value.{member.name}"
            self._lines.append(f"    if {value} is not None:")
            for index, inner in enumerate(part.members):
                assert inner.field is not None
                at = f"{value}[{index}]" if not part.type else f"{value}.{inner.name}"
                self._write_field(message, inner.field, at, inner.optional, "        ")
        for oneof in message.oneofs:
            self._write_oneof(message, oneof)

    def _write_field(self, message: Message, field: Field, value: str, optional: bool, indent: str) -> None:
        target = f"m.{field.name}"
        default = message.default(field.name, PYTHON)
        if optional:
            self._lines.append(f"{indent}if {value} is not None:")
            indent += "    "
        elif field.has_presence and default and field.kind != "message":
            self._lines.append(f"{indent}if {value} != {default}:")
            indent += "    "
        elif field.is_optional and field.type == "Vec3" and indent == "    ":
            self._lines.append(f"{indent}if any({value}):")
            indent += "    "
        if field.is_matrix:
            self._lines.append(f"{indent}{target}.extend(entries({value}))")
        elif field.repeated:
            self._write_repeated(field, value, target, indent)
        elif field.type in ("Vec3", "Quat"):
            self._lines.append(f"{indent}write_{'vector' if field.type == 'Vec3' else 'rotation'}({target}, {value})")
        elif field.kind == "message":
            self._lines += _written(field, value, indent)
        elif field.kind == "text":
            assert field.bound.bytes
            self._lines.append(f"{indent}{target} = clip({value}, {field.bound.bytes.most})")
        elif field.kind == "bytes":
            self._lines.append(f"{indent}{target} = {value}[:{field.size[1]}]")
        elif field.kind == "enum":
            self._lines.append(f"{indent}{target} = {value}  # type: ignore[assignment]")
        else:
            self._lines.append(f"{indent}{target} = {value}")

    def _write_repeated(self, field: Field, value: str, target: str, indent: str) -> None:
        most = field.bound.entries[1] if isinstance(field.bound.entries, tuple) else None
        if field.kind == "text":
            assert field.bound.bytes
            texts = f"clip(text, {field.bound.bytes.most}) for text in {value}[:{most}]"
            self._lines.append(f"{indent}{target}.extend({texts})")
        elif field.kind == "message":
            entry = field.name.removesuffix("s")
            self._lines.append(f"{indent}for {entry} in {value}[:{most}]:")
            self._lines.append(f"{indent}    write_{snake(field.type)}({target}.add(), {entry})")
        else:
            self._lines.append(f"{indent}{target}.extend({value})")

    def _write_oneof(self, message: Message, oneof: str) -> None:
        for index, field in enumerate(message.oneof(oneof)):
            value = f"value.{oneof}"
            last = index == len(message.oneof(oneof)) - 1
            kind = message.wrapper(field.name) or field.type
            test = f"    {'if' if index == 0 else 'elif'} isinstance({value}, {kind}):"
            self._lines.append("    else:" if last else test)
            if field.kind == "message":
                self._lines += _written(field, value, "        ")
            else:
                self._lines.append(f"        m.{field.name} = {value}.{field.name}")

    # ---- One of many ----

    def _choices(self) -> None:
        frames = [field for field in self._wire.frames() if field.type not in _BY_HAND]
        answers = list(self._wire.messages["Answer"].fields)
        for name, holder, value, oneof, cases, otherwise in (
            ("frame", "Frame", "PlainFrame", "body", frames, "None when it is another one, or of a newer peer."),
            ("request", "Control", "Request", "op", list(self._wire.requests()), "None when it is not known here."),
            ("answer", "Answer", "Answer", "body", answers, "None when it is neither."),
        ):
            self._lines += ["", "", f"def read_{name}(m: pb.{holder}) -> {value} | None:", f'    """{otherwise}"""']
            self._lines.append(f'    case = m.WhichOneof("{oneof}")')
            for field in cases:
                self._lines.append(f'    if case == "{field.name}":')
                self._lines.append(f"        return read_{snake(field.type)}(m.{field.name})")
            self._lines.append("    return None")
            self._lines += ["", "", f"def write_{name}(m: pb.{holder}, value: {value}) -> None:"]
            for index, field in enumerate(cases):
                kind = self._wire.messages[field.type].type_name(PYTHON)
                self._lines.append(f"    {'if' if index == 0 else 'elif'} isinstance(value, {kind}):")
                self._lines += _written(field, "value", "        ")


def _refused(condition: str, name: str, indent: str = "    ") -> list[str]:
    return [f"{indent}if {condition}:", f'{indent}    raise OutOfBounds("{name}")']


def _written(field: Field, value: str, indent: str) -> list[str]:
    """Writes a message inside another one. It is there even if all of its fields are 0."""
    target = f"m.{field.name}"
    return [f"{indent}{target}.SetInParent()", f"{indent}write_{snake(field.type)}({target}, {value})"]


def _is_seldom(field: Field) -> bool:
    """Returns True if the value is usually 0. A test takes less time than to assign a 0."""
    return field.kind in ("integer", "bool", "text") and not field.repeated and not field.has_presence


def _is_inner(field: Field) -> bool:
    return field.kind == "message" and field.type not in ("Vec3", "Quat")


def _names_in(body: str, wire: Wire) -> list[str]:
    """Returns the names of values in the code."""
    body = re.sub(r"\bpb\.\w+", "", body)
    names = {"Answer", "PlainFrame", "Request", "ZERO", *wire.enums}
    names |= {message.type_name(PYTHON) for message in wire.messages.values()}
    for message in wire.messages.values():
        names |= {member.part.type for member in message.members(PYTHON) if member.part and member.part.type}
        names |= {name for field in message.fields if (name := message.wrapper(field.name))}
    return sorted(name for name in names if re.search(rf"\b{name}\b", body))
