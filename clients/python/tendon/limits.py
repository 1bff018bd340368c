# SPDX-License-Identifier: Apache-2.0
"""Every bound that the wire has. They are part of the protocol (SESSION.md, "Limits"), not settings."""

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
MIN_TABLE = 2
MAX_TABLE = 16
"""Entries of a table of forces."""
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
MAX_BUTTONS = 16
"""Named buttons of a device."""
MAX_JOINTS = 8
MAX_OUTPUTS = 8
MAX_VIBRATION_MS = 10_000
"""The longest pulse: nobody feels a longer one, and it cannot be left on."""
MIN_VIBRATION_HZ = 20.0
MAX_VIBRATION_HZ = 1000.0
"""Below the least of the two a pulse is a motion; above the other no skin feels it."""
MAX_DEVICES = 16
MAX_CHANNELS = 8
MAX_CLAIMS = 16
MAX_WAYS = 8
"""Ways of answering that an engine names."""
MAX_DOF = 6
MAX_FEATURE = 32
MAX_FEATURES = 16
MAX_DETAIL = 128
"""Bytes of UTF-8 in the sentence of a refusal, an answer or a Bye."""
MAX_LOOP_HZ = 1_000_000
MAX_ROUND_TRIP_NS = 10_000_000_000
"""Longest round trip that an end of a coupling tells."""
MAX_ACCOUNT = 1e3
MAX_TOTAL = 1e6
"""Joules in the account of an end of a coupling, and in the totals that it pays and is paid."""
MIN_SCALE = 0.01
MAX_SCALE = 100.0
LATENESS_BUCKETS = 24
"""Buckets in the histogram of a loop's lateness."""
MAX_ONE_IN = 1000
"""A server sends an engine at least one state in this many."""
MAX_TIMEOUT_MS = 3_600_000
BYES = 3
"""How many times a Bye is sent."""
PACKET_NUMBERS = 1 << 60
"""Packet numbers are below this: a nonce is never used twice."""
LIFE_NS = 24 * 3600 * 1_000_000_000
"""Age of a sealed session."""
MAX_FORGED = 1 << 36
"""It also ends after so many datagrams that did not open, so that nobody can go on guessing tags."""
