# SPDX-License-Identifier: Apache-2.0
"""Tests workers in Python with a proxy in Python, on several ranks, and with tendon-conformance."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from math import inf, isnan
from pathlib import Path
from queue import Queue

import pytest
from conftest import ROOT
from proxy import HAND, SECRET, Proxy, mpirun, running
from processes import EXAMPLES, PATIENCE_S, PROGRAMS

from tendon import Contact, DeviceState, ForceTable, Grip, Joints, Touch, Turning, codec, limits, tendon_pb2, worker

WHOLE_HAND = replace(
    HAND,
    tick=2**53 + 1,
    permitted_force=inf,
    reasons=0xFFFF,
    force_sequence=2**40,
    force_age_ns=12_000_000,
    device=15,
    channel=7,
    force_wanted=(1, -2, 3),
    stiffness_wanted=((500, 10, 0), (10, 400, 0), (0, 0, 300)),
    buttons=0xFFFF,
    turning=Turning((0.5, -0.5, 0.5, -0.5), (0.1, 0, -0.1)),
    torque_applied=(0.01, 0.02, -0.03),
    grip=Grip(0.4, -0.1),
    grip_applied=1.5,
    hand_force=(0.3, -0.4, 0.5),
    joints=Joints((0.1,) * 8, (0.01,) * 8),
)


@pytest.fixture(params=["unix", "tcp"])
def proxy(request, tmp_path, monkeypatch):
    it = Proxy(request.param, tmp_path)
    monkeypatch.setenv("TENDON_WORKER_ADDRESS", it.address)
    monkeypatch.setenv("TENDON_WORKER_SECRET", SECRET)
    yield it
    it.close()


class Running(threading.Thread):
    """Runs run() in a thread. Use `end()` to get the exception that was raised, or None."""

    def __init__(self, answer, comm=None):
        super().__init__(daemon=True)
        self._arguments = (answer, comm)
        self.error = None
        self.start()

    def run(self):
        try:
            worker.run(*self._arguments)
        except BaseException as error:
            self.error = error

    def end(self):
        self.join(PATIENCE_S)
        assert not self.is_alive()
        return self.error


def test_the_stream_opens_with_the_secret_and_its_end_ends_the_worker(proxy):
    thread = Running(lambda hand: None)
    assert proxy.accept() == (0, b"tendon worker 1\n" + SECRET.encode())
    proxy.close()
    assert thread.end() is None


def test_every_part_of_a_state_reaches_the_answer(proxy):
    seen = []
    thread = Running(lambda hand: seen.append(hand))
    proxy.accept()
    for sequence, hand in enumerate((HAND, WHOLE_HAND), 1):
        assert proxy.ask(sequence, hand) is None
    proxy.close()
    assert thread.end() is None
    assert seen == [HAND, WHOLE_HAND]


def test_every_part_of_a_touch_reaches_the_proxy_with_its_tick(proxy):
    table = ForceTable(0, 0.001, (1, 2, 3))
    touch = Touch(
        (1, 2, 3), 400, 0.01, Contact((0, 0, 1), -0.002, table), True, 0.5, (0.1, 0, 0), (1, 2, 3), -2.5
    )
    thread = Running(lambda hand: touch)
    proxy.accept()
    command = proxy.ask(1, WHOLE_HAND)
    proxy.close()
    assert thread.end() is None
    assert (command.sequence, command.based_on_tick, command.force) == (1, 2**53 + 1, (1, 2, 3))
    assert 1 <= command.valid_for_us <= limits.MAX_VALID_FOR_US
    assert command.model.at == HAND.position
    assert command.model.stiffness == ((400, 0, 0), (0, 400, 0), (0, 0, 400))
    assert (command.model.valid_radius, command.model.contact) == (0.01, Contact((0, 0, 1), -0.002, table))
    assert (command.topology_changed, command.error, command.grip_force) == (True, 0.5, -2.5)
    assert command.torque.torque == (0.1, 0, 0)
    assert command.torque.model.at == WHOLE_HAND.turning.orientation
    assert command.torque.model.stiffness == ((1, 0, 0), (0, 2, 0), (0, 0, 3))


def test_a_force_may_be_plain_numbers_and_none_is_no_force(proxy):
    answers = iter([[-5, 0, 0], None, (0, 0, 1)])
    thread = Running(lambda hand: next(answers))
    proxy.accept()
    assert proxy.ask(1, HAND).force == (-5, 0, 0)
    assert proxy.ask(2, HAND) is None
    assert proxy.ask(3, HAND).force == (0, 0, 1)
    proxy.close()
    assert thread.end() is None


def test_a_state_may_come_byte_by_byte(proxy):
    thread = Running(lambda hand: (hand.position[0], 0, 0))
    proxy.accept()
    body = codec.write_frame(WHOLE_HAND)
    for byte in (8 + len(body)).to_bytes(4, "little") + (1).to_bytes(8, "little") + body:
        proxy.link.sendall(bytes([byte]))
    sequence, answer = proxy.read()
    assert sequence == 1
    assert codec.read_data(answer).frames[0].force == (0.01, 0, 0)
    proxy.close()
    assert thread.end() is None


def test_a_force_that_is_no_number_goes_out_for_the_proxy_to_refuse(proxy):
    thread = Running(lambda hand: (float("nan"), 0, 0))
    proxy.accept()
    proxy.say(1, codec.write_frame(HAND))
    _, body = proxy.read()
    assert codec.read_data(body).invalid == 1
    assert isnan(tendon_pb2.Datagram.FromString(body).frames[0].force.force_n.x)
    proxy.close()
    assert thread.end() is None


@pytest.mark.parametrize(
    "touch, sentence",
    [
        ((1, 2), "expected a force of three numbers"),
        (Touch(stiffness=(1, 2)), "expected a stiffness of one number, three, or 3 × 3"),
        (Touch(contact=Contact((0, 0, 1), 0, ForceTable(0, 1, (1,) * 1000))), "expected at most 1200"),
    ],
)
def test_an_answer_of_a_wrong_shape_is_an_error_with_a_sentence(proxy, touch, sentence):
    thread = Running(lambda hand: touch)
    proxy.accept()
    proxy.say(1, codec.write_frame(HAND))
    error = thread.end()
    assert isinstance(error, ValueError) and sentence in str(error)


def test_an_exception_of_the_answer_passes_through(proxy):
    def fail(hand):
        raise ZeroDivisionError("singular")

    thread = Running(fail)
    proxy.accept()
    proxy.say(1, codec.write_frame(HAND))
    assert isinstance(thread.end(), ZeroDivisionError)


@pytest.mark.parametrize(
    "bytes_, sentence",
    [
        ((7).to_bytes(4, "little"), "a record of 7 bytes: expected 8 to 1208"),
        ((1209).to_bytes(4, "little"), "a record of 1209 bytes: expected 8 to 1208"),
        ((8).to_bytes(4, "little") + (1).to_bytes(8, "little"), "expected a state from the proxy"),
        ((10).to_bytes(4, "little") + (1).to_bytes(8, "little") + b"\xff\xff", "expected a state from the proxy"),
    ],
)
def test_a_proxy_that_sends_no_state_is_an_error_with_a_sentence(proxy, bytes_, sentence):
    thread = Running(lambda hand: None)
    proxy.accept()
    proxy.link.sendall(bytes_)
    error = thread.end()
    assert isinstance(error, RuntimeError) and sentence in str(error)


@pytest.mark.parametrize("missing", ["TENDON_WORKER_ADDRESS", "TENDON_WORKER_SECRET"])
def test_without_a_proxy_the_error_names_the_variable(proxy, monkeypatch, missing):
    monkeypatch.delenv(missing)
    with pytest.raises(RuntimeError, match=f"{missing}: expected in the environment of the worker"):
        worker.run(lambda hand: None)


@pytest.mark.parametrize("address", ["unix:", "udp:127.0.0.1:1", "tcp:127.0.0.1", "tcp:127.0.0.1:0", "127.0.0.1:4"])
def test_an_address_of_another_form_is_told_what_is_expected(proxy, monkeypatch, address):
    monkeypatch.setenv("TENDON_WORKER_ADDRESS", address)
    with pytest.raises(RuntimeError, match=f'expected unix:PATH or tcp:HOST:PORT, found "{address}"'):
        worker.run(lambda hand: None)


def test_where_no_proxy_listens_the_error_names_the_place(proxy):
    proxy.close()
    Path(proxy.address.removeprefix("unix:")).unlink(missing_ok=True)
    with pytest.raises(ConnectionError, match=f"TENDON_WORKER_ADDRESS: no proxy is listening at {proxy.address}: "):
        worker.run(lambda hand: None)


class Rank:
    """One of several ranks, which are threads, with the interface of mpi4py that run() uses."""

    def __init__(self, number: int, mail: list[Queue]) -> None:
        self.number = number
        self._mail = mail
        self.aborted: list[int] = []

    def Get_rank(self) -> int:
        return self.number

    def bcast(self, obj, root=0):
        assert root == 0
        if self.number > 0:
            return self._mail[self.number].get(timeout=PATIENCE_S)
        for box in self._mail[1:]:
            box.put(obj)
        return obj

    def Abort(self, errorcode=0):
        self.aborted.append(errorcode)


def ranks(count: int) -> list[Rank]:
    mail: list[Queue] = [Queue() for _ in range(count)]
    return [Rank(number, mail) for number in range(count)]


def test_every_rank_gets_each_state_and_rank_0_answers(proxy):
    seen: list[list[DeviceState]] = [[], [], []]

    def answer_of(rank):
        return lambda hand: seen[rank.number].append(hand) or (float(rank.number), 0, 0)

    threads = [Running(answer_of(rank), rank) for rank in ranks(3)]
    proxy.accept()
    assert proxy.ask(1, HAND).force == (0, 0, 0)
    assert proxy.ask(2, WHOLE_HAND).force == (0, 0, 0)
    proxy.close()
    assert [one.end() for one in threads] == [None] * 3
    assert seen == [[HAND, WHOLE_HAND]] * 3


def test_a_rank_that_fails_ends_all_of_them(proxy, capsys):
    first, second = ranks(2)
    threads = [Running(lambda hand: None, first), Running(lambda hand: 1 / 0, second)]
    proxy.accept()
    proxy.say(1, codec.write_frame(HAND))
    assert isinstance(threads[1].end(), ZeroDivisionError)
    assert second.aborted == [1]
    assert "ZeroDivisionError" in capsys.readouterr().err
    proxy.close()
    assert threads[0].end() is None


def test_without_a_proxy_the_other_ranks_end(proxy):
    proxy.close()
    Path(proxy.address.removeprefix("unix:")).unlink(missing_ok=True)
    threads = [Running(lambda hand: None, rank) for rank in ranks(2)]
    assert isinstance(threads[0].end(), ConnectionError)
    assert threads[1].end() is None


ON_RANKS = """
from mpi4py import MPI
import tendon

comm = MPI.COMM_WORLD


def answer(hand):
    if hand.buttons and comm.rank == 1:
        raise ArithmeticError("on rank 1")
    return (comm.allreduce((comm.rank + 1) * hand.position[0]), comm.rank, comm.size)


tendon.worker.run(answer, comm)
"""


def on_ranks(tmp_path: Path) -> AbstractContextManager[subprocess.Popen[str]]:
    script = tmp_path / "on_ranks.py"
    script.write_text(ON_RANKS, encoding="utf-8")
    return running(mpirun(sys.executable, script), stderr=subprocess.PIPE, text=True)


def test_two_ranks_of_mpi_answer_together_and_a_failure_of_one_ends_both(proxy, tmp_path):
    with on_ranks(tmp_path) as program:
        assert proxy.accept() == (0, b"tendon worker 1\n" + SECRET.encode())
        for sequence in range(1, 20):
            assert proxy.ask(sequence, HAND).force == pytest.approx((0.03, 0, 2))
        proxy.say(20, codec.write_frame(replace(HAND, buttons=1)))
        _, said = program.communicate(timeout=PATIENCE_S)
        assert program.returncode != 0
        assert "ArithmeticError: on rank 1" in said


def test_two_ranks_of_mpi_end_with_the_stream(proxy, tmp_path):
    with on_ranks(tmp_path) as program:
        proxy.accept()
        proxy.ask(1, HAND)
        proxy.close()
        program.communicate(timeout=PATIENCE_S)
        assert program.returncode == 0


# ---- tendon-conformance: programs that must pass, and programs that must fail ----


BROKEN = "import os, sys, time\nimport tendon\nrun = tendon.worker.run\n"


@contextmanager
def judging(folder: Path, *command: str | Path) -> Iterator[Callable[[], dict[str, str]]]:
    """Runs tendon-conformance. The function that it yields returns the result of each check."""
    kit = PROGRAMS / "tendon-conformance"
    if not kit.exists():
        pytest.skip(f"{kit} is not built; TENDON_PROGRAMS names another folder")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python")}
    words = [kit, "worker", "--json", "--log", folder / "log", "--", *command]

    def verdicts() -> dict[str, str]:
        said, _ = process.communicate(timeout=4 * PATIENCE_S)
        results = {line["check"]: line["result"] for line in map(json.loads, said.splitlines())}
        assert (process.returncode == 0) == (set(results.values()) <= {"pass", "not applicable"})
        return results

    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield verdicts
        finally:
            process.terminate()


def failed_checks(verdicts: dict[str, str]) -> list[str]:
    return [check for check, result in verdicts.items() if result == "fail"]


@pytest.fixture(scope="module")
def of_an_endless_worker(tmp_path_factory):
    """This worker hangs when its second stream ends. The timeout of 10 s runs while the others are tested."""
    folder = tmp_path_factory.mktemp("endless")
    program = "run(lambda hand: None)\nif os.environ['TENDON_WORKER_ADDRESS'].startswith('tcp:'): time.sleep(100)\n"
    (folder / "broken.py").write_text(BROKEN + program, encoding="utf-8")
    with judging(folder, sys.executable, folder / "broken.py") as verdicts:
        yield verdicts


def test_the_kit_passes_the_example(tmp_path, of_an_endless_worker):
    with judging(tmp_path, sys.executable, EXAMPLES / "spring_worker.py") as verdicts:
        assert set(verdicts().values()) == {"pass"}


@pytest.mark.parametrize(
    "program, failed",
    [
        ("raise SystemExit(3)", "stream-opens"),
        ("tendon.worker.OPENING_MAGIC = b'tendon worker 2'; run(lambda hand: None)", "stream-opens"),
        ("run(lambda hand: (float('nan'), 0, 0))", "answer-bounds"),
        ("run(lambda hand: 1 / 0)", "answer-comes"),
        ("run(lambda hand: (0, 0, 0) if hand.buttons == 0 else sys.exit())", "state-of-a-handle"),
    ],
)
def test_the_kit_fails_a_program_that(tmp_path, program, failed):
    script = tmp_path / "broken.py"
    script.write_text(f"{BROKEN}{program}\n", encoding="utf-8")
    with judging(tmp_path, sys.executable, script) as verdicts:
        assert failed_checks(verdicts()) == [failed]


def test_the_kit_fails_a_program_that_does_not_end_with_its_stream(of_an_endless_worker):
    assert failed_checks(of_an_endless_worker()) == ["stream-ends"]
