# SPDX-License-Identifier: Apache-2.0
"""Reads tendon.proto, and maps its fields to the members of values.

    from model import load
    wire = load()                        # needs protoc
    for message in wire.messages.values():
        for member in message.members("python"):
            ...

A `Field` is part of a message, a `Member` is part of the value in a language. By default, the name of a member is the
name of its field without the unit: `force_applied_n` becomes `force_applied`. values.toml lists the exceptions.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
import tomllib
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2

ROOT = Path(__file__).resolve().parents[2]
PROTO = ROOT / "protocol/wire/tendon.proto"
VALUES = Path(__file__).with_name("values.toml")

CPP, PYTHON, TYPESCRIPT, CSHARP = "cpp", "python", "typescript", "csharp"

# ---- Bounds: the notation is at the top of tendon.proto ----


@dataclass(frozen=True)
class Range:
    """An interval as it is written: `least` and `most` are texts such as "-2^60" and "1e12"."""

    least: str
    most: str | None  # None: no end
    beyond: bool = False  # `least` itself is out of bounds
    infinity: bool = False  # +infinity is within bounds too
    zero: bool = False  # 0 is within bounds too


@dataclass(frozen=True)
class Bound:
    value: Range | None = None  # of the value, or of each entry
    bytes: Range | None = None  # of the text or the bytes, or of each entry
    entries: tuple[int, int] | frozenset[int] | None = None  # least and most, or the numbers that are allowed


_RANGE = r"([\[(])([^,\]]+), ([^\]]+)\]"
_ENTRIES = r"(\[\d+, \d+\]|\{\d+(?:, \d+)*\}) entries"
_BOUND = re.compile(
    rf"(?:{_RANGE}( bytes| or \+infinity| or 0)?(?:, {_ENTRIES})?|{_ENTRIES}(?: of {_RANGE} bytes)?)(?::\s*|$)",
    re.DOTALL,
)


def _range(opening: str, least: str, most: str, beside: str) -> Range:
    infinity, zero = beside == " or +infinity", beside == " or 0"
    return Range(least, None if most == "…" else most, opening == "(", infinity, zero)


def _entries(text: str) -> tuple[int, int] | frozenset[int]:
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    return (numbers[0], numbers[1]) if text[0] == "[" else frozenset(numbers)


def split_comment(comment: str) -> tuple[Bound, str]:
    """Splits a comment into the bound and the rest of the comment."""
    if not comment.startswith(("[", "(", "{")):
        return Bound(), comment
    found = _BOUND.match(comment)
    if not found:
        raise ValueError(f"no bound: {comment}")
    opening, least, most, beside, entries, only, of_opening, of_least, of_most = found.groups()
    value = length = None
    if opening:
        if beside == " bytes":
            length = _range(opening, least, most, "")
        else:
            value = _range(opening, least, most, beside or "")
    if of_opening:
        length = _range(of_opening, of_least, of_most, "")
    count = entries or only
    return Bound(value, length, _entries(count) if count else None), comment[found.end() :]


# ---- Units ----

_UNITS = {
    "m": "m", "mps": "m/s", "n": "N", "npm": "N/m", "j": "J", "rad": "rad", "radps": "rad/s", "nm": "N·m",
    "nmprad": "N·m/rad", "nspm": "N·s/m", "nmsprad": "N·m·s/rad", "per_s": "1/s", "s": "s",
}  # fmt: skip
_TIMES = {"ns": "ns", "us": "µs", "ms": "ms"}


def split_unit(name: str) -> tuple[str, str]:
    """`force_applied_n`: ("force_applied", "n"). Numbers that count in a unit, `loop_hz`, keep it."""
    for unit in sorted({**_UNITS, **_TIMES}, key=len, reverse=True):
        if name.endswith(f"_{unit}") and name != f"_{unit}":
            return name[: -len(unit) - 1], unit
    return name, ""


def camel(name: str) -> str:
    """As protobuf-es and the TypeScript client write names: lateness_us_log2 is latenessUsLog2."""
    first, *rest = name.split("_")
    return first + "".join(word[:1].upper() + word[1:] for word in rest)


def pascal(name: str) -> str:
    """As C# writes names: "force_applied" is ForceApplied, and "SAFE_STOP" is SafeStop."""
    return "".join(word[:1].upper() + (word[1:].lower() if word.isupper() else word[1:]) for word in name.split("_"))


def constant(short: str) -> str:
    """As C++ writes an enum value: "SAFE_STOP" is kSafeStop."""
    return "k" + "".join(word.capitalize() for word in short.split("_"))


# ---- The wire ----

_TYPES = {
    1: "double", 2: "float", 3: "int64", 4: "uint64", 5: "int32", 6: "fixed64", 7: "fixed32", 8: "bool", 9: "string",
    12: "bytes", 13: "uint32", 15: "sfixed32", 16: "sfixed64", 17: "sint32", 18: "sint64",
}  # fmt: skip
_MESSAGE, _ENUM = 11, 14


@dataclass(frozen=True)
class EnumValue:
    name: str  # "MODE_IDLE"
    number: int
    short: str  # "IDLE"
    doc: str


@dataclass(frozen=True)
class Enum:
    name: str
    doc: str
    values: tuple[EnumValue, ...]  # in order of the file

    @property
    def prefix(self) -> str:
        """ "MODE_": in front of all names."""
        return self.values[0].name[: -len(self.values[0].short)]

    @property
    def known(self) -> tuple[EnumValue, ...]:
        """The values that are accepted: not the unspecified one."""
        return tuple(value for value in self.values if value.short != "UNSPECIFIED")


@dataclass(frozen=True)
class Field:
    message: str
    name: str
    number: int
    type: str  # "double", "uint32", …; the name of the message or of the enum
    kind: str  # "number", "integer", "bool", "text", "bytes", "message" or "enum"
    repeated: bool
    packed: bool
    explicit: bool  # a scalar with a presence of its own: `optional`
    oneof: str | None
    doc: str  # without bound; equations are on lines of their own
    bound: Bound
    heading: str  # a line of its own in front of it and those that follow: "In that time:"

    @property
    def has_presence(self) -> bool:
        return not self.repeated and (self.explicit or self.kind == "message" or self.oneof is not None)

    @property
    def unit(self) -> str:
        """The unit as people write it: "N/m". Empty: none."""
        suffix = split_unit(self.name)[1]
        return {**_UNITS, **_TIMES}.get(suffix, "")

    @property
    def is_time(self) -> bool:
        """Returns True for durations and clock readings: the name ends in _ns, _us or _ms."""
        return split_unit(self.name)[1] in _TIMES

    @property
    def is_instant(self) -> bool:
        """Returns True for clock readings."""
        return self.is_time and self.type == "sfixed64"

    @property
    def is_matrix(self) -> bool:
        """Returns True for a 3 × 3 matrix, which has 1, 3 or 9 entries."""
        return isinstance(self.bound.entries, frozenset) and self.bound.entries >= {1, 3, 9}

    @property
    def size(self) -> tuple[int, int]:
        """Returns the minimum and the maximum number of bytes."""
        assert self.bound.bytes and self.bound.bytes.most
        return int(self.bound.bytes.least), int(self.bound.bytes.most)

    @property
    def is_unit_vector(self) -> bool:
        return self.type == "Vec3" and self.name == "normal"

    @property
    def absent_is_refused(self) -> bool:
        """Returns True if a message without this field is refused."""
        says_so = "absent is refused" in self.doc
        return says_so or (self.type == "Quat" and not self.is_optional)

    @property
    def is_optional(self) -> bool:
        """Returns True if absence does not mean 0. A vector is optional if its comment says "absent if"."""
        if self.repeated:
            return self.is_matrix and 0 in self.bound.entries  # type: ignore[operator]
        if not self.has_presence or "absent is refused" in self.doc:
            return False
        return self.type not in ("Vec3", "Quat") or re.search(r"\babsent if\b", self.doc, re.IGNORECASE) is not None


@dataclass(frozen=True)
class Member:
    """A member of a value. It has one field, or several in a `part`."""

    # As the language writes it: "sampled_ns" in Python, "sampledNs" in TypeScript, "SampledNs" in C#, "sampled" in C++
    name: str
    field: Field | None
    part: Part | None
    optional: bool  # may be empty
    wire: str  # name of the field, or of the first of the part


@dataclass(frozen=True)
class Part:
    """Several fields of a message that form a value of their own."""

    name: str
    type: str  # of the value; empty: the language writes it without a name
    doc: str
    there: str  # "first": when its first field is; "any" of them; "box": both corners, least first, or none; "always"
    members: tuple[Member, ...]


@dataclass
class Message:
    name: str
    doc: str
    sender: str  # of a frame: "server → client, unreliable, …"; else empty
    fields: tuple[Field, ...]  # by number
    values: dict[str, Any] = field(default_factory=dict, repr=False)  # its table of values.toml

    def field(self, name: str) -> Field:
        return next(one for one in self.fields if one.name == name)

    def type_name(self, language: str) -> str:
        """Of its value."""
        return str(_of(self.values.get("type", self.name), language, self.name))

    @property
    def checks(self) -> list[str]:
        """Conditions on several fields: "overruns <= steps". If one is false, its first field is refused."""
        return list(self.values.get("checks", []))

    @property
    def always(self) -> list[str]:
        """Fields that have a key in TypeScript even if they are absent."""
        return list(self.values.get("always", []))

    @property
    def in_order_of_checks(self) -> list[str]:
        """Names of fields and oneofs, in the order in which they are checked."""
        names = [one.oneof or one.name for one in self.fields]
        return list(dict.fromkeys([*self.values.get("checked_first", []), *names]))

    @property
    def oneofs(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(one.oneof for one in self.fields if one.oneof))

    def wrapper(self, name: str) -> str | None:
        """Returns the type of the value that wraps this scalar of a oneof."""
        found = self.values.get("wrappers", {}).get(name)
        return None if found is None else str(found["type"])

    def oneof(self, name: str) -> tuple[Field, ...]:
        return tuple(one for one in self.fields if one.oneof == name)

    def members(self, language: str) -> tuple[Member, ...]:
        """Returns the members in the order of the constructor's arguments, without those of a oneof."""
        parts = {part.members[0].wire: part for part in self._parts(language)}
        in_parts = {member.wire for part in parts.values() for member in part.members}
        out: list[Member] = []
        for one in self.fields:
            if one.oneof is not None:
                continue
            if one.name in parts:
                part = parts[one.name]
                out.append(Member(self._written(part.name, language), None, part, part.there != "always", one.name))
            elif one.name not in in_parts:
                out.append(self._member(one, language, self.values.get("members", {}).get(one.name)))
        for name, place in self.values.get("after", {}).items():
            place = _of(place, language, None)
            if place is None:
                continue
            moved = next(member for member in out if member.wire == name)
            out.remove(moved)
            at = 0 if place == "" else 1 + next(i for i, member in enumerate(out) if member.wire == place)
            out.insert(at, moved)
        return tuple(out)

    def required(self, language: str) -> int:
        """Returns the number of members without a default. They come first."""
        last = _of(self.values.get("required", ""), language, "")
        if last == "":
            return 0
        return 1 + next(i for i, member in enumerate(self.members(language)) if member.wire == last)

    def default(self, wire: str, language: str) -> str | None:
        """Returns the default value of a member in the given language. The default is zero if this is None."""
        found = _of(self.values.get("defaults", {}).get(wire), language, None)
        return None if found is None else str(found)

    def hint(self, wire: str, language: str) -> str | None:
        """Returns the type of a member in the given language. None: the type that follows from the field."""
        found = _of(self.values.get("types", {}).get(wire), language, None)
        return None if found is None else str(found)

    def _written(self, name: str, language: str) -> str:
        return {TYPESCRIPT: camel, CSHARP: pascal}.get(language, str)(name)

    def _member(self, one: Field, language: str, renamed: Any) -> Member:
        bare, unit = split_unit(one.name)
        if language != CPP and unit in _TIMES:
            bare = one.name  # an integer, in that unit
        name = _of(renamed, language, bare)
        optional = one.is_optional and one.name not in _of(self.values.get("plain", []), language, [])
        return Member(self._written(str(name), language), one, None, optional, one.name)

    def _in_part(self, one: Field, language: str, renamed: Any) -> Member:
        """In a part, an absent number or vector is 0."""
        member = self._member(one, language, renamed)
        return replace(member, optional=one.kind == "message" and one.type not in ("Vec3", "Quat"))

    def _parts(self, language: str) -> list[Part]:
        out = []
        for name, part in self.values.get("parts", {}).items():
            if language not in part.get("only", (CPP, PYTHON, TYPESCRIPT)):
                continue
            fields = part["fields"].items()
            members = tuple(self._in_part(self.field(wire), language, renamed) for wire, renamed in fields)
            kind = str(_of(part.get("type", ""), language, ""))
            out.append(Part(name, kind, part.get("doc", ""), part.get("there", "first"), members))
        return out


@dataclass
class Wire:
    messages: dict[str, Message]  # by name, in the order of the file
    enums: dict[str, Enum]
    cpp_headers: dict[str, list[str]]  # headers of core, and the types that they define

    @cached_property
    def field_names(self) -> dict[str, set[str]]:
        """The messages that have a field of that name."""
        out: dict[str, set[str]] = {}
        for message in self.messages.values():
            for one in message.fields:
                out.setdefault(one.name, set()).add(message.name)
        return out

    def frames(self) -> tuple[Field, ...]:
        return self.messages["Frame"].oneof("body")

    def requests(self) -> tuple[Field, ...]:
        return self.messages["Control"].oneof("op")


def _of(said: Any, language: str, otherwise: Any) -> Any:
    """Returns the entry of a language: `said` has one entry for each language, or is the same for all."""
    if said is None:
        return otherwise
    return said.get(language, otherwise) if isinstance(said, dict) else said


# ---- Reading tendon.proto ----


def _describe(proto: Path) -> descriptor_pb2.FileDescriptorProto:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "set"
        options = [f"--proto_path={proto.parent}", "--include_source_info", f"--descriptor_set_out={out}"]
        subprocess.run(["protoc", *options, proto.name], check=True)
        (file,) = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()).file
    return file


def _lines(comment: str) -> list[str]:
    return [line.removeprefix(" ").rstrip() for line in comment.strip("\n").splitlines()]


def _joined(lines: list[str]) -> str:
    """Joins the lines. Equations, which are indented, keep their own line."""
    text = " ".join(f"\n{line.strip()}\n" if line.startswith("    ") else line for line in lines if line)
    return text.replace("\n ", "\n").replace(" \n", "\n").strip()


def load(proto: Path = PROTO, values: Path = VALUES) -> Wire:
    file = _describe(proto)
    table = tomllib.loads(values.read_text())
    cpp_headers = table.pop("cpp_headers")
    comments = {tuple(place.path): place for place in file.source_code_info.location}

    def around(*path: int) -> tuple[list[str], list[str]]:
        """Returns the lines above the place and behind it."""
        place = comments.get(path)
        return (_lines(place.leading_comments), _lines(place.trailing_comments)) if place else ([], [])

    enums = {}
    for index, one in enumerate(file.enum_type):
        first = one.value[0].name
        prefix = first[: first.rindex("_") + 1]
        known = [
            EnumValue(value.name, value.number, value.name.removeprefix(prefix), _joined([*above, *behind]))
            for k, value in enumerate(one.value)
            for above, behind in [around(5, index, 2, k)]
        ]
        enums[one.name] = Enum(one.name, _joined(around(5, index)[0]), tuple(known))

    messages: dict[str, Message] = {}
    for index, one in enumerate(file.message_type):
        fields = []
        for k, each in enumerate(one.field):
            above, behind = around(4, index, 2, k)
            # The lines up to one that ends in a colon are about those fields that follow; the rest is about this field.
            heading = ""
            for at, line in enumerate(above):
                if line.endswith(":"):
                    heading, above = _joined(above[: at + 1]), above[at + 1 :]
                    break
            bound, doc = split_comment(_joined(behind))
            doc = _joined([*above, doc])
            if each.type == _MESSAGE:
                kind, type_name = "message", each.type_name.rsplit(".", 1)[1]
            elif each.type == _ENUM:
                kind, type_name = "enum", each.type_name.rsplit(".", 1)[1]
            else:
                type_name = _TYPES[each.type]
                kinds = {"double": "number", "float": "number", "string": "text", "bool": "bool", "bytes": "bytes"}
                kind = kinds.get(type_name, "integer")
            repeated = each.label == each.LABEL_REPEATED
            packed = repeated and kind in ("number", "integer", "bool", "enum")
            chosen = each.HasField("oneof_index") and not each.proto3_optional
            fields.append(
                Field(
                    message=one.name,
                    name=each.name,
                    number=each.number,
                    type=type_name,
                    kind=kind,
                    repeated=repeated,
                    packed=packed,
                    explicit=each.proto3_optional,
                    oneof=one.oneof_decl[each.oneof_index].name if chosen else None,
                    doc=doc,
                    bound=bound,
                    heading=heading,
                )
            )
        fields.sort(key=lambda each: each.number)
        messages[one.name] = Message(one.name, _joined(around(4, index)[0]), "", tuple(fields), table.get(one.name, {}))
    wire = Wire(messages, enums, cpp_headers)
    for frame in wire.frames():
        messages[frame.type].sender = frame.doc
    unknown = set(table) - set(messages)
    if unknown:
        raise ValueError(f"values.toml tells of messages that tendon.proto does not have: {sorted(unknown)}")
    return wire
