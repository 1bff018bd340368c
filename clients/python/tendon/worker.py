# SPDX-License-Identifier: Apache-2.0
"""A worker is a program that computes forces for a proxy. It may be slow, stop or crash.

    import tendon

    tendon.worker.run(lambda hand: [-500 * x for x in hand.position])

The proxy owns the session with the server. It is `tendon-fem serve --worker "python3 FILE"` or another program
based on clients/cpp/worker; the protocol is described in clients/cpp/worker/stream.h. With several MPI ranks,

    from mpi4py import MPI

    tendon.worker.run(answer, MPI.COMM_WORLD)

only rank 0 communicates with the proxy. `tendon-conformance worker -- python3 FILE` tests a worker.
"""

from __future__ import annotations

import os
import socket
import traceback
from collections.abc import Sequence
from typing import Any, Protocol

from . import codec, limits
from .answer import read_touch
from .client import Physics
from .guest import parse_address
from .messages import DeviceState, ForceCommand, Touch

ADDRESS_VARIABLE = "TENDON_WORKER_ADDRESS"
SECRET_VARIABLE = "TENDON_WORKER_SECRET"
"""The environment variables of a worker. They contain the address, unix:PATH or tcp:HOST:PORT, and the secret."""

OPENING_MAGIC = b"tendon worker 1\n"

_LENGTH_BYTES = 4
_SEQUENCE_BYTES = 8


class Communicator(Protocol):
    """The part of mpi4py's communicator that run() uses, so that this package does not depend on mpi4py."""

    def Get_rank(self) -> int: ...

    def bcast(self, obj: Any, root: int = 0) -> Any: ...

    def Abort(self, errorcode: int = 0) -> Any: ...


def run(answer: Physics, comm: Communicator | None = None) -> None:
    """Answers each state with the result of `answer` until the proxy closes the stream. If the result is None, the
    force is not known.

    With `comm`, all ranks must call this function. `answer` is called with the same state on each rank, and the
    result of rank 0 is sent. Exceptions of `answer` propagate. With `comm`, they are printed and terminate all
    ranks, because the others could wait forever. The proxy then starts a new worker.

    If a force is not finite or out of bounds, it is sent unchanged. The proxy refuses, counts and reports it.

    Raises RuntimeError if the address or secret is missing in the environment ("TENDON_WORKER_ADDRESS: …") or
    malformed, or if a record is not a state; ConnectionError if no proxy listens there; ValueError if an answer
    has a wrong shape. The other ranks treat an error of the stream as its end.
    """
    if comm is None:
        with Stream() as stream:
            while (asked := stream.next_state()) is not None:
                if not stream.send(*asked, answer(asked[1])):
                    return
    elif comm.Get_rank() == 0:
        _lead(answer, comm)
    else:
        while (hand := comm.bcast(None, root=0)) is not None:
            _answer_or_abort(answer, hand, comm)


class Stream:
    """The worker's end of the stream to its proxy, for programs with their own loop. Most programs only need run()."""

    def __init__(self) -> None:
        """Connects to the address in the environment and opens the stream, which reports that the worker is ready.
        Raises as run() does."""
        self._socket = _connected(_variable(ADDRESS_VARIABLE), OPENING_MAGIC + _variable(SECRET_VARIABLE).encode())
        self._bytes = bytearray()

    def next_state(self) -> tuple[int, DeviceState] | None:
        """Blocks until there is a state, and returns its sequence number and the state. Returns None if the proxy has
        closed the stream. Raises RuntimeError if the record is not a state."""
        if (head := self._take(_LENGTH_BYTES)) is None:
            return None
        length = int.from_bytes(head, "little")
        most = _SEQUENCE_BYTES + limits.MAX_DATAGRAM
        if not _SEQUENCE_BYTES <= length <= most:
            raise RuntimeError(f"the proxy has sent a record of {length} bytes: expected {_SEQUENCE_BYTES} to {most}")
        if (record := self._take(length)) is None:
            return None
        content = codec.read_data(record[_SEQUENCE_BYTES:])
        match content.frames if content is not None else ():
            case [DeviceState() as hand]:
                return int.from_bytes(record[:_SEQUENCE_BYTES], "little"), hand
        raise RuntimeError("expected a state from the proxy, received something else")

    def send(self, sequence: int, hand: DeviceState, touch: Touch | Sequence[float] | None) -> bool:
        """Answers the state `hand` with that `sequence`. If `touch` is None, the force is not known. Returns False if
        the stream is closed. Raises ValueError if `touch` has a wrong shape."""
        body = b"" if touch is None else codec.write_frame(_command(sequence, hand, touch))
        if len(body) > limits.MAX_DATAGRAM:
            raise ValueError(f"the answer has {len(body)} bytes: expected at most {limits.MAX_DATAGRAM}")
        try:
            self._socket.sendall(_record(sequence, body))
        except OSError:
            return False
        return True

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take(self, size: int) -> bytes | None:
        """Returns the next `size` bytes of the stream, or None if the stream has ended."""
        while len(self._bytes) < size:
            try:
                piece = self._socket.recv(4096)
            except OSError:
                return None
            if not piece:
                return None
            self._bytes += piece
        taken = bytes(self._bytes[:size])
        del self._bytes[:size]
        return taken


def _lead(answer: Physics, comm: Communicator) -> None:
    """The loop of rank 0. Informs the other ranks of the end of the stream, also after errors."""
    try:
        with Stream() as stream:
            while (asked := stream.next_state()) is not None:
                comm.bcast(asked[1], root=0)
                touch = _answer_or_abort(answer, asked[1], comm)
                if not stream.send(*asked, touch):
                    return
    finally:
        comm.bcast(None, root=0)


def _answer_or_abort(answer: Physics, hand: DeviceState, comm: Communicator) -> Touch | Sequence[float] | None:
    try:
        return answer(hand)
    except BaseException:
        traceback.print_exc()
        comm.Abort(1)
        raise


def _command(sequence: int, hand: DeviceState, touch: Touch | Sequence[float]) -> ForceCommand:
    answer = read_touch(touch if isinstance(touch, Touch) else Touch(touch))
    return ForceCommand(
        sequence,
        hand.tick,
        answer.force,
        limits.MAX_VALID_FOR_US,  # ignored, but must be within its bounds
        answer.local_model(hand.position),
        topology_changed=answer.topology_changed,
        error=answer.error,
        torque=answer.turning(hand.turning),
        grip_force=answer.grip_force,
    )


def _record(sequence: int, body: bytes) -> bytes:
    length = _SEQUENCE_BYTES + len(body)
    return length.to_bytes(_LENGTH_BYTES, "little") + sequence.to_bytes(_SEQUENCE_BYTES, "little") + body


def _variable(name: str) -> str:
    value = os.environ.get(name)
    if not value:
        raise RuntimeError(f"{name}: expected in the environment of the worker, which is started by a proxy")
    return value


def _connected(address: str, opening: bytes) -> socket.socket:
    """Connects to `address` and sends `opening`."""
    kind, _, place = address.partition(":")
    try:
        host = parse_address(place) if kind == "tcp" else None
        if not place or (kind != "unix" and host is None):
            raise ValueError
    except ValueError:
        expected = "expected unix:PATH or tcp:HOST:PORT"
        raise RuntimeError(f'{ADDRESS_VARIABLE}: {expected}, found "{address}"') from None
    try:
        link = socket.create_connection(host) if host is not None else _connected_to_path(place)
        if host is not None:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link.sendall(_record(0, opening))
    except OSError as error:
        raise ConnectionError(f"{ADDRESS_VARIABLE}: no proxy is listening at {address}: {error}") from None
    return link


def _connected_to_path(path: str) -> socket.socket:
    link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        link.connect(path)
    except OSError:
        link.close()
        raise
    return link
