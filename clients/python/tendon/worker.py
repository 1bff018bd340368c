# SPDX-License-Identifier: Apache-2.0
"""A worker: a program that a front starts and asks, and that may take its time, stop or die.

    import tendon

    tendon.worker.run(lambda hand: [-500 * x for x in hand.position])

The front is `tendon-fem serve --worker "python3 FILE"` or another program with clients/cpp/worker. It owns the session
with the server; clients/cpp/worker/stream.h has the bytes between the two. On many ranks of MPI,

    from mpi4py import MPI

    tendon.worker.run(answer, MPI.COMM_WORLD)

rank 0 alone speaks to the front. `tendon-conformance worker -- python3 FILE` tests such a program.
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
"""The environment of a worker: unix:PATH or tcp:HOST:PORT, and the secret that opens the stream."""

OPENING_MAGIC = b"tendon worker 1\n"

_LENGTH_BYTES = 4
_SEQUENCE_BYTES = 8


class Communicator(Protocol):
    """What run() needs of mpi4py's communicators, so that this package does not need mpi4py."""

    def Get_rank(self) -> int: ...

    def bcast(self, obj: Any, root: int = 0) -> Any: ...

    def Abort(self, errorcode: int = 0) -> Any: ...


def run(answer: Physics, comm: Communicator | None = None) -> None:
    """Answers every state by `answer` until the front ends the stream. None is the answer where no force is known.

    With `comm` every rank calls this: each state is given to `answer` on every rank, the same one at once, and the
    answer of rank 0 is sent. An exception of `answer` passes through; with `comm` it is printed and ends all ranks,
    because the others may wait for this one for ever. The front then starts the next worker.

    A number that is not finite or out of bounds is sent as it is: the front refuses it, counts it and says so.

    Raises RuntimeError when the environment has no address or no secret, "TENDON_WORKER_ADDRESS: …", when it is of
    another form, and when what comes is no state; ConnectionError when no front listens there; ValueError when an
    answer has a wrong shape. On all other ranks an error of the stream is its end.
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
    """A worker's end of the stream to its front, for a loop of your own. run() has all that most programs need."""

    def __init__(self) -> None:
        """Connects to where the environment says, and opens the stream: the program is ready to answer. Raises as
        run() does."""
        self._socket = _connected(_variable(ADDRESS_VARIABLE), OPENING_MAGIC + _variable(SECRET_VARIABLE).encode())
        self._bytes = bytearray()

    def next_state(self) -> tuple[int, DeviceState] | None:
        """Waits for the next state, and the sequence to answer it with; None when the front has ended the stream.
        Raises RuntimeError when what comes is no state."""
        if (head := self._take(_LENGTH_BYTES)) is None:
            return None
        length = int.from_bytes(head, "little")
        most = _SEQUENCE_BYTES + limits.MAX_DATAGRAM
        if not _SEQUENCE_BYTES <= length <= most:
            raise RuntimeError(f"the front has sent a record of {length} bytes: expected {_SEQUENCE_BYTES} to {most}")
        if (record := self._take(length)) is None:
            return None
        content = codec.read_data(record[_SEQUENCE_BYTES:])
        match content.frames if content is not None else ():
            case [DeviceState() as hand]:
                return int.from_bytes(record[:_SEQUENCE_BYTES], "little"), hand
        raise RuntimeError("the front has sent what is no state")

    def send(self, sequence: int, hand: DeviceState, touch: Touch | Sequence[float] | None) -> bool:
        """Answers the state `hand`, which came with `sequence`; None: no force is known. False when the stream has
        ended. Raises ValueError when `touch` has a wrong shape."""
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
        """The next bytes of the stream; None at its end."""
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
    """Rank 0. Whatever becomes of the stream, the others hear of its end."""
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
        limits.MAX_VALID_FOR_US,  # not used, but must be within its bounds
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
        raise RuntimeError(f"{name}: expected in the environment of a worker, which a front starts")
    return value


def _connected(address: str, opening: bytes) -> socket.socket:
    """A stream to `address` that has been opened."""
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
        raise ConnectionError(f"{ADDRESS_VARIABLE}: no front listens at {address}: {error}") from None
    return link


def _connected_to_path(path: str) -> socket.socket:
    link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        link.connect(path)
    except OSError:
        link.close()
        raise
    return link
