#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the programs accept every command that is shown in a document.

The commands in blocks marked `sh` are run by deploy/test and by the client tests. This test checks all other command
lines, both in code blocks and in the text. The program must exist, the subcommand must exist, and --help must list each
option. If a command names a file in this repository, the file must exist. `program verb --help` must succeed and leave no
file behind. A Python program of the repository must start as printed in a shell whose python3 is not Debian's and lacks
Debian's packages. Programs and subcommands are skipped if the build left them out because of a missing package.

    documents_test.py ROOT PROGRAMS…      PROGRAMS: folders with built programs
"""
import atexit
import functools
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

# Placeholders, for example for addresses and files.
PLACEHOLDER = re.compile(r"[A-Z]{2,}|…|\.\.\.|<.*>|\*")
EXAMPLE = r"echo_motion|friction_surface|magnet|maze|texture|two_hands|virtual_fixture|virtual_wall|viscous_field"
PROGRAM = re.compile(rf"^(tendond|tendon-[a-z-]+|{EXAMPLE}|falcon-server)$")
SCRIPT = re.compile(r"^(deploy/[a-z-]+|tests/[a-z/]+/[a-z]+\.sh)$")
PYTHON = re.compile(r"^(\S*/)?python3?$")
# A program in a code span, followed by one of its subcommands in the next: `tendon-lab`: `compare` (...).
VERB_AFTER = re.compile(r"`(tendon[a-z-]*)`: `([a-z]+)`")


def commands(text):
    """Yields (line number, command) for each command line, without trailing comments."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"^\s*```(\S*)", line)
        if mark:
            fence = None if fence is not None else mark[1]
            continue
        if fence is None and not line.startswith("    "):
            for span in re.findall(r"`([^`]+)`", line):
                yield number, span
            for program, verb in VERB_AFTER.findall(line):
                yield number, f"{program} {verb}"
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
    """Returns the output of --help. Raises a ValueError if the program fails or writes a file."""
    line = [str(program)] + ([subcommand] if subcommand else []) + ["--help"]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(line, capture_output=True, text=True, timeout=60, check=False, cwd=folder)
        if done.returncode != 0:
            raise ValueError(f"--help ends with {done.returncode}: {done.stderr.strip()}")
        if os.listdir(folder):
            raise ValueError(f"--help writes {os.listdir(folder)}")
    return done.stdout


WHOSE = "whose Python? Name /usr/bin/python3, or that of a virtual environment"


@functools.lru_cache(maxsize=None)
def foreign_shell(root):
    """Returns the environment of a shell in which python3 is not Debian's. It sets PYTHONPATH as described in the pages."""
    folder = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, folder)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True, capture_output=True)
    return os.environ | {"PATH": f"{folder}/bin:{os.environ['PATH']}", "PYTHONPATH": str(root / "clients" / "python")}


@functools.lru_cache(maxsize=None)
def debian_has_the_packages():
    check = [sys.executable, "-c", "import google.protobuf, nacl.bindings"]
    there = subprocess.run(check, capture_output=True, check=False).returncode == 0
    if not there:
        print("skipped: the Python examples, because python3-protobuf or python3-nacl is missing")
    return there


@functools.lru_cache(maxsize=None)
def wrong_python(line, root):
    """Returns the error in a command that starts a Python program, or an empty string if there is none."""
    named = [word for word in line if re.match(r"^(clients|tests|deploy)/.*\.py$", word)]
    if not named:
        return WHOSE if len(line) > 1 and line[0] in ("python", "python3", "pip") and "venv" not in line else ""
    script = root / named[0]
    if not script.is_file():
        return f"there is no {named[0]}"
    is_example = "clients/python/examples" in named[0]
    is_command = is_example or len(line) > 1  # other file names are not commands
    if is_command and line[0] == named[0] and not os.access(script, os.X_OK):
        return f"{named[0]} is not executable"
    if not is_example or "worker.run(" in script.read_text(encoding="utf-8"):
        return "" if line[0] in (named[0], "/usr/bin/python3") else WHOSE
    # The virtual environment does not exist until it is created by the reader.
    if "venv" in line[0] or not debian_has_the_packages():
        return ""
    shell = {"env": foreign_shell(root), "cwd": root, "capture_output": True, "text": True}
    done = subprocess.run([*line, "--help"], **shell, timeout=60, check=False)
    return "" if done.returncode == 0 else f"it ends with {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"


def built(name, folders):
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    return None


@functools.lru_cache(maxsize=None)
def left_out(build):
    """Returns the parts that are not in this build, such as "tendon-dash" and "tendon-bridge inverse"."""
    listed = build / "left_out.txt"
    return {line.split(" (")[0] for line in listed.read_text(encoding="utf-8").splitlines()} if listed.exists() else set()


def wrong(command, root, folders):
    """Returns the error in a command of this project, or an empty string if there is none."""
    found = words(command)
    if not found:
        return ""
    name = found[0]
    if SCRIPT.match(name):
        if not (root / name).exists():
            return f"there is no {name}"
        usage = "" if len(found) == 1 else (root / name).read_text(encoding="utf-8")
        return next((f"{name} has no {w}" for w in found[1:] if w.startswith("--") and w not in usage), "")
    if PYTHON.match(name) or name.endswith(".py") or name == "pip":
        return wrong_python(tuple(found), root)
    name = pathlib.PurePath(name).name
    if not PROGRAM.match(name) or len(found) == 1:
        return ""
    if re.search(r"(?<![/\w])python3 (clients|tests)/", command):
        return WHOSE
    if {name, f"{name} {found[1]}"} & left_out(folders[0].parent):
        return ""
    program = built(name, folders)
    if program is None:
        return f"there is no program {name}"
    try:
        usage = help_of(program, "")
    except ValueError as error:
        return f"{name} {error}"
    named = re.findall(r"^  ([a-z][a-z0-9-]+) {2,}", usage[usage.find("Subcommands:") :], re.M) if "Subcommands:" in usage else []
    subcommand = next((w for w in found[1:] if w in named), "")
    if re.search(r"^Usage:.* SUBCOMMAND$", usage, re.M) and re.match(r"^[a-z][a-z0-9]+$", found[1]) and not subcommand:
        return f"{name} has no command {found[1]}"
    if subcommand:
        try:
            usage += help_of(program, subcommand)
        except ValueError as error:
            return f"{name} {subcommand} {error}"
    for word in found[1:]:
        option = word.split("=")[0]
        if re.match(r"^--[a-z]", option) and not re.search(re.escape(option) + r"(?![a-z-])", usage):
            return f"{name} {subcommand} has no {option}"
        if re.match(r"^(deploy|tests|core|server|clients|devices|protocol)/", word) and not PLACEHOLDER.search(word):
            if not (root / word).exists():
                return f"there is no {word}"
    return ""


def ours(word):
    name = pathlib.PurePath(word).name
    is_python = PYTHON.match(word) or word == "pip" or re.match(r"^(clients|tests)/.*\.py$", word)
    return PROGRAM.match(name) or SCRIPT.match(word) or is_python


def main():
    root = pathlib.Path(sys.argv[1])
    folders = [pathlib.Path(folder) for folder in sys.argv[2:]]
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=root, capture_output=True, text=True, check=True).stdout.split()
    checked = 0
    complaints = []
    for document in listed:
        if document == "CHANGELOG.md":  # describes old versions as well
            continue
        for number, command in commands((root / document).read_text(encoding="utf-8")):
            found = words(command)
            if not found or not ours(found[0]):
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
