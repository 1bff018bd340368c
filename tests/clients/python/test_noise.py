# SPDX-License-Identifier: Apache-2.0
"""Tests cipher suites 1 and 2. Both roles are implemented in Python. The public vectors are in test_vectors.py."""


import pytest
from responder import Responder

from tendon import aes, noise
from tendon.cipher import OVERLAP_NS, RENEW_AFTER_NS, Forged, OldKey, Sealed
from tendon.codec import Suite


def handshake(psk=bytes(range(32)), other=None):
    initiator = noise.Initiator(psk, bytes(31) + b"\1", b"prologue", b"hello")
    responder = Responder(psk if other is None else other, b"prologue")
    return initiator, responder


def test_another_key_opens_nothing():
    initiator, responder = handshake(other=bytes(32))
    assert responder.read(initiator.message) is None


def test_a_changed_bit_of_the_answer_is_refused_and_the_good_one_opens():
    initiator, responder = handshake()
    responder.read(initiator.message)
    answer, _ = responder.reply(bytes(31) + b"\2", b"welcome")
    for bit in range(8 * len(answer)):
        if bit == 255:
            # X25519 ignores the highest bit of a point (RFC 7748), but the handshake hash includes it: see below
            continue
        forged = bytearray(answer)
        forged[bit // 8] ^= 1 << bit % 8
        assert initiator.read(bytes(forged)) is None, bit
    forged = bytearray(answer)
    forged[31] ^= 0x80
    assert initiator.read(bytes(forged)) is None
    assert initiator.read(answer)[0] == b"welcome"


@pytest.mark.parametrize("size", [0, 31, 32, 47])
def test_a_short_answer_is_not_authentic(size):
    initiator, _ = handshake()
    assert initiator.read(bytes(size)) is None


def test_a_point_of_low_order_is_not_authentic():
    initiator, _ = handshake()
    assert initiator.read(bytes(64)) is None


def test_the_keys_of_suite_2_are_bound_to_the_whole_handshake():
    one, other = noise.Split(bytes(32), bytes(31) + b"\1", bytes(32)), noise.Split(bytes(32), bytes(31) + b"\1", b"h" * 32)
    assert one.of_suite_2().initiator_to_responder != other.of_suite_2().initiator_to_responder
    assert one.of_suite_2().responder_to_initiator != other.of_suite_2().responder_to_initiator
    keys = {one.initiator_to_responder, one.responder_to_initiator}
    assert not keys & {one.of_suite_2().initiator_to_responder, one.of_suite_2().responder_to_initiator}


# ---- Sealed datagrams ----

ONE, OTHER = bytes(32), bytes(31) + b"\1"
HEADER = b"sixteen bytes..."


NEEDS_AES = pytest.mark.skipif(not aes.AVAILABLE, reason="python3-cryptography is missing")


@pytest.fixture(params=[Suite.NOISE, pytest.param(Suite.AES_GCM, marks=NEEDS_AES)], ids=["suite 1", "suite 2"])
def peers(request):
    return lambda: (Sealed(ONE, OTHER, 0, request.param), Sealed(OTHER, ONE, 0, request.param))


def test_a_sealed_body_opens_with_its_header_and_number_only(peers):
    ours, theirs = peers()
    sealed = ours.seal(7, HEADER, b"body")
    assert theirs.open(0, 0, 7, HEADER, sealed) == b"body"
    for number, header, body in [(8, HEADER, sealed), (7, HEADER[:-1] + b"!", sealed), (7, HEADER, b"short")]:
        with pytest.raises(Forged):
            theirs.open(0, 0, number, header, body)


def test_the_key_is_renewed_after_600_s_and_the_old_one_is_good_for_2_s(peers):
    ours, theirs = peers()
    assert ours.next_epoch(RENEW_AFTER_NS - 1) == 0
    late = ours.seal(1, HEADER, b"late")
    assert ours.next_epoch(RENEW_AFTER_NS) == 1
    first = ours.seal(2, HEADER, b"first")

    now = RENEW_AFTER_NS
    assert theirs.open(now, 1, 2, HEADER, first) == b"first"
    assert theirs.open(now + OVERLAP_NS - 1, 0, 1, HEADER, late) == b"late"
    with pytest.raises(OldKey):
        theirs.open(now + OVERLAP_NS, 0, 1, HEADER, late)


def test_the_key_is_renewed_after_2_to_the_20_datagrams(peers, monkeypatch):
    monkeypatch.setattr("tendon.cipher.RENEW_AFTER_DATAGRAMS", 3)
    ours, _ = peers()
    epochs = []
    for number in range(7):
        epochs.append(ours.next_epoch(0))
        ours.seal(number, HEADER, b"")
    assert epochs == [0, 0, 0, 1, 1, 1, 2]


def test_a_forged_epoch_moves_nothing(peers):
    ours, theirs = peers()
    with pytest.raises(Forged):
        theirs.open(0, 1, 1, HEADER, bytes(40))
    for epoch in (2, 128, 255):
        with pytest.raises(OldKey):
            theirs.open(0, epoch, 1, HEADER, bytes(40))
    assert theirs.open(0, 0, 1, HEADER, ours.seal(1, HEADER, b"body")) == b"body"


def test_the_epoch_wraps_after_256_renewals(peers):
    ours, theirs = peers()
    now = 0
    for number in range(600):
        now += RENEW_AFTER_NS
        epoch = ours.next_epoch(now)
        assert epoch == (number + 1) % 256
        assert theirs.open(now, epoch, number, HEADER, ours.seal(number, HEADER, b"body")) == b"body"
