# SPDX-License-Identifier: Apache-2.0
"""Tests the package as it is installed by users: generated code, types, wheel, examples and README."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec

import pytest
from conftest import ROOT
from processes import said_by_example
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from tendon import tendon_pb2
from tendon.messages import Code, Mode, Role

PACKAGE = ROOT / "clients" / "python"
EXAMPLES = sorted((PACKAGE / "examples").glob("*.py"))
WORKERS = [file for file in EXAMPLES if "worker.run(" in file.read_text(encoding="utf-8")]
GUESTS = [file for file in EXAMPLES if file not in WORKERS]


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_generated_code_is_that_of_tendon_proto(tmp_path):
    """After a change of tendon.proto, run protocol/generate."""
    if shutil.which("protoc") is None:
        pytest.skip("no protoc: apt-get install protobuf-compiler")
    described = tmp_path / "tendon.bin"
    run("protoc", f"--proto_path={ROOT / 'protocol/wire'}", f"--descriptor_set_out={described}", "tendon.proto")
    (file,) = FileDescriptorSet.FromString(described.read_bytes()).file
    for message in file.message_type:
        for field in message.field:
            field.ClearField("json_name")  # protoc sets it in descriptor sets but not in generated code
    assert tendon_pb2.DESCRIPTOR.serialized_pb == file.SerializeToString(), "stale; run protocol/generate"


@pytest.mark.parametrize("ours, theirs", [(Code, "Code"), (Mode, "Mode"), (Role, "Role")])
def test_the_enums_are_those_of_tendon_proto(ours, theirs):
    values = tendon_pb2.DESCRIPTOR.enum_types_by_name[theirs].values_by_name
    expected = {name.removeprefix(theirs.upper() + "_"): value.number for name, value in values.items()}
    del expected["UNSPECIFIED"]
    assert {value.name: value.value for value in ours} == expected


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda file: file.name)
def test_an_example_is_a_program(example):
    assert os.access(example, os.X_OK)
    assert example.read_text(encoding="utf-8").startswith("#!/usr/bin/env python3\n")


def test_a_python_without_the_packages_is_told_both_remedies(tmp_path):
    """With conda, pyenv or uv, the first python3 in the path lacks Debian's packages."""
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    other = tmp_path / "venv" / "bin"
    environment = os.environ | {"PATH": f"{other}:{os.environ['PATH']}", "PYTHONPATH": str(PACKAGE)}
    example = PACKAGE / "examples" / "virtual_wall.py"
    done = subprocess.run([str(example)], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    said = done.stderr.splitlines()[-1]
    assert said.startswith(f"ImportError: tendon requires the packages protobuf and PyNaCl, which this Python ({other}/python3)")
    assert "apt install python3-protobuf python3-nacl" in said and "/usr/bin/python3" in said
    assert f"venv/bin/pip install {PACKAGE}" in said


def test_the_types_are_right():
    mypy = shutil.which("mypy")
    if mypy is None:
        pytest.skip("no mypy: apt-get install mypy")
    built = os.environ.get("TENDON_TEST_PROGRAMS")
    run(mypy, *([f"--cache-dir={built}/mypy"] if built else ["--no-incremental"]), cwd=PACKAGE)


def test_a_wheel_holds_the_package_with_its_types(tmp_path):
    if not all(map(find_spec, ("pip", "setuptools", "wheel"))):
        pytest.skip("no pip, setuptools or wheel: apt-get install python3-pip python3-wheel")
    source = tmp_path / "source"  # setuptools writes to the source folder
    shutil.copytree(PACKAGE, source, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "build"))
    run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "--no-index", "-w", tmp_path, source)
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("tendon/")}
    files = (PACKAGE / "tendon").rglob("*")
    there = {str(file.relative_to(PACKAGE)) for file in files if file.is_file() and file.parent.name != "__pycache__"}
    assert held == there
    assert {"tendon/py.typed", "tendon/tendon_pb2.pyi"} <= held


def test_the_version_is_that_of_the_project():
    project = re.search(r"project\(tendon VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))
    package = re.search(r'^version = "([\d.]+)"', (PACKAGE / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)
    assert package[1] == project[1]


@pytest.mark.parametrize("file", GUESTS, ids=lambda file: file.stem)
def test_an_example_has_at_most_30_lines_and_explains_itself(file):
    assert len(file.read_text(encoding="utf-8").splitlines()) <= 30
    help_text = run(sys.executable, file, "--help", env={"PYTHONPATH": str(PACKAGE), "PATH": ""})
    common = ("--server", "--key", "--device", "--channel", "--take-lease", "--rate-hz", "--duration-s", "--json")
    for word in (*common, f"Example: {file.stem}"):
        assert word in help_text
    for wrong in (["--server", "nowhere"], ["--rate-hz", "nan"], ["--duration-s", "-1"]):
        code, _, err = said_by_example(file.stem, *wrong)
        assert code == 2 and "expected" in err


@pytest.mark.parametrize("file", WORKERS, ids=lambda file: file.stem)
def test_an_example_of_a_worker_explains_itself(file):
    help_text = run(sys.executable, file, "--help", env={"PYTHONPATH": str(PACKAGE), "PATH": ""})
    assert f"Example: tendon-fem serve SCENE --worker \"python3 {file.name}\"" in help_text
    environment = os.environ | {"PYTHONPATH": str(PACKAGE)}
    done = subprocess.run([sys.executable, file], env=environment, capture_output=True, text=True)
    if "ModuleNotFoundError" in done.stderr:
        pytest.skip(done.stderr.splitlines()[-1])
    assert done.returncode == 1 and "TENDON_WORKER_ADDRESS: expected in the environment" in done.stderr


def test_the_code_on_the_page_compiles():
    blocks = re.findall(r"^```python\n(.*?)^```", (PACKAGE / "README.md").read_text(encoding="utf-8"), re.M | re.S)
    assert blocks
    for block in blocks:
        compile(block, "README.md", "exec")
