#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every command that a document shows is one that the programs take.

Blocks marked `sh` are run as they stand, by deploy/test and by the tests of the clients. What is held here against the built
programs is every other command line of ours, in blocks and in the running text: the program is there, has that subcommand, and its
--help names each option; a file of this tree that is named exists.

    documents_test.py ROOT PROGRAMS…      PROGRAMS: folders with built programs
"""
import functools
import pathlib
import re
import shlex
import subprocess
import sys

# Commands that another machine, or a reader's own choice, decides on.
PLACEHOLDER = re.compile(r"[A-Z]{2,}|…|\.\.\.|<.*>|\*")
EXAMPLE = r"echo_motion|friction_surface|magnet|maze|texture|two_hands|virtual_fixture|virtual_wall|viscous_field"
PROGRAM = re.compile(rf"^(tendond|tendon-[a-z-]+|{EXAMPLE}|falcon-server)$")
SCRIPT = re.compile(r"^(deploy/[a-z-]+|tests/[a-z/]+/[a-z]+\.sh)$")


def commands(text):
    """(line number, command) of each command line, a comment or output beside it left out."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"^\s*```(\S*)", line)
        if mark:
            fence = None if fence is not None else mark[1]
            continue
        if fence is None and not line.startswith("    "):
            for span in re.findall(r"`([^`]+)`", line):
                yield number, span
        elif fence in ("", "sh") or fence is None:
            for part in re.split(r"&&|\||;|(?<!&)&(?!&)", line.split("  #")[0]):
                yield number, part.strip()


def words(command):
    try:
        found = shlex.split(command, comments=True)
    except ValueError:
        return []
    while found and re.match(r"^([A-Z_]+=.*|nice|exec|time|\$)$", found[0]):
        found = found[1:]
    for i, word in enumerate(found):
        if word in (">", "<", "2>") or word.startswith((">", "<", "2>")):
            return found[:i]
    return found


@functools.lru_cache(maxsize=None)
def help_of(program, subcommand):
    line = [str(program)] + ([subcommand] if subcommand else []) + ["--help"]
    return subprocess.run(line, capture_output=True, text=True, timeout=60, check=False).stdout


def built(name, folders):
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    return None


def wrong(command, root, folders):
    """What is wrong with a command line of ours, in words; empty when nothing is, or when it is not ours."""
    found = words(command)
    if not found:
        return ""
    name = found[0]
    if SCRIPT.match(name):
        if not (root / name).exists():
            return f"there is no {name}"
        usage = "" if len(found) == 1 else (root / name).read_text(encoding="utf-8")
        return next((f"{name} has no {w}" for w in found[1:] if w.startswith("--") and w not in usage), "")
    name = pathlib.PurePath(name).name
    if not PROGRAM.match(name) or len(found) == 1:
        return ""
    program = built(name, folders)
    if program is None:
        return f"there is no program {name}"
    usage = help_of(program, "")
    named = re.findall(r"^  ([a-z][a-z0-9-]+) {2,}", usage[usage.find("Subcommands:") :], re.M) if "Subcommands:" in usage else []
    subcommand = next((w for w in found[1:] if w in named), "")
    if subcommand:
        usage += help_of(program, subcommand)
    for word in found[1:]:
        option = word.split("=")[0]
        if re.match(r"^--[a-z]", option) and not re.search(re.escape(option) + r"(?![a-z-])", usage):
            return f"{name} {subcommand} has no {option}"
        if re.match(r"^(deploy|tests|core|server|clients|devices|protocol)/", word) and not PLACEHOLDER.search(word):
            if not (root / word).exists():
                return f"there is no {word}"
    return ""


def main():
    root = pathlib.Path(sys.argv[1])
    folders = [pathlib.Path(folder) for folder in sys.argv[2:]]
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=root, capture_output=True, text=True, check=True).stdout.split()
    checked = 0
    complaints = []
    for document in listed:
        if document == "CHANGELOG.md":  # tells of what was, too
            continue
        for number, command in commands((root / document).read_text(encoding="utf-8")):
            found = words(command)
            if not found or not (PROGRAM.match(pathlib.PurePath(found[0]).name) or SCRIPT.match(found[0])):
                continue
            checked += len(found) > 1
            why = wrong(command, root, folders)
            if why:
                complaints.append(f"{document}:{number}: {why}: {command}")
    print(f"{checked} command lines in {len(listed)} documents")
    print("\n".join(complaints))
    if checked < 40:
        complaints.append("so few: they are not found any more")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
