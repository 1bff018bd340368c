# SPDX-License-Identifier: Apache-2.0
"""The server side of the stream to one worker, written from clients/cpp/worker/stream.h."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT
from processes import PATIENCE_S

from tendon import DeviceState, Mode, codec
from tendon.messages import ForceCommand

SECRET = "0123456789abcdef" * 4
HAND = DeviceState(7, 12_000_000, (0.01, -0.02, 0.03), (0, 0, 0.5), (0, 0, 1), 0.25, 8, 0, 0, 0, Mode.ACTIVE)


class Proxy:
    def __init__(self, road: str, folder: Path) -> None:
        if road == "unix":
            self._listener = socket.socket(socket.AF_UNIX)
            self._listener.bind(str(folder / "proxy"))
            self.address = f"unix:{folder / 'proxy'}"
        else:
            self._listener = socket.socket()
            self._listener.bind(("127.0.0.1", 0))
            self.address = f"tcp:127.0.0.1:{self._listener.getsockname()[1]}"
        self._listener.listen()
        self.link = self._listener

    def accept(self, patience_s: float = PATIENCE_S) -> tuple[int, bytes]:
        """Waits for the worker to connect. Returns its first record."""
        self._listener.settimeout(patience_s)
        self.link, _ = self._listener.accept()
        self.link.settimeout(PATIENCE_S)
        return self.read()

    def read(self) -> tuple[int, bytes]:
        length = int.from_bytes(self._take(4), "little")
        record = self._take(length)
        return int.from_bytes(record[:8], "little"), record[8:]

    def say(self, sequence: int, body: bytes) -> None:
        self.link.sendall((8 + len(body)).to_bytes(4, "little") + sequence.to_bytes(8, "little") + body)

    def ask(self, sequence: int, hand: DeviceState) -> ForceCommand | None:
        """Sends a state and returns the answer, which must have the same sequence number."""
        self.say(sequence, codec.write_frame(hand))
        answered, body = self.read()
        assert answered == sequence
        content = codec.read_data(body)
        assert content is not None and content.invalid == 0 and len(content.frames) <= 1
        return content.frames[0] if content.frames else None

    def close(self) -> None:
        self.link.close()
        self._listener.close()

    def _take(self, size: int) -> bytes:
        taken = b""
        while len(taken) < size:
            piece = self.link.recv(size - len(taken))
            assert piece, "the worker has ended the stream"
            taken += piece
        return taken


def mpirun(*command: str | Path) -> list[str]:
    """Returns a command line that runs `command` on two ranks. The machine may be busy."""
    if shutil.which("mpirun") is None or find_spec("mpi4py") is None:
        pytest.skip("no openmpi-bin or python3-mpi4py")
    words = ["mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n", "2", *command]
    return [str(word) for word in words]


@contextmanager
def running(command: Sequence[str | Path], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """Runs a worker with the package in this tree until the end of the `with` block. Tests in containers run as root,
    which Open MPI only accepts with these variables.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python"), "OMP_NUM_THREADS": "1"}
    environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    program = subprocess.Popen([str(word) for word in command], env=environment, **options)
    try:
        yield program
    finally:
        program.terminate()  # mpirun also ends its ranks
        program.wait(PATIENCE_S)
