# SPDX-License-Identifier: Apache-2.0
"""Writes the tables of protocol/WIRE.md, one for each message and enum of tendon.proto.

A table stands between two markers. The generator replaces what is between them:

    <!-- generated from tendon.proto: Echo -->
    <!-- end -->
"""

from __future__ import annotations

import re

from model import ROOT, Enum, Field, Message, Range, Wire
from prose import wrapped

PATH = "protocol/WIRE.md"

_BLOCK = re.compile(r"(?<=<!-- generated from tendon\.proto: )(\w+)( -->\n).*?(?=<!-- end -->)", re.DOTALL)


def files(wire: Wire) -> dict[str, str]:
    return {PATH: rewritten((ROOT / PATH).read_text(encoding="utf-8"), wire)}


def rewritten(page: str, wire: Wire) -> str:
    """Returns the page with all its tables written anew. Each message and enum must have its markers, once."""
    tables = _Tables(wire)
    marked = [found[1] for found in _BLOCK.finditer(page)]
    names = [*wire.messages, *wire.enums]
    for name in names:
        if marked.count(name) != 1:
            raise ValueError(f"WIRE.md has {marked.count(name)} tables of {name}; it needs one pair of markers")
    for name in set(marked) - set(names):
        raise ValueError(f"WIRE.md has a table of {name}, which is not in tendon.proto")
    return _BLOCK.sub(lambda found: f"{found[1]}{found[2]}{tables.of(found[1])}", page)


class _Tables:
    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        names = {field.name for message in wire.messages.values() for field in message.fields}
        values = {value.name for enum in wire.enums.values() for value in enum.values}
        words = {word for word in (*names, *values) if "_" in word}
        words |= {name for name in (*wire.messages, *wire.enums) if re.search(r"[a-z][A-Z]|3$", name)}
        paths = r"\b(?:" + "|".join(wire.messages) + r")\.[a-z_0-9]+\b"
        self._code = re.compile(rf"`[^`]*`|{paths}|\b(?:{'|'.join(sorted(words, key=len, reverse=True))})\b")

    def of(self, name: str) -> str:
        if name in self._wire.enums:
            return self._of_enum(self._wire.enums[name])
        return self._of_message(self._wire.messages[name])

    def _of_enum(self, enum: Enum) -> str:
        rows = [_row(str(value.number), f"`{value.name}`", self._cell(value.doc)) for value in enum.values]
        return self._table(enum.name, enum.doc, ["value", "name", "meaning"], rows)

    def _of_message(self, message: Message) -> str:
        rows = []
        for field in message.fields:
            if field.heading:
                rows.append(_row("", "", "", f"*{self._cell(field.heading)}*", ""))
            meaning = self._cell(self._meaning(field))
            rows.append(_row(str(field.number), f"`{field.name}`", _type(field), meaning, self._bounds(field, message)))
        return self._table(message.name, message.doc, ["no.", "field", "type", "meaning", "bounds"], rows)

    def _table(self, name: str, doc: str, columns: list[str], rows: list[str]) -> str:
        front = "\n".join(self._paragraphs(f"**`{name}`.** {self._marked(doc)}".rstrip()))
        head = f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}"
        return "\n".join([front, "", head, *rows, ""])

    def _paragraphs(self, text: str) -> list[str]:
        """Wraps a comment. Its equations, which are on lines of their own, become code."""
        lines: list[str] = []
        for index, paragraph in enumerate(text.split("\n")):
            is_equation = index % 2 == 1
            lines += [f"    {paragraph.replace('`', '')}"] if is_equation else wrapped(paragraph, "")
            lines.append("")
        return lines[:-1]

    def _meaning(self, field: Field) -> str:
        """Returns the comment of the field, or how that of its message begins. `_bounds` says "present"."""
        if field.doc or field.oneof is None or field.kind != "message":
            return re.sub(r"(?:^|; )absent is refused", "", field.doc)
        return re.split(r"(?<=[.:]) |\n|[.:]$", self._wire.messages[field.type].doc)[0].rstrip(".:")

    def _marked(self, text: str) -> str:
        """Marks names as code."""
        text = re.sub(r"(?<=feature )\"([a-z0-9-]+)\"", r"`\1`", text)
        return self._code.sub(lambda found: found[0] if found[0][0] == "`" else f"`{found[0]}`", text)

    def _cell(self, text: str) -> str:
        return self._marked(text).replace("|", "\\|").replace("\n", " ")

    # ---- Bounds ----

    def _bounds(self, field: Field, message: Message) -> str:
        bound, said = field.bound, []
        if field.absent_is_refused:
            said.append("present")
        if field.is_unit_vector:
            said.append("length 1 ± 0.001")
        elif field.type == "Quat":
            said.append("norm 1 ± 0.001")
        elif field.type == "Vec3":
            x = self._wire.messages["Vec3"].field("x")
            said.append(f"{range_of(x.bound.value, x, field.unit)} each")
        elif field.type in self._wire.enums:
            known = self._wire.enums[field.type].known
            said.append(f"{known[0].number} … {known[-1].number}")
        if bound.entries is not None:
            said.append(_entries(bound.entries))
        if field.kind == "bytes":
            least, most = field.size
            said.append(f"{number(str(most), field)} bytes" if least == most else f"{least} … {most} bytes")
        elif bound.bytes is not None:
            said.append(f"{'each ' if field.repeated else ''}≤ {number(bound.bytes.most or '', field)} bytes")
        said.append(range_of(bound.value, field, field.unit))
        for check in message.checks:
            if re.search(r"\w+", check.removeprefix("sum("))[0] == field.name:  # type: ignore[index]
                said.append(_check(check))
        return ", ".join(one for one in said if one)


def _type(field: Field) -> str:
    front = "repeated " if field.repeated else "optional " if field.explicit else ""
    return f"{front}`{field.type}`" if field.kind in ("message", "enum") else f"{front}{field.type}"


def _row(*cells: str) -> str:
    return "".join(f"| {cell} " if cell else "| " for cell in cells) + "|"


def range_of(bound: Range | None, field: Field, unit: str) -> str:
    if bound is None:
        return ""
    least = number(bound.least, field)
    if bound.most is None:
        return f"≥ {least}" if least != "0" else ""
    most = number(bound.most, field)
    if bound.least == f"-{bound.most}":
        said = f"± {most}"
    elif bound.beyond:
        said = f"> {least}, ≤ {most}"
    else:
        said = f"{least} … {most}"
    return f"{said} {unit}".rstrip() + (" or +infinity" if bound.infinity else " or 0" if bound.zero else "")


def number(text: str, field: Field) -> str:
    """ "1e12" as 10¹², "2^60" as 2⁶⁰, "10000000" as 10 000 000."""
    sign, digits = ("−", text[1:]) if text.startswith("-") else ("", text)
    if found := re.fullmatch(r"(?:(2)\^|1e)(\d+)", digits):
        power = found[2].translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{sign}{found[1] or 10}{power}"
    if field.type == "fixed32" and int(digits) > 9:
        return f"0x{int(digits):X}"
    return sign + (f"{int(digits):,}".replace(",", " ") if digits.isdigit() and len(digits) > 4 else digits)


def _entries(allowed: tuple[int, int] | frozenset[int]) -> str:
    if isinstance(allowed, tuple):
        least, most = allowed
        return f"≤ {most} entries" if least == 0 else f"{least} … {most} entries"
    *first, last = sorted(allowed)
    return f"{', '.join(map(str, first))} or {last} entries"


def _check(check: str) -> str:
    """ "overruns <= steps" as `overruns` ≤ `steps`."""
    text = re.sub(r"sum\((\w+)\)", r"sum of \1", check)
    for written, sign in (("<=", "≤"), (">=", "≥"), ("==", "=")):
        text = text.replace(written, sign)
    return re.sub(r"[a-z]\w+(?<!sum)(?<!of)(?<!or)\b", lambda found: f"`{found[0]}`", text)
