# SPDX-License-Identifier: Apache-2.0
"""Checks that the client produces and reads the bytes in protocol/vectors."""

import hmac
import json
import re
from dataclasses import replace

import pytest
from conftest import ROOT
from google.protobuf import json_format
from responder import Responder

from tendon import aes, codec, noise, read_key
from tendon import tendon_pb2 as pb
from tendon.cipher import SUITE_NAMES, Forged, Sealed
from tendon.codec import DatagramType, Header, Suite
from tendon.handshake import Accepted, ClientHandshake, key_id, prologue
from tendon.messages import Code, Control, Refused
from tendon.replay_window import ReplayWindow
from tendon.session import Session

VECTORS = ROOT / "protocol" / "vectors"


def load(name):
    return json.loads((VECTORS / f"{name}.json").read_text(encoding="utf-8"))


def unhex(value):
    """Decodes the hexadecimal strings of one level."""
    words = ("body", "cookie", "datagram", "ephemeral", "hash", "key", "key_id", "prologue", "psk", "random")
    return {
        name: bytes.fromhex(text) if isinstance(text, str) and name.endswith(words) else text
        for name, text in value.items()
    }


PLAIN, SEALED, SEALED_AES = (unhex(load(name)) for name in ("plain", "sealed", "sealed_aes"))
NEEDS_AES = pytest.mark.skipif(not aes.AVAILABLE, reason="python3-cryptography is missing")
SEALED_FILES = [pytest.param(SEALED, id="sealed"), pytest.param(SEALED_AES, id="sealed_aes", marks=NEEDS_AES)]
FILES = [pytest.param(PLAIN, id="plain"), *SEALED_FILES]


def cases(vectors, name="name"):
    return [pytest.param(vector, id=vector[name]) for vector in vectors]


def encoded(message_type, message):
    return json_format.ParseDict(message, message_type()).SerializeToString()


# ---- Primitives ----

PRIMITIVES = load("primitives")


@pytest.mark.parametrize("vector", cases(PRIMITIVES["x25519"], "source"))
def test_x25519(vector):
    scalar, point = bytes.fromhex(vector["scalar"]), bytes.fromhex(vector["point"])
    assert noise.shared_key(scalar, point).hex() == vector["result"]
    if point == bytes([9]) + bytes(31):
        assert noise.public_key(scalar).hex() == vector["result"]


@pytest.mark.parametrize("vector", cases(PRIMITIVES["hmac_sha256"], "source"))
def test_hmac_sha256(vector):
    key, data = bytes.fromhex(vector["key"]), bytes.fromhex(vector["data"])
    assert hmac.digest(key, data, "sha256").hex() == vector["result"]


@NEEDS_AES
@pytest.mark.parametrize("vector", cases(PRIMITIVES["aes256_gcm"], "source"))
def test_aes256_gcm(vector):
    nonce = bytes.fromhex(vector["nonce"])
    if nonce[:4] != bytes(4):
        pytest.skip("a nonce that Noise has not")
    number = int.from_bytes(nonce[4:], "big")
    key, associated, plain, sealed = (
        bytes.fromhex(vector[name]) for name in ("key", "associated_data", "text", "sealed")
    )
    assert aes.AesGcm(key).seal(number, associated, plain) == sealed
    assert aes.AesGcm(key).unseal(number, associated, sealed) == plain


def test_noise_is_that_of_the_public_vector():
    (vector,) = load("noise")["vectors"]
    (psk,) = map(bytes.fromhex, vector["init_psks"])
    agreed, ours, theirs = (
        bytes.fromhex(vector[name]) for name in ("init_prologue", "init_ephemeral", "resp_ephemeral")
    )
    messages = [(bytes.fromhex(m["payload"]), bytes.fromhex(m["ciphertext"])) for m in vector["messages"]]

    initiator = noise.Initiator(psk, ours, agreed, messages[0][0])
    assert initiator.message == messages[0][1]
    responder = Responder(psk, agreed)
    assert responder.read(messages[0][1]) == messages[0][0]
    message, split = responder.reply(theirs, messages[1][0])
    assert message == messages[1][1]
    assert initiator.read(message) == (messages[1][0], split)
    assert split.handshake_hash.hex() == vector["handshake_hash"]
    for i, (plain, sealed) in enumerate(messages[2:]):
        key = (split.initiator_to_responder, split.responder_to_initiator)[i % 2]
        assert noise.seal(key, i // 2, b"", plain) == sealed
        assert noise.unseal(key, i // 2, b"", sealed) == plain


# ---- The handshake ----


def handshake(file, now=0):
    hello = codec.read_hello(unhex(file["hello"])["body"])
    secret = {}
    if file["suite"]:
        suites = (Suite.AES_GCM, Suite.NOISE) if file["suite"] == 2 else (Suite.NOISE,)
        secret = {"key": file["psk"], "ephemeral": file["client_ephemeral"], "suites": suites}
        # added by the client itself
        words = tuple(word for word in hello.features if word != SUITE_NAMES[Suite.AES_GCM])
        hello = replace(hello, features=words)
    return ClientHandshake(hello, file["client_random"], now, **secret)


@pytest.mark.parametrize("file", FILES)
def test_hello_is_written_as_it_is_here_before_and_after_the_cookie(file):
    hello = unhex(file["hello"])
    assert encoded(pb.Hello, hello["message"]) == hello["body"]
    assert codec.write_hello(codec.read_hello(hello["body"])) == hello["body"]

    client = handshake(file)
    ours = {codec.NO_COOKIE: client.next_datagram(0)}
    client.receive(1, unhex(file["retry"])["datagram"])
    ours[file["cookie"]] = client.next_datagram(1)
    for name in hello.keys() & {"first_datagram", "datagram"}:
        assert ours[codec.decode_hello(hello[name]).cookie] == hello[name]


def test_key_id_and_prologue_are_as_they_are_here():
    header = codec.encode_header(Header(DatagramType.HELLO, Suite.NOISE))
    assert key_id(SEALED["psk"]) == SEALED["key_id"]
    assert prologue(header, SEALED["key_id"], SEALED["client_random"]) == unhex(SEALED["hello"])["prologue"]


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("name", ["welcome", "refused"])
def test_the_answer_is_read_as_it_is_here(file, name):
    answer = unhex(file[name])
    assert encoded(pb.Answer, answer["message"]) == answer["body"]
    assert codec.write_answer(codec.read_answer(answer["body"])) == answer["body"]

    client = handshake(file)
    client.receive(1, answer["datagram"])
    if name == "refused":
        assert isinstance(client.outcome, Refused)
    else:
        assert isinstance(client.outcome, Accepted)
        assert client.outcome.connection_id == file["connection_id"]
        assert client.outcome.welcome == codec.read_answer(answer["body"])
        assert client.outcome.cipher.suite == Suite(file["suite"])


# ---- Data ----


def number_of(vector):
    return int(vector["packet_number"])


def all_data(files):
    for suite, file in files:
        for vector in file["data"]:
            marks = [NEEDS_AES] if file is SEALED_AES else []
            yield pytest.param(file, unhex(vector), id=f"{suite}: {vector['name']}", marks=marks)


@pytest.mark.parametrize(
    "file, vector", all_data([("plain", PLAIN), ("sealed", SEALED), ("sealed_aes", SEALED_AES)])
)
def test_a_datagram_is_written_and_read_as_it_is_here(file, vector):
    body = vector["body"]
    assert encoded(pb.Datagram, vector["message"]) == body
    content = codec.read_data(body)
    assert codec.write_data_head(content.sent_ns, content.echo) + b"".join(map(codec.write_frame, content.frames)) == body

    header = codec.encode_header(
        Header(DatagramType.DATA, Suite(file["suite"]), vector.get("epoch", 0), file["connection_id"], number_of(vector))
    )
    sealed = body
    if file["suite"] == 1:
        sealed = noise.seal(vector["key"], number_of(vector), header, body)
    elif file["suite"] == 2:
        sealed = aes.AesGcm(vector["key"]).seal(number_of(vector), header, body)
    assert header + sealed == vector["datagram"]


def is_taken(vector):
    """Returns whether the codec accepts all values in the body."""
    body = bytes.fromhex(vector["body"])
    if vector["message"] == "Hello":
        return codec.read_hello(body) is not None
    if vector["message"] == "Answer":
        return codec.read_answer(body) is not None
    content = codec.read_data(body)
    return content is not None and content.invalid == 0


def test_bounds_are_those_of_the_proto_file():
    vectors = load("bounds")["bounds"]
    wrong = [(vector["field"], vector["value"]) for vector in vectors if is_taken(vector) != vector["accepted"]]
    assert len(vectors) > 300 and not wrong


def test_a_request_out_of_bounds_names_its_field_and_an_answer_is_refused():
    frames = {}
    for vector in load("bounds")["bounds"]:
        is_frame = vector["message"] == "Datagram" and not vector["field"].startswith("Datagram.")
        content = codec.read_data(bytes.fromhex(vector["body"])) if is_frame else None
        if content is not None and content.invalid and content.frames:
            frames.setdefault(vector["field"], []).extend(content.frames)
    controls = {field: found for field, found in frames.items() if isinstance(found[0], Control)}
    assert {field.partition(".")[0] for field in controls} == {
        *("SetStateRate", "Rearm", "Describe", "TakeLease", "GiveLease", "SetStateDeadband", "Disarm", "SetOutput"),
        *("Couple", "Engage", "Disengage", "SetScale", "SetShare", "LeaseLost"),
        *("OfferField", "UseField", "FieldMaterial", "FieldFixture", "FieldDepthTable", "DropField"),
    }
    for field, found in controls.items():
        message, _, name = field.partition(".")
        inside = {"FieldMaterial": "materials.", "FieldFixture": "fixtures.", "FieldDepthTable": "tables."}.get(message, "")
        expected = "rotation" if name.startswith("rotation") else inside + re.sub(r"\.[xyz]$", "", name)
        assert {(control.request, control.invalid) for control in found} == {(None, expected)}, field
    answers = {field: found for field, found in frames.items() if field not in controls}
    assert {field.partition(".")[0] for field in answers} == {"ControlAck", "ChannelDescription", "OutputDescription"}
    for field, found in answers.items():
        assert any((ack.code, ack.device, ack.handle) == (Code.INVALID, None, None) for ack in found), field


@pytest.mark.parametrize("file", SEALED_FILES)
def test_the_conversation_here_can_be_held_with_the_keys_of_its_welcome(file):
    welcome = unhex(file["welcome"])
    ours, theirs = welcome["client_to_server_key"], welcome["server_to_client_key"]
    suite = Suite(file["suite"])
    client, server = Sealed(ours, theirs, 0, suite), Sealed(theirs, ours, 0, suite)
    for vector in map(unhex, file["data"]):
        end = server if vector["direction"] == "client_to_server" else client
        header, sealed = vector["datagram"][:16], vector["datagram"][16:]
        assert end.open(0, vector["epoch"], number_of(vector), header, sealed) == vector["body"]
        other = client if end is server else server
        with pytest.raises(Forged):
            other.open(0, vector["epoch"] and 1, number_of(vector), header, sealed)


def all_dropped():
    for suite, file, marks in [("sealed", SEALED, []), ("sealed_aes", SEALED_AES, [NEEDS_AES])]:
        for vector in map(unhex, file["dropped"]):
            yield pytest.param(file, vector, id=f"{suite}: {vector['name']}", marks=marks)


@pytest.mark.parametrize("file, vector", all_dropped())
def test_what_is_dropped_here_is_dropped_and_counted(file, vector):
    client = handshake(file)
    client.receive(0, unhex(file["welcome"])["datagram"])
    session = Session(client.outcome.connection_id, 0, client.outcome.cipher)
    session.receive(0, vector["datagram"])
    assert session.stats.datagrams_received == 0
    assert getattr(session.stats, vector["counter"]) == 1


# ---- What else ----

REPLAY = load("replay")


@pytest.mark.parametrize("script", cases(REPLAY["scripts"]))
def test_packet_numbers_are_let_in_as_they_are_here(script):
    assert ReplayWindow.REMEMBERED == REPLAY["remembered"]
    window, accepted = ReplayWindow(), []
    for number in map(int, script["packet_numbers"]):
        accepted.append(not window.contains(number))
        if accepted[-1]:
            window.insert(number)
    assert accepted == script["accept"]


@pytest.mark.parametrize("vector", cases(load("key_files")["files"]))
def test_key_files_are_read_or_refused_as_they_are_here(vector, tmp_path):
    file = tmp_path / "a.key"
    file.write_bytes(vector["text"].encode())
    file.chmod(0o600)
    if vector["accept"]:
        assert read_key(file).hex() == vector["key"]
        assert key_id(read_key(file)).hex() == vector["key_id"]
    else:
        with pytest.raises(ValueError, match="expected one line|weak"):
            read_key(file)
