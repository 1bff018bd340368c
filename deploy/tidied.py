#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the sources that clang-tidy is to look at for a change.

    git diff --name-only HEAD~3 | deploy/tidied.py build/tidy/compile_commands.json [AT_MOST]

Of the sources that this file compiles: those that changed, and for each header that changed its own source, or the
nearest one that includes it. Not the tests: GoogleTest's macros cost a clang-tidy run more time than everything that it
could find. If there are more than AT_MOST, this prints a sample of AT_MOST and says so on stderr. The sample depends only
on the contents of the sources.
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
    users = collections.defaultdict(list)  # header -> what includes it
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
