#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Wraps the prose of Markdown pages at 120 columns, in place.

Only blocks with a line that is too long are wrapped again: paragraphs, list items and quotes. Tables, code, headings,
HTML, and lines that end in a hard break are not changed. Code spans and links are never divided.

    tests/rules/documents/wrap.py README.md protocol/*.md
"""

import re
import sys
from pathlib import Path

COLUMNS = 120

_FENCE = re.compile(r"\s*(```|~~~)")
_ITEM = re.compile(r"(\s*(?:[-*+]|\d+[.)])\s+)(.*)", re.S)
_QUOTE = re.compile(r"(\s*>\s?)(.*)", re.S)
_VERBATIM = re.compile(r"\s*(\||#|<|\[[^\]]+\]:\s|(?:[-*_]\s*){3,}$|=+$)")
# An unbreakable piece: a code span, a link or image with its address, or text without blanks.
_PIECE = re.compile(r"(?:``[^`]*(?:`[^`]+)*``|`[^`]*`|!?\[[^\]\[]*\]\([^)]*\)|[^\s`\[]|[`\[])+")
# If these are at the beginning of a line, they would start an item, a heading, a quote, a table or a rule.
_MARK = re.compile(r"[-*+]$|#+$|=+$|-+$|\d+[.)]$|[>|]")


def is_verbatim(line: str) -> bool:
    """Returns whether a line is not prose: a heading, a table row, HTML, a link definition or a rule."""
    return bool(_VERBATIM.match(line))


def wrap_block(lines: list[str], columns: int = COLUMNS) -> list[str]:
    """Wraps a paragraph, a list item or a quote. The mark of the first line determines the indent of the others."""
    if max(map(len, lines)) <= columns or any(line.endswith(("  ", "\\")) for line in lines[:-1]):
        return lines
    first, rest = lines[0], lines[1:]
    if item := _ITEM.match(first):
        lead, text, hang = item[1], item[2], " " * len(item[1])
    elif quote := _QUOTE.match(first):
        lead, text, hang = quote[1], quote[2], quote[1]
        rest = [m[2] if (m := _QUOTE.match(line)) else line for line in rest]
    else:
        lead = re.match(r"\s*", first)[0]
        text, hang = first[len(lead):], lead
    pieces: list[str] = []
    for piece in _PIECE.findall(" ".join([text, *(line.strip() for line in rest)])):
        if pieces and _MARK.match(piece):
            pieces[-1] += " " + piece
        else:
            pieces.append(piece)
    out, now = [], lead + pieces[0]
    for piece in pieces[1:]:
        if len(now) + 1 + len(piece) > columns:
            out.append(now)
            now = hang + piece
        else:
            now += " " + piece
    return [*out, now]


def blocks(text: str):
    """Yields (is prose, lines) for the whole page in order."""
    prose: list[str] = []
    fence = front = False
    for number, line in enumerate(text.split("\n")):
        front = (number == 0 and line == "---") or (front and line != "---")
        is_fence = bool(_FENCE.match(line))
        begins = bool(_ITEM.match(line)) or (line.startswith("    ") and not prose)
        if prose and (fence or is_fence or not line.strip() or is_verbatim(line) or begins):
            yield True, prose
            prose = []
        if fence or is_fence or front or not line.strip() or is_verbatim(line):
            yield False, [line]
        elif not prose and line.startswith("    ") and not _ITEM.match(line):
            yield False, [line]  # indented code, or the rest of an item after a blank line
        else:
            prose.append(line)
        fence ^= is_fence
    if prose:
        yield True, prose


def wrap(text: str, columns: int = COLUMNS) -> str:
    return "\n".join(line for prose, lines in blocks(text) for line in (wrap_block(lines, columns) if prose else lines))


def too_long(text: str, columns: int = COLUMNS) -> list[int]:
    """Returns the numbers of the lines of prose that are too long and can be wrapped."""
    numbers, at = [], 1
    for prose, lines in blocks(text):
        if prose and wrap_block(lines, columns) != lines:
            numbers += [at + i for i, line in enumerate(lines) if len(line) > columns]
        at += len(lines)
    return numbers


if __name__ == "__main__":
    for name in sys.argv[1:]:
        page = Path(name)
        page.write_text(wrap(page.read_text(encoding="utf-8")), encoding="utf-8")
