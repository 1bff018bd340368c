# SPDX-License-Identifier: Apache-2.0
"""Values to bytes and back: the only modules that know the layout of the header and protobuf (WIRE.md).

Encoding trusts its input, except that texts and lists are cut to their bounds. Decoding trusts nothing: it returns
None for input that it refuses.
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
