# SPDX-License-Identifier: Apache-2.0
"""Translates the comments of tendon.proto for a language: names of fields become names of members."""

from __future__ import annotations

import re
import textwrap

from model import CPP, CSHARP, Field, Member, Message, Part, Wire, constant, pascal

WIDTH = 120


class Words:
    """Comments for the values of one language."""

    def __init__(self, wire: Wire, language: str, absent: str) -> None:
        self._wire = wire
        self._language = language
        self._absent = absent  # the value of a part that is absent
        self._scope = "::" if language == CPP else "."
        short = {CPP: constant, CSHARP: pascal}.get(language, str)
        self._enums = {
            value.name: f"{enum.name}{self._scope}{short(value.short)}"
            for enum in wire.enums.values()
            for value in enum.values
        }
        self._members = {name: dict(self._paths(message)) for name, message in wire.messages.items()}

    def _paths(self, message: Message):  # type: ignore[no-untyped-def]
        for member in message.members(self._language):
            if member.part is None:
                yield member.wire, member.name
                continue
            yield from ((inner.wire, f"{member.name}.{inner.name}") for inner in member.part.members)

    def say(self, text: str, message: str) -> str:
        """Translates `text`, which is about that message."""

        def of_other(found: re.Match[str]) -> str:
            other, name = found.groups()
            value = self._wire.messages[other].type_name(self._language) if other in self._wire.messages else other
            return f"{value}{self._scope}{self._members.get(other, {}).get(name, name)}"

        def of_this(found: re.Match[str]) -> str:
            own = self._members[message].get(found[0])
            others = {members[found[0]].rsplit(".", 1)[-1] for members in self._members.values() if found[0] in members}
            return own or (others.pop() if len(others) == 1 else found[0])

        text = re.sub(r"\b[A-Z]+(?:_[A-Z]+)+\b", lambda found: self._enums.get(found[0], found[0]), text)
        text = re.sub(r"(?<![.\w])[a-z]+(?:_[a-z0-9]+)+\b(?!\()", of_this, text)
        return re.sub(r"\b([A-Z]\w+)\.([a-z_0-9]+)\b", of_other, text)

    def of_field(self, field: Field, absent: str | None, unit: bool = True) -> str:
        """Returns the comment of a field, with its unit in front. If the field is absent, the member has the value
        `absent`. If `absent` is None, the field is always there."""
        said = "" if field.doc == "optional" else self.say(field.doc, field.message)
        if absent is None:
            said = re.sub(r"(?:^|; |(?<=\.) )absent\b[^;.]*\.?$", "", said, flags=re.IGNORECASE)
        else:
            said = re.sub(r"\babsent(?= if\b)", absent, said)
            said = re.sub(r"\bAbsent(?= if\b)", capitalized(absent) if len(absent) > 3 else absent, said)
        if field.is_time or not unit or not field.unit:  # a time has its unit in its name
            return said
        if not said:
            return field.unit
        joint = ". " if said[0].isupper() and not said.startswith(f"{absent} if") else ", "
        return f"{field.unit}{joint}{said}"

    def of_member(self, member: Member, absent: str | None) -> str:
        if member.field is not None:
            return self.of_field(member.field, absent)
        assert member.part is not None
        return self.of_part(member.part)

    def of_part(self, part: Part) -> str:
        """Returns what the absence of the part means."""
        first = part.members[0].field
        assert first is not None
        found = re.search(r"\babsent if [^.]*", self.say(first.doc, first.message), re.IGNORECASE)
        return f"{self._absent}{found[0][len('absent') :]}" if found else ""

    def of_message(self, message: Message) -> str:
        doc = self.say(message.doc, message.name)
        if not message.sender or message.sender.startswith("the answer"):
            return doc
        sender = self.say(message.sender, message.name)
        return f"{doc} {capitalized(sender)}.".lstrip()


def capitalized(text: str) -> str:
    return text[:1].upper() + text[1:]


def wrapped(text: str, indent: str, prefix: str = "") -> list[str]:
    """Splits `text` into lines of at most 120 columns."""
    width = WIDTH - len(indent) - len(prefix)
    lines = []
    for paragraph in text.split("\n"):
        lines += textwrap.wrap(paragraph, width, break_long_words=False, break_on_hyphens=False)
    return [f"{indent}{prefix}{line}".rstrip() for line in lines]
