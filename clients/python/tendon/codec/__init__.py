# SPDX-License-Identifier: Apache-2.0
"""Encoding and decoding of messages. The header layout and protobuf are only used in these modules (WIRE.md).

Encoding does not check its input, except that texts and lists are truncated to their bounds. Decoding checks
everything, and returns None if the input is invalid.
"""

from ..generated import Answer, Echo
from .data import DataContent, read_data, write_data_head, write_frame
from .frames import is_contact, is_radius, is_request
from .handshake import (
    NO_COOKIE,
    AnswerDatagram,
    HelloDatagram,
    RetryDatagram,
    decode_answer,
    decode_hello,
    decode_retry,
    encode_answer,
    encode_hello,
    encode_retry,
    read_answer,
    read_hello,
    write_answer,
    write_hello,
)
from .header import HEADER_SIZE, DatagramType, Header, Suite, decode_header, encode_header

__all__ = [
    "Answer",
    "AnswerDatagram",
    "DataContent",
    "DatagramType",
    "Echo",
    "HEADER_SIZE",
    "Header",
    "HelloDatagram",
    "NO_COOKIE",
    "RetryDatagram",
    "Suite",
    "decode_answer",
    "decode_header",
    "decode_hello",
    "decode_retry",
    "encode_answer",
    "encode_header",
    "encode_hello",
    "encode_retry",
    "is_contact",
    "is_radius",
    "is_request",
    "read_answer",
    "read_data",
    "read_hello",
    "write_answer",
    "write_data_head",
    "write_frame",
    "write_hello",
]
