# SPDX-License-Identifier: Apache-2.0
"""Writes the messages of the C# client, which can be read, checked and written without allocating memory."""

from __future__ import annotations

import re

from model import CSHARP, Enum, Field, Member, Message, Wire, pascal
from prose import Words, capitalized, wrapped

FOLDER = "clients/csharp/package/Runtime/Wire/Generated"

_HEAD = """// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
"""

# These messages have hand-written code, or belong to features that the client does not support (columns and fields). The
# client treats the frames and requests of these features as unknown.
_LEFT_OUT = {
    *("Datagram", "Vec3", "Quat", "DeviceStates"),
    *("OfferField", "UseField", "DropField", "FieldMaterial", "FieldFixture", "FieldBrick", "FieldStatus", "FieldPose"),
}

# An answer to one of these messages belongs to the session in which it was received.
_RECEIVED_IN = {"DeviceState"}

# The types of scalars, which are also the names of functions of ProtoReader and ProtoWriter.
_SCALARS = {
    "double": ("double", "Double"),
    "uint32": ("uint", "UInt32"),
    "uint64": ("ulong", "UInt64"),
    "sint64": ("long", "SInt64"),
    "sfixed64": ("long", "Fixed64"),
    "fixed32": ("uint", "Fixed32"),
    "bool": ("bool", "Bool"),
    "string": ("string", "Text"),
}
_WIRE_TYPES = {"double": 1, "sfixed64": 1, "fixed32": 5, "string": 2, "bytes": 2}


def files(wire: Wire) -> dict[str, str]:
    """Returns the text of each file, by its path in the repository."""
    messages = [message for message in wire.messages.values() if message.name not in _LEFT_OUT]
    fields = {field.type for message in messages for field in message.fields}
    out = {f"{FOLDER}/Enums.cs": _enums(wire, [enum for enum in wire.enums.values() if enum.name in fields])}
    for file, wanted in _groups(wire, messages).items():
        body = "\n".join(line for message in wanted for line in _Class(wire, message).lines())
        out[f"{FOLDER}/{file}.cs"] = (
            f"{_HEAD}using System.Collections.Generic;\n\nnamespace Tendon {{\n{body.rstrip()}\n}}\n"
        )
    return out


def _groups(wire: Wire, messages: list[Message]) -> dict[str, list[Message]]:
    """Divides the messages into one file for the handshake, one for requests and one for all others."""
    requests = _reachable(wire, "Control") | _reachable(wire, "ControlAck")
    handshake = _reachable(wire, "Hello") | _reachable(wire, "Answer")
    out: dict[str, list[Message]] = {"Frames": [], "Requests": [], "Handshake": []}
    for message in messages:
        file = "Requests" if message.name in requests else "Handshake" if message.name in handshake else "Frames"
        out[file].append(message)
    return out


def _reachable(wire: Wire, name: str) -> set[str]:
    inner = {field.type for field in wire.messages[name].fields if field.kind == "message"} - _LEFT_OUT
    return {name}.union(*(_reachable(wire, one) for one in inner)) if inner else {name}


def _comment(text: str, indent: str) -> list[str]:
    if not text:
        return []
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return wrapped(f"<summary>{capitalized(text)}</summary>", indent, "/// ")


def _enums(wire: Wire, enums: list[Enum]) -> str:
    words = Words(wire, CSHARP, "null")
    lines = []
    for enum in enums:
        lines += [*_comment(words.say(enum.doc, "Frame"), "  "), f"  public enum {enum.name} {{"]
        for value in enum.known:
            lines += _comment(words.say(value.doc, "Frame"), "    ")
            lines.append(f"    {pascal(value.short)} = {value.number},")
        lines += ["  }", ""]
    body = "\n".join(lines).rstrip()
    return f"{_HEAD}namespace Tendon {{\n{body}\n}}\n"


def _is_vector(field: Field) -> bool:
    return field.type in ("Vec3", "Quat")


def _is_part(field: Field) -> bool:
    """Returns True if the field is a message that has an object of its own, and a flag for its presence."""
    return field.kind == "message" and not field.repeated and not _is_vector(field)


def _number(text: str) -> str:
    return text.replace("2^60", "Bounds.Time")


class _Class:
    """The class of one message."""

    def __init__(self, wire: Wire, message: Message) -> None:
        self._wire = wire
        self._message = message
        self._words = Words(wire, CSHARP, "null")
        known = [field for field in message.fields if _is_vector(field) or field.type not in _LEFT_OUT]
        self._fields = known
        members = {member.wire: member for member in message.members(CSHARP)}
        self._members = {
            field.name: members.get(field.name) or Member(pascal(field.name), field, None, False, field.name)
            for field in known
        }

    def _name(self, field: Field) -> str:
        return self._members[field.name].name

    def lines(self) -> list[str]:
        out = _comment(self._words.of_message(self._message), "  ")
        out.append(f"  public sealed class {self._message.name} {{")
        for oneof in self._message.oneofs:
            out += self._cases(oneof)
        for field in self._fields:
            out += self._declared(field)
        if self._message.name in _RECEIVED_IN:
            out.append("    /// <summary>The session in which it was received. It is copied, but not on the wire.</summary>")
            out.append("    internal object Session;")
        for title, body in (
            ("public void Clear()", self._clear()),
            (f"public void CopyFrom({self._message.name} other)", self._copy()),
            ("internal string Objection()", self._refused()),
            ("internal void Read(ref ProtoReader r)", self._read()),
            ("internal void Write(ref ProtoWriter w)", self._write()),
        ):
            if "CopyFrom" in title and self._message.oneofs:
                continue  # is never copied
            if "Objection" in title:
                out += ["", "    /// <summary>The name of the first field that is out of bounds, or null.</summary>"]
            else:
                out.append("")
            out += [f"    {title} {{", *(f"      {line}" for line in body), "    }"]
        return [*out, "  }", ""]

    # ---- Values ----

    def _cases(self, oneof: str) -> list[str]:
        fields = [field for field in self._fields if field.oneof == oneof]
        kind = f"{pascal(oneof)}Case"
        cases = ["None = 0", *(f"{pascal(field.name)} = {field.number}" for field in fields)]
        return [
            "    /// <summary>The member that is present.</summary>",
            f"    public enum {kind} {{",
            *(f"      {case}," for case in cases),
            "    }",
            "",
            f"    public {kind} {pascal(oneof)};",
        ]

    def _type(self, field: Field) -> str:
        if field.repeated:
            if field.kind == "number":
                return "Reals"
            if field.kind == "integer":
                return "Counts"
            return f"List<{'string' if field.kind == 'text' else field.type}>"
        if field.type == "bytes":
            return "byte[]"
        return _SCALARS[field.type][0] if field.type in _SCALARS else field.type

    def _is_nullable(self, field: Field) -> bool:
        return field.explicit or (_is_vector(field) and field.is_optional)

    def _declared(self, field: Field) -> list[str]:
        out = []
        if field.heading:
            out += wrapped(self._words.say(field.heading, self._message.name), "    ", "// ")
        kind, name = self._type(field), self._name(field)
        absent = "null" if self._is_nullable(field) else "absent" if _is_part(field) or field.is_matrix else None
        out += _comment(self._words.of_field(field, absent), "    ")
        if field.repeated:
            most = max(field.bound.entries) if isinstance(field.bound.entries, (tuple, frozenset)) else 0
            size = str(most) if kind in ("Reals", "Counts") else ""
            out.append(f"    public readonly {kind} {name} = new {kind}({size});")
        elif _is_part(field):
            if field.oneof is None:
                out.append(f"    public bool Has{name};")
            out.append(f"    public readonly {kind} {name} = new {kind}();")
        else:
            value = ' = ""' if kind == "string" else ""
            out.append(f"    public {kind}{'?' if self._is_nullable(field) else ''} {name}{value};")
        return out

    def _clear(self) -> list[str]:
        out = [f"{pascal(oneof)} = {pascal(oneof)}Case.None;" for oneof in self._message.oneofs]
        for field in self._fields:
            name = self._name(field)
            if field.oneof is not None:
                continue
            if field.repeated:
                out.append(f"{name}.Clear();")
            elif _is_part(field):
                out += [f"Has{name} = false;", f"{name}.Clear();"]
            elif self._is_nullable(field) or field.type == "bytes":
                out.append(f"{name} = null;")
            else:
                out.append(f"{name} = {self._zero(field)};")
        if self._message.name in _RECEIVED_IN:
            out.append("Session = null;")
        return out

    def _zero(self, field: Field) -> str:
        if field.type == "string":
            return '""'
        if field.type == "bool":
            return "false"
        return f"default({field.type})" if _is_vector(field) or field.kind == "enum" else "0"

    def _copy(self) -> list[str]:
        out = []
        for field in self._fields:
            name = self._name(field)
            if field.repeated and field.kind in ("text", "message"):
                out += [f"{name}.Clear();", f"{name}.AddRange(other.{name});"]
            elif field.repeated:
                out.append(f"{name}.CopyFrom(other.{name});")
            elif _is_part(field):
                out += [f"Has{name} = other.Has{name};", f"{name}.CopyFrom(other.{name});"]
            else:
                out.append(f"{name} = other.{name};")
        if self._message.name in _RECEIVED_IN:
            out.append("Session = other.Session;")
        return out

    # ---- Bounds ----

    def _refused(self) -> list[str]:
        out: list[str] = []
        fields = {field.name: field for field in self._fields}
        for place in self._message.in_order_of_checks:
            if place in self._message.oneofs:
                if place in self._message.values.get("checked_first", []):
                    out.append(f'if ({pascal(place)} == {pascal(place)}Case.None) return "{place}";')
                continue
            if place not in fields:
                continue
            field = fields[place]
            name = self._name(field)
            if _is_part(field):
                out += self._refused_part(field, f"Has{name}")
            elif bad := self._bad(field):
                out.append(f'if ({bad}) return "{place}";')
            for check in self._message.checks:
                if re.findall(r"[a-z]\w+", check.replace("sum(", "("))[0] == place:
                    terms = re.sub(r"sum\((\w+)\)", r"\1.Sum()", check).replace(" or ", " || ")
                    names = re.compile(rf"\b(?:{'|'.join(fields)})\b")
                    terms = names.sub(lambda one: self._name(fields[one[0]]), terms)
                    out.append(f'if (!({terms})) return "{place}";')
        for part in self._message.values.get("parts", {}).values():
            if part.get("there") == "box":
                least, most = (self._name(fields[name]) for name in part["fields"])
                out.append(f'if (!Bounds.IsBox({least}, {most})) return "{next(iter(part["fields"]))}";')
        for field in self._fields:
            if field.oneof is None:
                continue
            case = f"{pascal(field.oneof)} == {pascal(field.oneof)}Case.{pascal(field.name)}"
            if field.kind == "message":
                out += self._refused_part(field, case)
            elif bad := self._bad(field):
                out.append(f'if ({case} && {bad}) return "{field.name}";')
        return [*out, "return null;"]

    def _refused_part(self, field: Field, there: str) -> list[str]:
        name = self._name(field)
        local = name[:1].lower() + name[1:]
        out = [f'if (!{there}) return "{field.name}";'] if field.absent_is_refused else []
        out.append(f"string {local} = {there} ? {name}.Objection() : null;")
        return [*out, f'if ({local} != null) return "{field.name}." + {local};']

    def _bad(self, field: Field) -> str:
        """Returns the condition that a field is out of bounds. Empty: there is no bound."""
        bound, name = field.bound, self._name(field)
        if field.is_matrix:
            return f"{f'{name}.Count > 0 && ' if field.is_optional else ''}!Bounds.IsMatrix({name})"
        if field.repeated:
            if not isinstance(bound.entries, tuple):
                return ""
            fewest, most = bound.entries
            if field.kind == "text":
                assert bound.bytes
                return f"!Bounds.AreTexts({name}, {most}, {bound.bytes.most})"
            if field.kind == "message":
                least = f"{name}.Count < {fewest} || " if fewest else ""
                return f"{least}{name}.Count > {most} || {name}.Exists(one => one.Objection() != null)"
            if field.kind == "number":
                assert bound.value
                return f"!Bounds.AreNumbers({name}, {fewest}, {most}, {bound.value.least}, {bound.value.most})"
            return f"{name}.Count > {most}"
        if field.type == "Quat":
            optional = f"{name}.HasValue && !Bounds.IsRotation({name}.Value)"
            return optional if field.is_optional else f"!Bounds.IsRotation({name})"
        if field.type == "Vec3":
            if field.is_unit_vector:
                return f"!Bounds.IsNormal({name})"
            return f"!Bounds.IsVec3({name} ?? default(Vec3))" if field.is_optional else f"!Bounds.IsVec3({name})"
        if field.kind == "enum":
            numbers = sorted(value.number for value in self._wire.enums[field.type].known)
            assert numbers == list(range(numbers[0], numbers[-1] + 1))
            return f"(int){name} < {numbers[0]} || (int){name} > {numbers[-1]}"
        if field.kind == "text":
            assert bound.bytes
            return f"!Bounds.IsText({name}, {bound.bytes.most})"
        if bound.value is None:
            return ""
        there, value = (f"{name}.HasValue && ", f"{name}.Value") if field.explicit else ("", name)
        return there + self._outside(field, value)

    def _outside(self, field: Field, value: str) -> str:
        bound = field.bound.value
        assert bound is not None
        least, most = _number(bound.least), bound.most and _number(bound.most)
        unsigned = _SCALARS[field.type][0] in ("uint", "ulong")
        below = "" if unsigned and least == "0" else f"{value} < {least}"
        if most is None:
            return below
        if field.kind == "integer":
            return " || ".join(part for part in (below, f"{value} > {most}") if part)
        if bound.beyond:
            return f"!({value} > {least} && {value} <= {most})"
        also = (("double.PositiveInfinity", bound.infinity), ("0", bound.zero))
        others = [f"{value} != {other}" for other, allowed in also if allowed]
        return " && ".join([*others, f"!({value} >= {least} && {value} <= {most})"])

    # ---- Bytes ----

    def _tag(self, field: Field) -> int:
        kind = 2 if field.kind == "message" or field.packed else _WIRE_TYPES.get(field.type, 0)
        return field.number << 3 | kind

    def _read(self) -> list[str]:
        out = ["while (r.Next()) {", "  switch (r.Tag) {"]
        for field in self._fields:
            labels = [f"    case {self._tag(field)}:"]
            if field.packed:
                labels.append(f"    case {field.number << 3 | (1 if field.kind == 'number' else 0)}:")
            out += [*labels, *(f"      {line}" for line in self._read_one(field)), "      break;"]
        return [*out, "    default:", "      r.Skip();", "      break;", "  }", "}"]

    def _read_one(self, field: Field) -> list[str]:
        name, kind = self._name(field), field.type
        if field.repeated:
            if field.kind == "message":
                return [
                    f"var {kind[:1].lower() + kind[1:]} = new {kind}();",
                    *self._inside(kind[:1].lower() + kind[1:]),
                    f"{name}.Add({kind[:1].lower() + kind[1:]});",
                ]
            return [f"{name}.Add(r.Text());"] if field.kind == "text" else [f"r.Read({name});"]
        if field.oneof is not None:
            case = f"{pascal(field.oneof)}Case.{pascal(field.name)}"
            if field.kind != "message":
                return [f"{pascal(field.oneof)} = {case};", f"{name} = r.{_SCALARS[kind][1]}();"]
            clear = f"if ({pascal(field.oneof)} != {case}) {name}.Clear();"
            return [clear, f"{pascal(field.oneof)} = {case};", *self._inside(name)]
        if _is_vector(field):
            return [f"{name} = r.{kind}({name}{f' ?? default({kind})' if self._is_nullable(field) else ''});"]
        if field.kind == "message":
            return [f"Has{name} = true;", *self._inside(name)]
        if field.kind == "enum":
            return [f"{name} = ({kind})(int)r.UInt32();"]
        return [f"{name} = r.{_SCALARS[kind][1]}();"]

    def _inside(self, value: str) -> list[str]:
        return ["{", "  int end = r.Enter();", f"  {value}.Read(ref r);", "  r.Leave(end);", "}"]

    def _write(self) -> list[str]:
        return [line for field in self._fields for line in self._write_one(field)]

    def _write_one(self, field: Field) -> list[str]:
        name, tag = self._name(field), self._tag(field)
        most = field.bound.entries[1] if isinstance(field.bound.entries, tuple) else 0
        text = field.bound.bytes.most if field.bound.bytes else ""
        if field.repeated and field.kind == "text":
            return [f"w.Texts({tag}, {name}, {most}, {text});"]
        if field.repeated and field.kind == "message":
            return self._within(f"for (int i = 0; i < {name}.Count && i < {most}; ++i)", tag, f"{name}[i]")
        if field.repeated:
            return [f"w.Write({tag}, {name});"]
        if field.oneof is not None:
            there = f"if ({pascal(field.oneof)} == {pascal(field.oneof)}Case.{pascal(field.name)})"
            if field.kind == "message":
                return self._within(there, tag, name)
            return [f"{there} w.Present{_SCALARS[field.type][1]}({tag}, {name});"]
        if _is_part(field):
            return self._within(f"if (Has{name})", tag, name)
        if self._is_nullable(field):
            function = field.type if _is_vector(field) else _SCALARS[field.type][1]
            return [f"if ({name}.HasValue) w.Present{function}({tag}, {name}.Value);"]
        if field.kind == "enum":
            return [f"w.UInt32({tag}, (uint){name});"]
        if field.kind == "text":
            return [f"w.Text({tag}, {name}, {text});"]
        return [f"w.{field.type if _is_vector(field) else _SCALARS[field.type][1]}({tag}, {name});"]

    def _within(self, head: str, tag: int, value: str) -> list[str]:
        return [f"{head} {{", f"  int begin = w.Begin({tag});", f"  {value}.Write(ref w);", "  w.End(begin);", "}"]
