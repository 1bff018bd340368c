# SPDX-License-Identifier: Apache-2.0
"""Bounds of the wire that are used outside the generated codec. They are part of the protocol (SESSION.md, "Limits"),
not settings."""

PROTOCOL_VERSION = 1
"""The version of the wire that this package speaks."""
MAX_DATAGRAM = 1200
"""Bytes in one UDP datagram, header included."""
MAX_HELLO_BODY = 1000
"""Bytes that follow the fixed part of a Hello; padding not counted."""
MAX_VALUE = 1e12
"""Largest magnitude of any physical quantity in SI units, per component."""
MAX_TIME_NS = 1 << 60
"""Largest distance of any clock reading from its zero."""
UNIT_TOLERANCE = 1e-3
"""Tolerance of the length of a unit normal or quaternion."""
MAX_VALID_FOR_US = 10_000_000
"""Longest validity of a force."""
MAX_FRAMES = 64
"""Frames in one datagram."""
REQUEST_WINDOW = 16
"""Requests sent and not yet answered, and answers kept."""
MAX_NAME = 64
"""Bytes of UTF-8 in a name."""
MAX_LABEL = 24
"""Bytes of UTF-8 in the name of a device or a channel."""
MAX_DEVICES = 16
MAX_CHANNELS = 8
MAX_WAYS = 8
"""Ways of answering that an engine names."""
MAX_LOOP_HZ = 1_000_000
LATENESS_BUCKETS = 24
"""Buckets in the histogram of a loop's lateness."""
BYES = 3
"""How many times a Bye is sent."""
PACKET_NUMBERS = 1 << 60
"""Packet numbers are below this: a nonce is never used twice."""
LIFE_NS = 24 * 3600 * 1_000_000_000
"""Age of a sealed session."""
MAX_FORGED = 1 << 36
"""It also ends after so many datagrams that did not open, so that nobody can go on guessing tags."""
