# SPDX-License-Identifier: Apache-2.0
"""Checks rules about the language of all files in the repository:

    columns   prose in Markdown pages has at most 120 columns (wrap.py wraps it)
    name      the name of a test has at most 70 characters: in C++ suite, dot and name; in TypeScript and JavaScript
              the title of each test or group; in Python the name of the function
    cleft     no sentence of a page or a comment begins with "Of what", or has the form "What … is …."
"""

import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
import wrap  # noqa: E402

NOT_PROSE = ("CHANGELOG.md",)  # a history
TEST = re.compile(r"^\s*(?:TEST|TEST_F|TEST_P|TYPED_TEST|TYPED_TEST_P|RC_GTEST_PROP)\(\s*(\w+),\s*(\w+)", re.M)
TITLE = re.compile(r"(?<![.\w])(?:test|it|describe)(?:\.(?:only|skip|todo))?\(\s*([\"'`])((?:(?!\1)[^\\]|\\.)*)\1")
FUNCTION = re.compile(r"^\s*(?:async )?def (test\w*)", re.M)
COMMENT = {
    **dict.fromkeys((".h", ".cc", ".ts", ".js", ".mjs", ".proto"), re.compile(r"^\s*(?://[/<!]*|/?\*+/?)\s?(.*)|//[/<]*\s(.*)")),
    **dict.fromkeys((".py", ".sh", ".cmake", ".toml", ".txt"), re.compile(r"^\s*#+\s?(.*)")),
}
# A clause that may contain its own verb: "What follows the header; empty when it is not authentic."
_PLAIN = r"(?:(?!\b(?:when|as|if|that|who|which|where|whether|has|have)\b)[^.?!:;|])*?"
_BE = r"(?:is|are|was|were)"
_NOUN = r"(?:an?|the|in|no|not|what|that|to|on|at|as|there)\b"
CLEFT = re.compile(
    r"(?:^|(?<=[.!?:] ))(?:Of what\b|What (?![^.?!]*\?)"
    rf"(?:{_BE}\b{_PLAIN}\b(?:{_BE}|has|does|may|must|can|cannot|goes|comes|says|becomes|needs)\b|(?!{_BE}){_PLAIN}\b{_BE} {_NOUN})"
    r"(?! and\b|[,;.])[^.?!:|]*\.)"
)


def paragraphs(path, text):
    """Yields (line, text) for each paragraph of a page, or for each comment of a source."""
    lines = text.split("\n")
    if path.endswith(".md"):
        at = 1
        for prose, block in wrap.blocks(text):
            if prose:
                yield at, " ".join(line.strip().lstrip("*->0123456789. ") for line in block)
            at += len(block)
        return
    comment = COMMENT.get(pathlib.PurePath(path).suffix)
    if comment is None:
        return
    begun, words = 0, []
    for number, line in enumerate([*lines, ""], 1):
        found = comment.search(line)
        said = next((group for group in found.groups() if group), "") if found else ""
        whole = found is not None and found.start() == 0 and line.strip()[:2] != "" and found.groups()[0] is not None
        if words and not (whole and said):
            yield begun, " ".join(words)
            words = []
        if said and whole:
            begun = begun if words else number
            words.append(said.strip())
        elif said:
            yield number, said.strip()


def test_names(path, text):
    """Returns (offset, name) of each test in a source."""
    if path.endswith(".cc"):
        return [(found.start(2), f"{found[1]}.{found[2]}") for found in TEST.finditer(text)]
    if path.startswith("tests/") and path.endswith((".ts", ".mjs")):
        return [(found.start(2), found[2]) for found in TITLE.finditer(text)]
    if path.startswith("tests/") and path.endswith(".py"):
        return [(found.start(1), found[1]) for found in FUNCTION.finditer(text)]
    return []


def broken(path, text):
    """Yields (rule, line, text) of each violation in a file."""
    if path.endswith(".md") and path not in NOT_PROSE:
        for number in wrap.too_long(text):
            yield "columns", number, "more than 120 columns; run tests/rules/documents/wrap.py " + path
    for at, name in test_names(path, text):
        if len(name) > 70:
            yield "name", text.count("\n", 0, at) + 1, f"{name} has {len(name)} characters"
    if path not in NOT_PROSE and not path.startswith("tests/rules/documents/"):
        for number, words in paragraphs(path, text):
            for found in CLEFT.finditer(words):
                yield "cleft", number, "subject, verb, object: " + found[0]


def check_the_rules():
    """Each rule must find its violations and accept other sentences."""

    def rules(path, text):
        return [rule for rule, _, _ in broken(path, text)]

    assert rules("a.md", "a " * 70) == ["columns"]
    assert rules("a.md", "| " + "a " * 70 + "|") == []
    assert rules("a.md", "```\n" + "a " * 70 + "\n```") == []
    assert rules("a_test.cc", f"TEST(A, {'B' * 69})") == ["name"]
    assert rules("a_test.cc", f"TEST(A, {'B' * 68})") == []
    assert rules("tests/a.test.ts", f'it("{"b" * 71}", () => {{') == ["name"]
    assert rules("tests/a.test.mjs", f"test(`{'b' * 71}`, async (test) => {{") == ["name"]
    assert rules("tests/a.test.ts", f'describe("{"b" * 70}", () => {{') == []
    assert rules("tests/a.test.ts", f'test.diagnostic("{"b" * 71}");') == []
    assert rules("tests/test_a.py", f"def test_{'b' * 66}():") == ["name"]
    assert rules("tests/test_a.py", f"def test_{'b' * 65}():") == []
    assert rules("a.h", "/// Of what was sent that is followed.") == ["cleft"]
    assert rules("a.h", "/// It ends. What is empty is\n/// not there.") == ["cleft"]
    assert rules("a.h", "int a;  ///< What is empty is not there.") == ["cleft"]
    assert rules("a.py", "# What is empty is not there.") == ["cleft"]
    assert rules("a.md", "* What is empty is not there.") == ["cleft"]
    assert rules("a.md", "What is it? It is a hand. Nobody knows what is there.") == []
    assert rules("a.md", "## What is here") == []
    assert rules("a.h", "/// What is wanted at `hand`.") == []
    assert rules("a.h", "/// What the peers do is in another page.") == ["cleft"]
    assert rules("a.h", "/// What a device is and can do.") == []
    assert rules("a.h", "/// What a controller is told about its forces.") == []
    assert rules("a.h", "/// What follows the header; empty when it is not there.") == []
    assert rules("a.h", "/// What the server drops before there is a session: junk.") == []


def main():
    check_the_rules()
    root = pathlib.Path(sys.argv[1])
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout.split("\n")
    bad = []
    for path in listed:
        if pathlib.PurePath(path).suffix not in (".md", *COMMENT) or not (root / path).is_file():
            continue
        text = (root / path).read_text(encoding="utf-8")
        bad += [f"{path}:{line}: {words}" for _, line, words in broken(path, text)]
    print("\n".join([*bad, f"{len(bad)} breaks of the rules"]))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
