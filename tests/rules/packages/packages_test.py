# SPDX-License-Identifier: Apache-2.0
"""Configures Tendon with a copy of this machine's /usr in which some files are missing and others are added.

The configuration must succeed, print one line for each part that is left out, and build all programs except for the
ones that are named. All paths are relative to /usr, and each name in a path is a regular expression. The result is
compared to the existing build on this machine, so the test does not fail if a package is not installed here."""
import argparse
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).parent


def mirror(source, target, hidden):
    """Creates links in `target` to all files in `source` that are not in `hidden`.

    A folder that contains a hidden file is created, and its other files are linked one by one."""
    target.mkdir(parents=True)
    for entry in os.scandir(source):
        below = [rest for name, _, rest in (path.partition("/") for path in hidden) if re.fullmatch(name, entry.name)]
        if below and all(below) and entry.is_dir():
            mirror(entry.path, target / entry.name, below)
        elif not below or all(below):
            (target / entry.name).symlink_to(entry.path)


def put(folder, target, words):
    """Copies the files of `folder`. NAME.link contains the target of a symbolic link NAME, because some copies of a
    repository do not preserve symbolic links.
    """
    for file in (path for path in folder.rglob("*") if path.is_file()):
        made = target / file.relative_to(folder)
        made.parent.mkdir(parents=True, exist_ok=True)
        assert made.parent.resolve() == made.parent, f"{made.parent} is this machine's own"
        made.unlink(missing_ok=True)
        if file.suffix == ".link":
            made.with_suffix("").unlink(missing_ok=True)
            made.with_suffix("").symlink_to(file.read_text().strip())
            continue
        text = file.read_text()
        for word, value in words.items():
            text = text.replace(f"@{word}@", value)
        made.write_text(text)
        made.chmod(file.stat().st_mode)


def run(*command, fails_with=None, **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if fails_with and (not done.returncode or fails_with not in done.stdout):
        sys.exit(f'does not fail with "{fails_with}":\n{done.stdout}')
    if done.returncode and not fails_with:
        sys.exit(f"{shlex.join(map(str, command))} fails:\n{done.stdout}")
    return done.stdout


def programs(ninja, build):
    targets = run(ninja, "-C", build, "-t", "targets", "all")
    return set(re.findall(r"^(?:bin|tests)/([^/:\n]+): CXX_EXECUTABLE", targets, re.MULTILINE))


def check_missing_page(ninja, build, source):
    """If Node is not installed, the page of tendon-dash only contains missing.html."""
    commands = run(ninja, "-C", build, "-t", "commands", "clients/dashboard/page_files.cc").splitlines()
    run("sh", "-c", next(command for command in commands if "embed.cmake" in command), cwd=build)
    pages = [page for page in (build / "clients/dashboard/page").rglob("*") if page.is_file()]
    if [page.read_text() for page in pages] != [(source / "clients/dashboard/missing.html").read_text()]:
        sys.exit(f"the page is not missing.html alone, but {pages}")
    embedded = (build / "clients/dashboard/page_files.cc").read_text()
    if '{"/index.html", "text/html' not in embedded:
        sys.exit(f"the page is not in the program:\n{embedded}")


def main():
    options = argparse.ArgumentParser(description=__doc__)
    for path in ("source", "build", "out"):
        options.add_argument(f"--{path}", type=pathlib.Path, required=True)
    for word in ("cmake", "ninja", "compiler", "triple"):
        options.add_argument(f"--{word}", required=True)
    options.add_argument("--hide", nargs="*", default=[], help="paths that this machine shall not have")
    options.add_argument("--put", nargs="*", default=[], help="folders in put/ of files that it shall have")
    options.add_argument("--hide-put", nargs="*", default=[], help="files of these that it shall not have")
    options.add_argument("--says", nargs="*", default=[], help="how each line of what is left out begins")
    options.add_argument("--may-say", nargs="*", default=[], help="how a line begins that depends on the machine")
    options.add_argument("--gone", nargs="*", default=[], help="programs that are not built")
    options.add_argument("--there", nargs="*", default=[], help="programs that are built")
    options.add_argument("--fails-with", help="what the configuration ends with, in place of all this")
    options.add_argument("--no-tests", action="store_true", help="configures the programs alone")
    options.add_argument("--missing-page", action="store_true", help="looks at the page of tendon-dash")
    options = options.parse_args()

    shutil.rmtree(options.out, ignore_errors=True)
    options.out = options.out.resolve()
    root = options.out / "root"
    # These folders must not be links, because a test case may add files to them. /usr/local is hidden because it does
    # not contain Debian packages.
    mirror("/usr", root / "usr", ["bin/-", "include/-", "lib/pkgconfig/-", f"lib/{options.triple}/-", "share/-", "local",
                                  *options.hide])
    for folder in ("bin", "lib", "lib64", "sbin"):
        (root / folder).symlink_to(f"usr/{folder}")
    for folder in options.put:
        put(HERE / "put" / folder, root / "usr", {"TRIPLE": options.triple, "ROOT": str(root)})
    for file in options.hide_put:
        (root / "usr" / file).unlink()

    search = [root / "usr/lib/pkgconfig", root / f"usr/lib/{options.triple}/pkgconfig", root / "usr/share/pkgconfig"]
    environment = {"PATH": f"{root}/usr/bin", "PKG_CONFIG_LIBDIR": ":".join(map(str, search)),
                   "PKG_CONFIG_SYSROOT_DIR": str(root)}
    kept = ("HOME", "LANG", "TMPDIR")
    environment |= {name: os.environ[name] for name in kept if name in os.environ}
    build = options.out / "build"
    said = run(options.cmake, "-S", options.source, "-B", build, "-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={options.ninja}",
               f"-DCMAKE_CXX_COMPILER={options.compiler}", "-DCMAKE_BUILD_TYPE=RelWithDebInfo", f"-DCMAKE_SYSROOT={root}",
               *(f"-DCMAKE_FIND_ROOT_PATH_MODE_{kind}=ONLY" for kind in ("PROGRAM", "LIBRARY", "INCLUDE", "PACKAGE")),
               f"-DTENDON_TESTS={'OFF' if options.no_tests else 'ON'}", fails_with=options.fails_with, env=environment)
    if options.fails_with:
        shutil.rmtree(options.out)
        return

    lines = re.findall(r"^-- Left out: (.*)$", said, re.MULTILINE)
    here = (options.build / "left_out.txt").read_text().splitlines()
    for wanted in options.says:
        if sum(line.startswith(wanted) for line in lines) != 1:
            sys.exit(f'does not say once "{wanted}":\n{said}')
    expected = tuple(options.says + options.may_say)
    others = [line for line in lines if not line.startswith(expected) and line not in here]
    if others:
        sys.exit(f"also leaves out {others}:\n{said}")
    if talk := re.search(r"CMake Warning|-- Found |Checking for module|Performing Test", said):
        sys.exit(f'says "{talk[0]}":\n{said}')

    ours, theirs = programs(options.ninja, options.build), programs(options.ninja, build)
    missed = set() if options.no_tests else ours - theirs - set(options.gone)
    if "tendond" not in theirs or missed or theirs & set(options.gone):
        sys.exit(f"goes without {missed}, and not without {theirs & set(options.gone)}")
    if lacking := set(options.there) - theirs:
        sys.exit(f"goes without {lacking}:\n{said}")
    run(options.ninja, "-C", build, "-n")  # checks that all input files exist or can be built
    if options.missing_page:
        check_missing_page(options.ninja, build, options.source)
    print("\n".join(lines))
    shutil.rmtree(options.out)


main()
