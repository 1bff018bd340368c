# SPDX-License-Identifier: Apache-2.0
"""Starts tendond and tendon-bridge on loopback for tests and measurements. Their output goes to files in `folder`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
PROGRAMS = Path(os.environ.get("TENDON_PROGRAMS", ROOT / "build" / "release" / "bin"))
PATIENCE_S = 30

STILL = """[device]
kind = "simulated"
profile = "falcon"

[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05

[device.hand.motion]
kind = "sine"
amplitude_mm = 0
frequency_hz = 1

[limiter]
kind = "none"
"""
"""A hand that only moves if a force acts on it."""

BUTTON = (
    STILL
    + "".join(f"\n[[device.hand.press]]\nbutton = 0\nfrom_ms = {at}\nfor_ms = 200\n" for at in range(500, 6000, 500))
)
"""Presses the button for 200 ms every 0.5 s."""


class Program:
    """A running program, which is killed at the end of the `with` block."""

    def __init__(self, folder: Path, name: str, *arguments: str | Path) -> None:
        self.out = folder / f"{name}-{time.monotonic_ns()}.out"
        self.err = self.out.with_suffix(".err")
        command = [str(PROGRAMS / name), *map(str, arguments)]
        with open(self.out, "wb") as out, open(self.err, "wb") as err:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, cwd=folder)

    def wait_for(self, text: str) -> str:
        """Returns the first line that contains `text`, including earlier lines."""
        end = time.monotonic() + PATIENCE_S
        while True:
            said = self.out.read_text() + self.err.read_text()
            for line in said.splitlines():
                if text in line:
                    return line
            assert time.monotonic() < end and self.process.poll() is None, f'waited in vain for "{text}":\n{said}'
            time.sleep(0.02)

    def address(self, key: str = "address") -> str:
        return str(json.loads(self.wait_for(f'"{key}":'))[key])

    def counts(self) -> dict:
        """Waits for the next JSON line."""
        lines = self.out.read_text().count("\n")
        end = time.monotonic() + PATIENCE_S
        while self.out.read_text().count("\n") <= lines:
            assert time.monotonic() < end and self.process.poll() is None, self.err.read_text()
            time.sleep(0.02)
        return self.last_counts()

    def last_counts(self) -> dict:
        """Returns the last complete JSON line."""
        return dict(json.loads(self.out.read_text().rpartition("\n")[0].splitlines()[-1]))

    def size(self) -> int:
        """The size of the JSON output so far, in bytes."""
        return self.out.stat().st_size

    def stop(self) -> None:
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(PATIENCE_S) == 0, self.err.read_text()

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()


def server(
    folder: Path, scene: str = STILL, *more: str | Path, listen: str = "127.0.0.1:0", duration_s: float = 300
) -> Program:
    file = folder / "scene.toml"
    file.write_text(scene)
    return Program(folder, "tendond", file, "--listen", listen, "--duration-s", str(duration_s), "--json", *more)


def bridge(folder: Path, address: str, *more: str) -> Program:
    common = ["vrpn", "--server", address, "--listen", "127.0.0.1:0", "--json", "--duration-s", "300"]
    return Program(folder, "tendon-bridge", *common, *more)
