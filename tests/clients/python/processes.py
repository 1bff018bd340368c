# SPDX-License-Identifier: Apache-2.0
"""Real programs on loopback. All waits have a timeout of 30 s, because virtual machines may pause."""

from __future__ import annotations

import contextlib
import io
import json
import os
import runpy
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import pytest
from conftest import ROOT

PATIENCE_S = 30
PROGRAMS = Path(os.environ.get("TENDON_PROGRAMS", ROOT / "build" / "release" / "bin"))
EXAMPLES = ROOT / "clients" / "python" / "examples"


def scene(name: str) -> str:
    """Returns a scene of deploy/scenes. Its hand presses into x > 0."""
    return (ROOT / "deploy" / "scenes" / f"{name}.toml").read_text(encoding="utf-8")


class Process:
    """A running program, which is killed at the end of the `with` block. Its stdout and stderr form one sequence of
    lines.
    """

    def __init__(self, folder: Path, command: Sequence[str | Path]) -> None:
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python"), "PYTHONUNBUFFERED": "1"}
        self._process = subprocess.Popen(
            [str(word) for word in command],
            cwd=folder,
            env=environment,
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self.said: list[str] = []
        self._lines: Queue[str | None] = Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_for_line(self, text: str) -> str:
        """Waits for the next line that contains `text`."""
        while True:
            try:
                line = self._lines.get(timeout=PATIENCE_S)
            except Empty:
                line = None
            if line is None:
                pytest.fail(f'waited in vain for "{text}"; it has said:\n' + "".join(self.said))
            self.said.append(line)
            if text in line:
                return line

    def wait(self) -> int:
        """Waits for the exit code."""
        code = self._process.wait(PATIENCE_S)
        while (line := self._lines.get(timeout=PATIENCE_S)) is not None:
            self.said.append(line)
        return code

    def stop(self, number: int = signal.SIGTERM) -> int:
        self._process.send_signal(number)
        return self.wait()

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)


def tendond() -> Path:
    program = PROGRAMS / "tendond"
    if not program.exists():
        pytest.skip(f"{program} is not built; TENDON_PROGRAMS names another folder")
    return program


class Server(Process):
    """tendond with the demo scene: a hand that presses into x > 0 twice per second."""

    def __init__(
        self,
        folder: Path,
        listen: str = "127.0.0.1:0",
        keys: Path | None = None,
        scenes: Mapping[str, str] | None = None,
    ) -> None:
        """If `keys` is set, it is a folder of key files, and only clients with one of these keys can connect. `scenes`
        maps device names to scenes."""
        if scenes is None:
            text = scene("demo")
            if keys is not None:
                text += f'\n[network]\nkeys = "{keys}"\n'
            scenes = {"scene": text}
        files = [folder / f"{name}.toml" for name in scenes]
        for file, text in zip(files, scenes.values()):
            file.write_text(text, encoding="utf-8")
        super().__init__(folder, [tendond(), *files, "--listen", listen, "--duration-s", "120", "--json"])
        self.address = str(json.loads(self.wait_for_line('"listening"'))["address"])

    def end(self) -> dict[str, Any]:
        """Stops the server. Returns its summary."""
        assert self.stop() == 0
        return summary_of(self, '"stopped"')


def example(folder: Path, name: str, *arguments: str | Path) -> Process:
    return Process(folder, [sys.executable, EXAMPLES / f"{name}.py", *arguments])


def said_by_example(name: str, *arguments: str) -> tuple[int, str, str]:
    """Runs an example and returns its exit code and the contents of stdout and stderr.

    It runs in this process, because a new process needs a third of a second to import the package.
    """
    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = [str(EXAMPLES / f"{name}.py"), *arguments]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pytest.raises(SystemExit) as end:
            runpy.run_path(sys.argv[0], run_name="__main__")
    finally:
        sys.argv = before
    return end.value.code, out.getvalue(), err.getvalue()


def summary_of(process: Process, mark: str = '"summary"') -> dict[str, Any]:
    (line,) = (line for line in process.said if line.startswith("{") and mark in line)
    return dict(json.loads(line))
