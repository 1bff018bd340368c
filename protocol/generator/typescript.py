# SPDX-License-Identifier: Apache-2.0
"""Writes the values and the codec of the TypeScript client."""

from __future__ import annotations

import re

from model import TYPESCRIPT, Enum, Field, Member, Message, Part, Wire, camel
from prose import WIDTH, Words, capitalized, wrapped

FOLDER = "clients/typescript/src/gen"

_HEAD = """// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
// {doc}
"""

# These have hand-written code: the messages around frames, and vectors.
_BY_HAND = {"Datagram", "Frame", "Vec3", "Quat", "Control", "Answer", "DeviceStates"}

# The functions of bounds.ts and fields.ts.
_CHECKS = (
    *("areCounts", "areMessages", "areNumbers", "areTexts"),
    *("isBox", "isEnum", "isNormal", "isRotation", "isStiffness", "isText", "isVec3", "isWhole", "isWithin", "sum"),
)
_FIELDS = ("clip", "clipAll", "padded", "readQuat", "readVec3", "writeQuat", "writeVec3")


def files(wire: Wire) -> dict[str, str]:
    """Returns the text of each file, by its path in the repository."""
    return {f"{FOLDER}/messages.ts": _Values(wire).text(), f"{FOLDER}/codec.ts": _Codec(wire).text()}


def _messages(wire: Wire) -> list[Message]:
    return [message for message in wire.messages.values() if message.name not in _BY_HAND]


def _is_wide(field: Field) -> bool:
    """Returns True if the value is a bigint."""
    return field.type in ("uint64", "sfixed64", "sint64")


def _is_vector(field: Field) -> bool:
    return field.type in ("Vec3", "Quat")


def _is_own(enum: Enum) -> bool:
    """Returns True if the values have a prefix that protobuf-es does not remove, since it is not the enum's name."""
    return enum.prefix != re.sub(r"(?<!^)(?=[A-Z])", "_", enum.name).upper() + "_"


def _number(text: str, wide: bool) -> str:
    """Writes a bound in TypeScript: kMaxTime, 10_000_000, 1e12."""
    if "^" in text:
        return text.replace("2^60", "kMaxTime")
    if wide or len(text) > 4:
        return f"{int(text):_}{'n' if wide else ''}" if text.isdigit() else text
    return text


def _call(head: str, arguments: list[str], tail: str, indent: str = "") -> list[str]:
    """Writes a call on one line, or with one line for each argument."""
    line = f"{indent}{head}{' ' if head[-1] == '{' else ''}{', '.join(arguments)}{' ' if head[-1] == '{' else ''}{tail}"
    if len(line) <= WIDTH:
        return [line]
    lines = [line for argument in arguments for line in _split(f"{argument},", f"{indent}  ")]
    return [f"{indent}{head}", *lines, f"{indent}{tail}"]


def _split(entry: str, indent: str) -> list[str]:
    """Splits an entry of an object that is too long for one line."""
    opening = entry.find("{ ")
    if len(indent + entry) <= WIDTH or opening < 0:
        return [f"{indent}{entry}"]
    depth, inner, start = 0, [], opening + 2
    for at in range(opening, len(entry)):
        depth += (entry[at] in "{([") - (entry[at] in "})]")
        if depth == 0:
            inner.append(entry[start : at - 1])
            break
        if depth == 1 and entry[at] == ",":
            inner.append(entry[start:at])
            start = at + 2
    lines = [line for one in inner for line in _split(f"{one},", f"{indent}  ")]
    return [f"{indent}{entry[: opening + 1]}", *lines, f"{indent}{entry[at:]}"]


def _comment(text: str, indent: str) -> list[str]:
    if not text:
        return []
    if re.match(r"[a-z]+[,:;]? ", text) and not text.startswith(("rad", "m, ", "s, ")):
        text = capitalized(text)
    line = f"{indent}/** {text} */"
    if len(line) <= WIDTH and "\n" not in text:
        return [line]
    return [f"{indent}/**", *wrapped(text, indent, " * "), f"{indent} */"]


class _Values:
    """Enums and interfaces."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._words = Words(wire, TYPESCRIPT, "Absent")
        self._lines: list[str] = []

    def text(self) -> str:
        shared = sorted(enum.name for enum in self._wire.enums.values() if not _is_own(enum))
        for enum in self._wire.enums.values():
            if _is_own(enum):
                self._enum(enum)
        for message in _messages(self._wire):
            for part in (member.part for member in message.members(TYPESCRIPT)):
                if part is not None and part.type:
                    self._interface(part.type, part.doc, list(part.members), len(part.members), message)
            for field in message.fields:
                if name := message.wrapper(field.name):
                    doc = message.values["wrappers"][field.name]["doc"]
                    self._interface(name, doc, [Member(field.name, field, None, False, field.name)], 1, message)
            members = list(message.members(TYPESCRIPT))
            required = message.required(TYPESCRIPT)
            self._interface(
                message.type_name(TYPESCRIPT), self._words.of_message(message), members, required, message
            )
        self._unions()
        head = [
            _HEAD.format(doc="The messages of tendon.proto as plain values.").rstrip(),
            *_call("import {", shared, '} from "./tendon_pb.js";'),
            'import type { Quat, Stiffness, Vec3 } from "../messages.js";',
            'import type { Nanoseconds } from "../time.js";',
            "",
            *_call("export {", shared, "};"),
        ]
        return "\n".join(head + self._lines) + "\n"

    def _enum(self, enum: Enum) -> None:
        self._lines += ["", *_comment(self._words.say(enum.doc, "Frame"), ""), f"export enum {enum.name} {{"]
        for value in enum.known:
            self._lines += _comment(self._words.say(value.doc, "Frame"), "  ")
            self._lines.append(f"  {value.short} = {value.number},")
        self._lines.append("}")

    def _interface(self, name: str, doc: str, members: list[Member], required: int, message: Message) -> None:
        own = name == message.type_name(TYPESCRIPT)
        self._lines += ["", *_comment(doc, ""), f"export interface {name} {{"]
        for index, member in enumerate(members):
            field = member.field
            if field is not None and field.heading and own:
                self._lines += wrapped(self._words.say(field.heading, message.name), "  ", "// ")
            kind = self._type(member)
            optional = member.optional or index >= required
            always = member.wire in message.always
            self._lines += _comment(self._words.of_member(member, None if not own and not optional else "absent"), "  ")
            mark, also = ("?" if optional and not always else ""), (" | undefined" if optional else "")
            self._lines.append(f"  readonly {member.name}{mark}: {kind}{also};")
        for oneof in message.oneofs if own else ():
            cases = [message.wrapper(field.name) or field.type for field in message.oneof(oneof)]
            self._lines.append(f"  readonly {oneof}: {' | '.join(cases)};")
        self._lines.append("}")

    def _type(self, member: Member) -> str:
        if member.part is not None:
            if member.part.type:
                return member.part.type
            inner = [f"readonly {one.name}: {self._type(one)}" for one in member.part.members]
            return f"{{ {'; '.join(inner)} }}"
        field = member.field
        assert field is not None
        if field.is_matrix:
            return "Stiffness"
        if field.kind == "integer":
            kind = ("Nanoseconds" if field.is_time else "bigint") if _is_wide(field) else "number"
        elif field.kind == "message" and not _is_vector(field):
            kind = self._wire.messages[field.type].type_name(TYPESCRIPT)
        else:
            kind = {"number": "number", "bool": "boolean", "text": "string", "bytes": "Uint8Array"}.get(field.kind, field.type)
        return f"readonly {kind}[]" if field.repeated else kind

    def _unions(self) -> None:
        self._lines += ["", "/** Reliable: the names of the fields of Control. */", "export type Request ="]
        for field in self._wire.requests():
            message = self._wire.messages[field.type]
            self._lines.append(f'  | ({{ readonly kind: "{camel(field.name)}" }} & {message.type_name(TYPESCRIPT)})')
        self._lines[-1] += ";"
        self._lines += ["", "/** Every frame but Control. */", "export type PlainFrame ="]
        for field in self._wire.frames():
            if field.type not in _BY_HAND:
                kind = _kind_of(self._wire, field)
                self._lines.append(f'  | {{ readonly kind: "{kind}"; readonly value: {field.type} }}')
        self._lines[-1] += ";"


def _kind_of(wire: Wire, field: Field) -> str:
    """Returns the name of a frame."""
    renamed = wire.messages["Frame"].values.get("members", {}).get(field.name, {})
    return str(renamed.get(TYPESCRIPT, camel(field.name)))


class _Codec:
    """Three functions for each message: check the bounds, read, write."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._lines: list[str] = []

    def text(self) -> str:
        for message in _messages(self._wire):
            self._refused(message)
            self._read(message)
            self._write(message)
        self._choices()
        body = "\n".join(self._lines)

        def used(names: list[str] | tuple[str, ...]) -> list[str]:
            return [name for name in names if re.search(rf"(?<!\.)\b{name}\b(?!:)", body)]

        types = {message.type_name(TYPESCRIPT) for message in _messages(self._wire)} | {"PlainFrame", "Request"}
        named = [name for name in sorted(types) if re.search(rf"(?<![.\w]){name}\b", body)]
        head = [
            _HEAD.format(doc="The messages of tendon.proto: bounds, values to protobuf and back.").rstrip(),
            'import { create } from "@bufbuild/protobuf";',
            *_call("import {", used(_CHECKS), '} from "../bounds.js";'),
            *_call("import {", used(_FIELDS), '} from "../fields.js";'),
            'import { kMaxTime } from "../limits.js";',
            *_call("import type {", named, '} from "./messages.js";'),
            'import * as pb from "./tendon_pb.js";',
        ]
        return "\n".join(head) + "\n" + body + "\n"

    # ---- Bounds ----

    def _refused(self, message: Message) -> None:
        name = message.name
        checks: list[str] = []
        for place in message.in_order_of_checks:
            if place in message.oneofs:
                checks.append(f'  if (m.{camel(place)}.case === undefined) return "{place}";')
                continue
            field = message.field(place)
            value = f"m.{camel(place)}"
            if field.kind == "message" and not field.repeated and not _is_vector(field):
                checks += self._refused_inner(field, value, camel(place))
            elif bad := self._bad(field, value):
                checks.append(f'  if ({bad}) return "{place}";')
            for check in message.checks:
                if re.findall(r"[a-z]\w+", check.replace("sum(", "("))[0] == place:
                    names = re.compile(r"\b(?!or\b|sum\b)[a-z]\w+")
                    terms = names.sub(lambda found: f"m.{camel(found[0])}", check).replace(" or ", " || ")
                    checks.append(f'  if (!({terms.replace("==", "===")})) return "{place}";')
        for part in (member.part for member in message.members(TYPESCRIPT)):
            if part is not None and part.there == "box":
                corners = ", ".join(f"m.{camel(member.wire)}" for member in part.members)
                checks.append(f'  if (!isBox({corners})) return "{part.members[0].wire}";')
        for oneof in message.oneofs:
            checks += self._refused_cases(message, oneof)
        argument = "m" if checks else "_"
        self._lines += ["", "/** Returns the name of the first field that is out of bounds. */"]
        self._lines.append(f"export function refused{name}({argument}: pb.{name}): string | undefined {{")
        self._lines += [line for check in checks for line in _broken(check)]
        self._lines += ["  return undefined;", "}"]

    def _refused_inner(self, field: Field, value: str, name: str) -> list[str]:
        out = [f'  if (!{value}) return "{field.name}";'] if field.absent_is_refused else []
        there = "" if field.absent_is_refused else f"{value} && "
        out.append(f"  const {name} = {there}refused{field.type}({value});")
        return [*out, f"  if ({name} !== undefined) return `{field.name}.${{{name}}}`;"]

    def _refused_cases(self, message: Message, oneof: str) -> list[str]:
        out = []
        one = f"m.{camel(oneof)}"
        for field in message.oneof(oneof):
            if field.kind == "message":
                name = camel(field.name)
                out.append(f'  const {name} = {one}.case === "{name}" ? refused{field.type}({one}.value) : undefined;')
                out.append(f"  if ({name} !== undefined) return `{field.name}.${{{name}}}`;")
            elif bad := self._bad(field, f"{one}.value", False):
                out.append(f'  if ({one}.case === "{camel(field.name)}" && {bad}) return "{field.name}";')
        return out

    def _bad(self, field: Field, value: str, in_oneof: bool = True) -> str:
        """Returns the condition that a field is out of bounds. Empty: there is no bound."""
        bound = field.bound
        if field.is_matrix:
            return f"{value}.length > 0 && !isStiffness({value})" if field.is_optional else f"!isStiffness({value})"
        if field.repeated:
            assert isinstance(bound.entries, tuple)
            fewest, most = bound.entries
            if field.kind == "text":
                assert bound.bytes
                return f"!areTexts({value}, {fewest}, {most}, {bound.bytes.most})"
            if field.kind == "message":
                return f"!areMessages({value}, {fewest}, {most}, refused{field.type})"
            if field.kind == "number":
                assert bound.value
                return f"!areNumbers({value}, {fewest}, {most}, {bound.value.least}, {bound.value.most})"
            return f"!areCounts({value}, {fewest}, {most})"
        if field.type == "Quat":
            return f"{value} && !isRotation({value})" if field.is_optional else f"!{value} || !isRotation({value})"
        if field.type == "Vec3":
            return f"!isNormal({value})" if field.is_unit_vector else f"{value} && !isVec3({value})"
        if field.kind == "enum":
            zero = any(one.number == 0 for one in self._wire.enums[field.type].known)
            return f"{f'{value} !== 0 && ' if zero else ''}!isEnum({value}, pb.{field.type}Schema)"
        if field.kind == "text":
            assert bound.bytes
            return f"!isText({value}, {bound.bytes.most})"
        if field.kind == "bytes":
            least, most = field.size
            if least == most:
                return f"{value}.length !== {most}"
            below = f"{value}.length < {least} || " if least > 0 else ""
            return f"{below}{value}.length > {most}"
        if bound.value is None:
            return ""
        there = f"{value} !== undefined && " if field.explicit else ""
        return there + self._outside(field, value)

    def _outside(self, field: Field, value: str) -> str:
        bound = field.bound.value
        assert bound is not None
        least = _number(bound.least, _is_wide(field))
        most = None if bound.most is None else _number(bound.most, _is_wide(field))
        if most is None:
            return f"{value} < {least}"
        if _is_wide(field):
            below = "" if bound.least == "0" else f"{value} < {least} || "
            return f"{below}{value} > {most}"
        if field.kind == "integer":
            return f"!isWhole({value}, {least}, {most})"
        if bound.beyond:
            return f"!({value} > {least} && {value} <= {most})"
        others = [f"{value} !== {other}" for other, also in (("Infinity", bound.infinity), ("0", bound.zero)) if also]
        return " && ".join([*others, f"!isWithin({value}, {least}, {most})"])

    # ---- Reading ----

    def _read(self, message: Message) -> None:
        required = message.required(TYPESCRIPT)
        entries = []
        for index, member in enumerate(message.members(TYPESCRIPT)):
            if member.part is not None:
                entries.append(self._read_part(member, member.part, member.wire in message.always))
                continue
            field = member.field
            assert field is not None
            source = f"m.{camel(field.name)}"
            value = self._value(field, source)
            if member.wire in message.always:
                entries.append(f"{member.name}: {source} && {value}")
            elif member.optional or index >= required:
                entries.append(f"...({self._is_there(field, source)} && {{ {member.name}: {value} }})")
            else:
                entries.append(f"{member.name}: {value}")
        for oneof in message.oneofs:
            entries.append(f"{oneof}: {self._read_oneof(message, oneof)}")
        entries.sort(key=lambda entry: entry.startswith("..."))  # a spread is faster at the end
        head = f"export const read{message.name} = (m: pb.{message.name}): {message.type_name(TYPESCRIPT)} => ({{"
        self._lines += ["", *_call(head, entries, "});")]

    def _value(self, field: Field, source: str) -> str:
        """Returns an expression for the value of a field that is there."""
        if field.repeated:
            return f"{source}.map(read{field.type})" if field.kind == "message" else source
        if _is_vector(field):
            return f"read{field.type}({source})"
        if field.kind == "message":
            return f"read{field.type}({source}{'!' if field.absent_is_refused else ''})"
        if field.kind == "enum" and _is_own(self._wire.enums[field.type]):
            return f"{source} as number"
        return source

    def _is_there(self, field: Field, source: str) -> str:
        if field.repeated:
            return f"{source}.length > 0"
        if field.kind == "message":
            return source
        if field.explicit:
            infinity = field.bound.value is not None and field.bound.value.infinity  # is the same as absent
            return f"{source} !== undefined{f' && {source} !== Infinity' if infinity else ''}"
        if field.kind == "bool":
            return source
        zero = {"text": '""'}.get(field.kind, "0n" if _is_wide(field) else "0")
        return f"{source} !== {zero}"

    def _read_part(self, member: Member, part: Part, always: bool) -> str:
        sources = [f"m.{camel(one.wire)}" for one in part.members]
        fields = [one.field for one in part.members if one.field is not None]
        inner = []
        for one, field, source in zip(part.members, fields, sources):
            if one.optional:
                inner.append(f"...({source} && {{ {one.name}: {self._value(field, source)} }})")
            elif field.repeated and source != sources[0]:
                inner.append(f"{one.name}: padded({source}, {sources[0]}.length)")
            elif field.explicit and source != sources[0]:
                inner.append(f"{one.name}: {source} ?? 0")
            else:
                inner.append(f"{one.name}: {self._value(field, source)}")
        value = f"{{ {', '.join(inner)} }}"
        if part.there == "box":
            there = " && ".join(sources)
        elif part.there == "any":
            there = f"({' || '.join(sources)})"
        else:
            there = self._is_there(fields[0], sources[0])
        return f"{member.name}: {there} && {value}" if always else f"...({there} && {{ {member.name}: {value} }})"

    def _read_oneof(self, message: Message, oneof: str) -> str:
        """The cases are messages, and a number as the last one."""
        one, out = f"m.{camel(oneof)}", ""
        for field in sorted(message.oneof(oneof), key=lambda field: field.kind != "message"):
            if field.kind == "message":
                out += f'{one}.case === "{camel(field.name)}" ? read{field.type}({one}.value) : '
            else:
                out += f"{{ {camel(field.name)}: {one}.value ?? 0 }}"
        return out

    # ---- Writing ----

    def _write(self, message: Message) -> None:
        required = message.required(TYPESCRIPT)
        entries = []
        for index, member in enumerate(message.members(TYPESCRIPT)):
            value = f"value.{member.name}"
            if member.part is not None:
                inner = ", ".join(
                    self._written(one.field, f"{value}.{one.name}", one.optional, False)
                    for one in member.part.members
                    if one.field is not None
                )
                entries.append(f"...({value} && {{ {inner} }})")
                continue
            assert member.field is not None
            entries.append(self._written(member.field, value, member.optional, index >= required))
        for oneof in message.oneofs:
            entries.append(f"{camel(oneof)}: {self._written_oneof(message, oneof)}")
        head = f"export const write{message.name} = (value: {message.type_name(TYPESCRIPT)}): pb.{message.name} =>"
        self._lines += ["", head, *_call(f"create(pb.{message.name}Schema, {{", entries, "});", "  ")]

    def _written(self, field: Field, value: str, optional: bool, may_be_absent: bool) -> str:
        name, most = camel(field.name), None
        if isinstance(field.bound.entries, tuple):
            most = field.bound.entries[1]
        listed = f"({value} ?? [])" if may_be_absent and not optional else value
        if field.is_matrix:
            told = f"[...{value}]"
        elif field.repeated and field.kind == "text":
            assert field.bound.bytes
            told = f"clipAll({listed.strip('()')}, {most}, {field.bound.bytes.most})"
        elif field.repeated and field.kind == "message":
            told = f"{listed}.slice(0, {most}).map(write{field.type})"
        elif field.repeated:
            told = f"[...{listed}]"
        elif field.kind == "message":
            told = f"write{field.type}({value})"
        elif field.kind == "text":
            assert field.bound.bytes
            told = f"""clip({value}{' ?? ""' if may_be_absent else ''}, {field.bound.bytes.most})"""
        elif field.kind == "bytes":
            told = f"{value}.subarray(0, {field.size[1]})"
        else:
            zero = {"bool": "false"}.get(field.kind, "0n" if _is_wide(field) else "0")
            own = " as number" if field.kind == "enum" and _is_own(self._wire.enums[field.type]) else ""
            told = f"{value}{f' ?? {zero}' if may_be_absent and not optional else ''}{own}"
        if not optional:
            return f"{name}: {told}"
        infinity = field.bound.value is not None and field.bound.value.infinity
        there = value if field.kind == "message" or field.repeated else f"{value} !== undefined"
        return f"...({there}{f' && {value} !== Infinity' if infinity else ''} && {{ {name}: {told} }})"

    def _written_oneof(self, message: Message, oneof: str) -> str:
        """The cases are messages, and a number that a value wraps."""
        out = ""
        for field in sorted(message.oneof(oneof), key=lambda field: field.kind == "message"):
            name, value = camel(field.name), f"value.{oneof}"
            if field.kind == "message":
                out += f'{{ case: "{name}", value: write{field.type}({value}) }}'
            else:
                out += f'"{name}" in {value} ? {{ case: "{name}", value: {value}.{name} }} : '
        return out

    # ---- One of many ----

    def _choices(self) -> None:
        frames = [field for field in self._wire.frames() if field.type not in _BY_HAND]
        self._lines += ["", "/** Returns undefined for another frame, or if a field is out of bounds. */"]
        self._lines.append('export function readFrame(body: pb.Frame["body"]): PlainFrame | undefined {')
        self._lines.append("  switch (body.case) {")
        for field in frames:
            value = f'{{ kind: "{_kind_of(self._wire, field)}", value: read{field.type}(body.value) }}'
            self._lines.append(f'    case "{camel(field.name)}":')
            self._lines.append(f"      if (refused{field.type}(body.value) !== undefined) return undefined;")
            self._lines.append(f"      return {value};")
        self._lines += ["    default:", "      return undefined;", "  }", "}"]
        self._lines += ["", 'export function writeFrame(frame: PlainFrame): pb.Frame["body"] {']
        self._lines.append("  switch (frame.kind) {")
        for field in frames:
            value = f'{{ case: "{camel(field.name)}", value: write{field.type}(frame.value) }}'
            self._lines += [f'    case "{_kind_of(self._wire, field)}":', f"      return {value};"]
        self._lines += ["  }", "}"]
        doc = "/** Returns the name of the first field that is out of bounds; undefined: the request is not known. */"
        self._lines += ["", doc]
        self._lines.append('export function readRequest(op: pb.Control["op"]): Request | string | undefined {')
        self._lines.append("  switch (op.case) {")
        for field in self._wire.requests():
            value = f"{{ kind: op.case, ...read{field.type}(op.value) }}"
            self._lines.append(f'    case "{camel(field.name)}":')
            self._lines.append(f"      return refused{field.type}(op.value) ?? {value};")
        self._lines += ["    default:", "      return undefined;", "  }", "}"]
        self._lines += ["", 'export function writeRequest(request: Request): pb.Control["op"] {']
        self._lines.append("  switch (request.kind) {")
        for field in self._wire.requests():
            self._lines.append(f'    case "{camel(field.name)}":')
            self._lines.append(f"      return {{ case: request.kind, value: write{field.type}(request) }};")
        self._lines += ["  }", "}"]


def _broken(line: str) -> list[str]:
    """Splits a condition that is too long for one line."""
    if len(line) <= WIDTH or " return " not in line:
        return [line]
    condition, result = line.rsplit(" return ", 1)
    return [f"{condition} {{", f"    return {result}", "  }"]
