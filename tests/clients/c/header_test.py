#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that tendon.h only grows: header_test.py FIRST_HEADER HEADER LIBRARY MAP

Each struct must begin with the members of the first version, each constant must have its first value, each function its
first parameters, and there are at most ten functions. The library must export these functions and nothing else."""
import re
import subprocess
import sys


def parts(path):
    """Returns the members of the structs, the constants and the functions."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"//.*", "", file.read())
    structs = {name: [" ".join(member.split()) for member in body.split(";") if member.strip()]
               for body, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, re.DOTALL)}
    constants = dict(re.findall(r"\b(TENDON_\w+) = (-?\d+)", text))
    functions = {name: " ".join(whole.split())
                 for whole, name in re.findall(r"^((?:[\w ]+?[ *]+)(tendon_\w+)\([^)]*\));", text, re.MULTILINE)}
    return structs, constants, functions


def findings(first, now):
    for name, members in first[0].items():
        if now[0].get(name, [])[:len(members)] != members:
            yield f"struct {name} does not begin with the members of its first version"
    for old, new, what in ((first[1], now[1], "constant"), (first[2], now[2], "function")):
        for name, value in old.items():
            if new.get(name) != value:
                yield f"{what} {name}: {new.get(name)}, first version: {value}"
    for name, members in now[0].items():
        if members[0] != "uint32_t size":
            yield f"struct {name} does not begin with its size"
    if len(now[2]) > 10:
        yield f"{len(now[2])} functions: expected at most ten"


def main():
    first_path, path, library, mapped = sys.argv[1:]
    first, now = parts(first_path), parts(path)
    assert len(first[0]) == 6 and len(first[1]) > 30 and len(first[2]) == 9, first  # the expressions match
    wrong = list(findings(first, now))
    # The check must find each kind of change.
    planted = parts(path)
    planted[0]["tendon_state"].insert(3, "double early")
    planted[1]["TENDON_LOST"] = "7"
    planted[2].update({f"tendon_more_{i}": "" for i in range(10)})
    del planted[2]["tendon_why"]
    assert len(list(findings(first, planted))) == 4, list(findings(first, planted))
    listed = subprocess.run(["nm", "-D", "--defined-only", library], check=True, capture_output=True, text=True).stdout
    exported = {line.split()[-1] for line in listed.splitlines() if line.split()[-2] != "A"}
    expected = {name + "@@TENDON_1" for name in now[2]}
    if exported != expected:
        wrong.append(f"the library exports {sorted(exported ^ expected)}, which differ from tendon.h")
    with open(mapped, encoding="utf-8") as file:
        if set(re.findall(r"tendon_\w+", file.read())) != set(now[2]):
            wrong.append("tendon.map does not contain the functions of tendon.h")
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{len(now[0])} structs, {len(now[1])} constants, {len(now[2])} functions")


if __name__ == "__main__":
    main()
