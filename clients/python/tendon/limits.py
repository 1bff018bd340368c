# SPDX-License-Identifier: Apache-2.0
"""Bounds of the protocol that are used outside of the generated codec (SESSION.md, "Limits"). They are not settings."""

PROTOCOL_VERSION = 1
"""The version of the wire that this package speaks."""
MAX_DATAGRAM = 1200
"""Size limit of a UDP datagram in bytes, including the header."""
MAX_HELLO_BODY = 1000
"""Size limit after the fixed part of a Hello, without padding."""
MAX_VALUE = 1e12
"""Largest magnitude of each component of a physical quantity in SI units."""
MAX_TIME_NS = 1 << 60
"""Largest magnitude of a clock reading."""
UNIT_TOLERANCE = 1e-3
"""Tolerance of the norm of a unit vector or quaternion."""
MAX_VALID_FOR_US = 10_000_000
"""Longest validity of a force."""
MAX_FRAMES = 64
"""Frames in one datagram."""
REQUEST_WINDOW = 16
"""The maximum number of pending requests, and of stored answers."""
MAX_NAME = 64
"""Bytes of UTF-8 in a name."""
MAX_LABEL = 24
"""Bytes of UTF-8 in the name of a device or a channel."""
MAX_DEVICES = 16
MAX_CHANNELS = 8
MAX_WAYS = 8
"""The maximum number of Config.ways."""
MAX_LOOP_HZ = 1_000_000
LATENESS_BUCKETS = 24
"""Buckets in the histogram of a loop's lateness."""
BYES = 3
"""How many times a Bye is sent."""
PACKET_NUMBERS = 1 << 60
"""Exclusive upper bound of packet numbers, so that a nonce is never used twice."""
LIFE_NS = 24 * 3600 * 1_000_000_000
"""Maximum age of an encrypted session."""
MAX_FORGED = 1 << 36
"""A session also ends after this number of forged datagrams, which limits how often an authentication tag can be
guessed."""
