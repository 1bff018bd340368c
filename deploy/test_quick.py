#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""deploy/test --quick: builds and tests the parts that are affected by a change. This only uses the release build.

    test_quick.py [COMMIT]

If a test has changed, it is run. If a source of a room has changed, this runs the tests in the folder with the same
name under tests/ (or in the closest parent folder with tests), the tests of the room that include the header of the
source, and the property tests of the room with fewer cases. The tests in tests/rules are always run. At the end, this
prints what was not tested.
"""
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/release"
PROPERTY_CASES = 500
# These tests start processes, simulate worlds or take long. They are only run if one of their own files has changed.
SLOW = {"bench-smoke", "conformance", "e2e", "extended", "hard", "world"}
STARTED = time.monotonic()


def say(text):
    print(f"[{time.monotonic() - STARTED:4.0f} s] {text}", flush=True)


def output(*command, cwd=ROOT):
    return subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, text=True, check=True).stdout


def commit_of(name):
    found = subprocess.run(["git", "rev-parse", "--quiet", "--verify", name + "^{commit}"], cwd=ROOT, stdout=subprocess.PIPE,
                           text=True, check=False)
    return found.stdout.strip()


def changed_files(base):
    """Returns the files that have changed, and a description of what they are compared to."""
    untracked = output("git", "ls-files", "--others", "--exclude-standard").splitlines()
    if base:
        if not commit_of(base):
            sys.exit(f"deploy/test --quick: {base} is not a commit")
        return output("git", "diff", "--no-renames", "--name-only", base).splitlines() + untracked, f"since {base}"
    uncommitted = output("git", "diff", "--no-renames", "--name-only", "HEAD").splitlines() + untracked
    if uncommitted:
        return uncommitted, "and not committed"
    head = commit_of("HEAD")
    base = commit_of("origin/main") and output("git", "merge-base", "HEAD", "origin/main").strip()
    if base in ("", head):
        base = commit_of("HEAD~1")
    return output("git", "diff", "--no-renames", "--name-only", base, "HEAD").splitlines(), f"since {base[:12]}"


class Graph:
    """The build graph of ninja: the sources of each object, and the objects of each executable."""

    def __init__(self):
        self.sources = {}  # object -> its sources; there can be several if they are compiled together
        for entry in json.loads((BUILD / "compile_commands.json").read_text()):
            found = re.search(r" -o (\S+\.o) ", entry["command"])
            if found:
                together = "/Unity/unity_" in entry["file"] and pathlib.Path(entry["file"]).read_text()
                files = re.findall(r'^#include "([^"]+)"', together, re.MULTILINE) if together else [entry["file"]]
                self.sources[found[1]] = [inside(path) for path in files]
        self.users = collections.defaultdict(set)  # file -> the objects that depend on it
        for name, sources in self.sources.items():
            for source in sources:
                self.users[source].add(name)
        name = ""
        for line in output("ninja", "-C", str(BUILD), "-t", "deps").splitlines():
            if line.startswith(" "):
                self.users[inside(str(BUILD / line.strip()))].add(name)
            else:
                name = line.partition(":")[0]
        archives = {}
        self.own = {}  # executable -> the objects that are not from a library
        self.linked = {}  # executable -> all objects
        for line in (BUILD / "build.ninja").read_text().splitlines():
            found = re.match(r"build (\S+)[^:]*: CXX_(STATIC_LIBRARY|EXECUTABLE)_LINKER__\S+ (.*)", line)
            if not found:
                continue
            words = found[3].split()
            objects = {word for word in words if word.endswith(".o")}
            if found[2] == "STATIC_LIBRARY":
                archives[found[1]] = objects
            else:
                self.own[found[1]] = objects
                self.linked[found[1]] = objects | {word for word in words if word.endswith(".a")}
        for name, parts in self.linked.items():
            self.linked[name] = set().union(*(archives.get(part, {part}) for part in parts))

    def folders(self, executable):
        return {os.path.dirname(source) for name in self.own[executable] for source in self.sources.get(name, [])}


def inside(path):
    """Returns the path relative to the checkout, if it is inside."""
    path = os.path.normpath(path)
    root = str(ROOT) + "/"
    return path[len(root):] if path.startswith(root) else path


class Test:
    def __init__(self, number, entry, backtrace):
        self.number = number
        self.name = entry["name"]
        self.executable = inside(entry["command"][0]).removeprefix("build/release/") if "command" in entry else ""
        properties = {p["name"]: p["value"] for p in entry.get("properties", [])}
        self.wants_programs = str(BUILD / "bin") in entry.get("command", [])
        self.labels = set(properties.get("LABELS", []))
        self.environment = properties.get("ENVIRONMENT", [])
        files, nodes = backtrace["files"], backtrace["nodes"]
        node = nodes[entry["backtrace"]] if "backtrace" in entry else None
        self.folder = inside(os.path.dirname(files[node["file"]])) if node else ""


def known_tests(graph):
    """Returns all tests in the order of ctest. `folder` is only set for tests that are not cases of an executable."""
    found = json.loads(output("ctest", "--show-only=json-v1", cwd=BUILD))
    tests = [Test(i + 1, entry, found["backtraceGraph"]) for i, entry in enumerate(found["tests"])]
    for test in tests:
        # ctest lists a single test for an executable that is not built yet.
        if test.name.endswith("_NOT_BUILT"):
            test.executable = "tests/" + test.name.removesuffix("_NOT_BUILT")
        if test.executable in graph.own:
            test.folder = ""
    return tests


def room_of(path):
    parts = path.split("/")
    return "/".join(parts[:2] if parts[0] == "clients" else parts[:1])


def includes(source, header):
    try:
        return f'#include "{header}"' in (ROOT / source).read_text()
    except OSError:
        return False


def choose(changed, graph, tests):
    """Selects the tests for the changed files.

    Returns the executables, the folders of the other tests, and the set of those whose own files have changed.
    """
    executables, folders, own = set(), {"tests/rules/documents"}, set()
    labels = collections.defaultdict(set)
    for test in tests:
        labels[test.executable] |= test.labels
    of_cases = {name for name in graph.own if name in labels}
    other_folders = {test.folder for test in tests if test.folder}
    executables |= {name for name in of_cases if "tests/rules/rooms" in graph.folders(name)}

    def tests_near(folder):
        """Returns the tests of `folder`, or of the closest parent folder that has any."""
        while folder.count("/") >= 1:
            found = {name for name in of_cases if folder in graph.folders(name)}
            if found or folder in other_folders:
                return found, {folder} & other_folders
            folder = os.path.dirname(folder)
        return set(), set()

    for path in changed:
        users = graph.users.get(path, set())
        if path.startswith("tests/") and users:
            chosen = {name for name in of_cases if graph.own[name] & users}
            own |= chosen
            executables |= chosen
            if chosen:
                continue
        if path.startswith("tests/"):
            near, other = tests_near(os.path.dirname(path))
            executables |= near
            folders |= other
            own |= near | other
        elif path.partition("/")[0] in ("core", "protocol", "devices", "server", "clients"):
            near, other = tests_near("tests/" + os.path.dirname(path))
            room = "tests/" + room_of(path)
            header = re.sub(r"\.cc$", ".h", path)
            for name in of_cases:
                sources = {path for o in graph.own[name] for path in graph.sources.get(o, []) if path.startswith(room + "/")}
                if sources and ("property" in labels[name] or any(includes(source, header) for source in sources)):
                    near.add(name)
            executables |= near
            folders |= other
    return executables, folders, own


def run(name, *command, environment=None):
    """Runs a command. The output is only printed if the command fails."""
    say(name)
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, **(environment or {})}, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace", check=False)
    if done.returncode:
        print(done.stdout, end="")
        say(f"FAILED: {name}")
        sys.exit(1)


def main():
    # If there is already a build, it may be the build of deploy/demo, which does not have tests.
    run("configure release", "cmake", "--preset", "release", "-DTENDON_TESTS=ON")
    changed, since = changed_files(sys.argv[1] if len(sys.argv) > 1 else "")
    say(f"changed {since}: {len(changed)} {'file' if len(changed) == 1 else 'files'}")
    subprocess.run(["ninja", "-C", str(BUILD), "--quiet", "build.ninja"], stdout=subprocess.DEVNULL, check=True)
    graph = Graph()
    executables, folders, own = choose(changed, graph, known_tests(graph))
    touched = set().union(*(graph.users.get(path, set()) for path in changed))
    programs = {name for name in graph.own if name.startswith("bin/") and graph.own[name] & touched}
    sources = [path for path in changed if re.search(r"\.(cc|h)$", path) and (ROOT / path).exists()]
    if sources:
        run("clang-format", "clang-format", "--dry-run", "--Werror", *sources)
    targets = sorted(executables | programs)
    run(f"build {' '.join(os.path.basename(target) for target in targets)}", "ninja", "-C", str(BUILD), "--quiet", *targets)

    # The test cases may have changed in the build.
    tests = known_tests(graph)
    missing = [name for name in graph.own if name.startswith("bin/") and not (BUILD / name).exists()]
    chosen = [
        test for test in tests
        if (test.executable in executables or test.folder in folders) and
        (not test.labels & SLOW or test.executable in own or test.folder in own) and not (missing and test.wants_programs)
    ]
    fewer = {}
    for test in chosen:
        for variable in test.environment:
            if variable.startswith("RC_PARAMS="):
                fewer[test.executable] = re.sub(r"max_success=\d+", f"max_success={PROPERTY_CASES}", variable.partition("=")[2])
    for executable, parameters in sorted(fewer.items()):
        run(f"{executable}: {PROPERTY_CASES} cases for each property", str(BUILD / executable), "--gtest_brief=1",
            environment={"RC_PARAMS": parameters})
    numbers = [str(test.number) for test in chosen if test.executable not in fewer]
    run(f"{len(numbers)} tests", "ctest", "--test-dir", str(BUILD), "--output-on-failure", "-j", str(os.cpu_count()), "-I",
        ",".join(["0", "0", "0", *numbers]))

    left = len(tests) - len(chosen)
    built = set().union(*(graph.linked[target] for target in targets)) if targets else set()
    not_linked = [name for name in graph.linked if graph.linked[name] & touched and name not in targets]
    say(f"passed: {len(chosen)} of {len(tests)} tests")
    print(f"  Not run: the other {left} tests, the commands of the READMEs, the steps that only deploy/test --all has"
          + (f"; properties were only tested with {PROPERTY_CASES} cases" if fewer else "") + ".")
    if missing:
        print(f"  Not run: the commands in documents, because {len(missing)} programs are not built.")
    if not_linked:
        print(f"  Not linked with the change: {len(not_linked)} other programs and test programs.")
    if touched - built:
        print(f"  Not compiled with the change: {len(touched - built)} sources that include it.")


if __name__ == "__main__":
    main()
