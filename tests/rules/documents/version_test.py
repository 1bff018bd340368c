# SPDX-License-Identifier: Apache-2.0
"""Checks that all files that contain the version of Tendon contain the version of project() in CMakeLists.txt.

These are the packages for Python and npm with their lock files, the newest release in CHANGELOG.md, the image tags of
deploy/kubernetes, and the pages that show file names, find_package() or the output of a program.

    version_test.py ROOT
"""

import json
import pathlib
import re
import subprocess
import sys

PROJECT = re.compile(r"^project\(tendon VERSION (\d+\.\d+\.\d+)", re.M)
RELEASE = re.compile(r"^## \[(\d\S*)\] - \d{4}-\d\d-\d\d$", re.M)
PAGES = r"(?!CHANGELOG).*\.(?:md|cmake\.in)"
# The name, files and pattern of the places in a text, which must be found at least once.
PLACES = (
    ("wheel", r"clients/python/pyproject\.toml", re.compile(r'^version = "(.*)"', re.M)),
    ("citation", r"CITATION\.cff", re.compile(r"^version: (.*)", re.M)),
    ("image", r"deploy/kubernetes/.*\.yaml", re.compile(r'newName: \S+/tendon[a-z-]*, newTag: "(.*)"')),
    ("file name", PAGES, re.compile(r"\b(?:lib)?tendon[a-z-]*_(\d+\.\d+\.\d+)_")),
    ("find_package", PAGES, re.compile(r"\bfind_package\(tendon (\S+?)[ )]")),
    ("output", PAGES, re.compile(r"\btendond (\d+\.\d+\.\d+)(?![.\d])")),
)


def found(path, text):
    """Yields (name, version) of each version in a file."""
    if path == "CHANGELOG.md":
        yield "release", next(iter(RELEASE.findall(text)), "none")
    elif path.endswith("/package.json"):
        package = json.loads(text)
        if "version" in package:
            yield "npm", package["version"]
    elif path.endswith("/package-lock.json"):
        lock = json.loads(text)
        # "" is the package itself. "../NAME" is another package of this repository.
        ours = [package for name, package in lock["packages"].items() if not name or name.startswith("../")]
        yield from (("lock", package["version"]) for package in (lock, *ours) if "version" in package)
    for name, files, pattern in PLACES:
        if re.fullmatch(files, path):
            yield from ((name, version) for version in pattern.findall(text))


def same(name, version, project):
    """find_package() only needs the first two numbers because of SameMinorVersion in deploy/packaging/package.cmake."""
    return version == project or name == "find_package" and version == project.rpartition(".")[0]


def check_the_rules():
    """Each kind of file must be read, and other numbers ignored."""

    def versions(path, text):
        return [version for _, version in found(path, text)]

    assert versions("CHANGELOG.md", "## [Unreleased]\n\n## [1.2.0] - 2026-01-02\n\n## [1.1.0] - 2026-01-01\n") == ["1.2.0"]
    assert versions("CHANGELOG.md", "## [Unreleased]\n") == ["none"]
    assert versions("clients/python/pyproject.toml", 'version = "1.2.0"\nrequires-python = ">=3.10"\n') == ["1.2.0"]
    assert versions("a/package.json", '{"version": "1.2.0", "dependencies": {"ws": "8.23.0"}}') == ["1.2.0"]
    assert versions("a/package.json", '{"private": true}') == []
    packages = '{"": {"version": "2"}, "../b": {"version": "3"}, "node_modules/ws": {"version": "4"}}'
    assert versions("a/package-lock.json", f'{{"version": "1", "packages": {packages}}}') == ["1", "2", "3"]
    tag = '- {name: tendon-fem, newName: registry.example/tendon-fem, newTag: "1.2.0"}'
    assert versions("deploy/kubernetes/a.yaml", tag) == ["1.2.0"]
    assert versions("a.md", "apt install ./libtendon-dev_1.2.0_amd64.deb") == ["1.2.0"]
    assert versions("a.md", "find_package(tendon 1.2 REQUIRED)") == ["1.2"]
    assert versions("a.md", "(tendond 1.2.0, 1000 Hz); tendond 127.0.0.1:47100") == ["1.2.0"]
    assert same("find_package", "1.2", "1.2.0") and not same("find_package", "1.1", "1.2.0")
    assert not same("npm", "1.2", "1.2.0")


def main():
    check_the_rules()
    root = pathlib.Path(sys.argv[1])
    [project] = PROJECT.findall((root / "CMakeLists.txt").read_text(encoding="utf-8"))
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=True).stdout.split("\n")
    wanted = {"release", "npm", "lock", *(name for name, _, _ in PLACES)}
    checked, bad = 0, []
    for path in listed:
        if not path.endswith((".md", ".in", ".toml", ".json", ".yaml", ".cff")) or not (root / path).is_file():
            continue
        for name, version in found(path, (root / path).read_text(encoding="utf-8")):
            wanted.discard(name)
            checked += 1
            if not same(name, version, project):
                bad.append(f"{path}: {name} {version}; CMakeLists.txt has {project}")
    bad += [f"no {name} is found any more" for name in sorted(wanted)]
    print("\n".join([*bad, f"{checked} versions, {len(bad)} errors"]))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
