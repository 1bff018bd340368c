#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the sources that clang-tidy should check for a change.

    git diff --name-only HEAD~3 | deploy/tidied.py build/tidy/compile_commands.json [AT_MOST]

These are the changed sources that are listed in compile_commands.json. If a header has changed, its source is printed,
or the closest source that includes it. Tests are not checked, because the macros of GoogleTest make clang-tidy too
slow. If there are more than AT_MOST sources, this prints a sample of AT_MOST sources and a message on stderr. The
sample only depends on the contents of the sources.
"""
import collections
import hashlib
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main():
    if sys.argv[1:] in (["--help"], ["-h"]):
        print(__doc__)
        return
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    compiled = {entry["file"].removeprefix(f"{ROOT}/") for entry in json.loads(pathlib.Path(sys.argv[1]).read_text())}
    sources = sorted(path for path in compiled if not re.search(r"^(/|build/)|_(test|fuzz)\.cc$", path))
    users = collections.defaultdict(list)  # header -> the files that include it
    headers = {str(path.relative_to(ROOT)) for room in ("core", "protocol", "devices", "server", "clients", "tests")
               for path in (ROOT / room).rglob("*.h") if "node_modules" not in path.parts}
    for path in sources + sorted(headers):
        for header in re.findall(r'^#include "([^"]+)"', (ROOT / path).read_text(), re.MULTILINE):
            users[header].append(path)

    def witness(header):
        own = re.sub(r"\.h$", ".cc", header)
        seen, waiting = {header}, collections.deque([own] * (own in sources) + [header])
        while waiting:
            path = waiting.popleft()
            if path.endswith(".cc"):
                return path
            waiting.extend(user for user in users[path] if user not in seen)
            seen.update(users[path])
        return None

    changed = set(sys.stdin.read().split("\n"))
    chosen = changed.intersection(sources) | {witness(path) for path in changed & headers}
    chosen.discard(None)
    if len(sys.argv) == 3 and len(chosen) > int(sys.argv[2]):
        print(f"{sys.argv[2]} of {len(chosen)} sources, a sample", file=sys.stderr)
        drawn = sorted(chosen, key=lambda path: hashlib.sha256((ROOT / path).read_bytes()).digest())
        chosen = drawn[:int(sys.argv[2])]
    print("\n".join(sorted(chosen)))


if __name__ == "__main__":
    main()
