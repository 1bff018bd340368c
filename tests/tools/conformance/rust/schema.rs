// SPDX-License-Identifier: Apache-2.0
//! tendon.proto as tables, with the bounds in its comments and the rules of WIRE.md for several fields.

use crate::protobuf::{Bound, Field, Kind, Label, Schema, Value};
use Bound::{Above, Any, Between, Bytes, OrInfinite, Whole};
use Kind::{Bool, Enum, Fixed32, Fixed64, Real, Signed64, Sub, Text, Unsigned32, Unsigned64};
use Label::{Many, One, Optional, Required};

const MOST: i128 = i128::MAX;
const TIME: Bound = Whole(-(1 << 60), 1 << 60);
const SPAN: Bound = Whole(0, 1 << 60);
const LARGE: f64 = 1e12;
const SIGNED: Bound = Between(-LARGE, LARGE);
const POSITIVE: Bound = Between(0.0, LARGE);
const DEVICE: Bound = Whole(0, 15);
const CHANNEL: Bound = Whole(0, 7);

const fn message(fields: &'static [Field]) -> Schema {
    Schema { fields, oneof: &[], rule: |_| true }
}

fn near_one(parts: &[f64]) -> bool {
    (parts.iter().map(|part| part * part).sum::<f64>().sqrt() - 1.0).abs() <= 0.001
}

fn any(_: usize) -> bool {
    true
}

fn entries_of_a_stiffness(count: usize) -> bool {
    count == 1 || count == 3 || count == 9
}

pub static VECTOR: Schema =
    message(&[Field(1, Real, One, SIGNED), Field(2, Real, One, SIGNED), Field(3, Real, One, SIGNED)]);

pub static QUATERNION: Schema = Schema {
    fields: &[
        Field(1, Real, One, Between(-1.001, 1.001)),
        Field(2, Real, One, Between(-1.001, 1.001)),
        Field(3, Real, One, Between(-1.001, 1.001)),
        Field(4, Real, One, Between(-1.001, 1.001)),
    ],
    oneof: &[],
    rule: |node| near_one(&node.reals::<4>()),
};

pub static STATE: Schema = message(&[
    Field(1, Unsigned64, One, Any),
    Field(2, Fixed64, One, TIME),
    Field(3, Sub(&VECTOR), Optional, Any),
    Field(4, Sub(&VECTOR), Optional, Any),
    Field(5, Sub(&VECTOR), Optional, Any),
    Field(6, Real, One, SIGNED),
    Field(7, Real, One, OrInfinite(0.0, LARGE)),
    Field(8, Fixed32, One, Any),
    Field(9, Unsigned64, One, Any),
    Field(10, Unsigned64, One, SPAN),
    Field(11, Enum, One, Whole(1, 6)),
    Field(12, Unsigned32, One, DEVICE),
    Field(13, Unsigned32, One, CHANNEL),
    Field(14, Sub(&VECTOR), Optional, Any),
    Field(15, Sub(&QUATERNION), Optional, Any),
    Field(16, Sub(&VECTOR), Optional, Any),
    Field(17, Fixed32, One, Any),
    Field(18, Sub(&VECTOR), Optional, Any),
    Field(19, Real, Optional, SIGNED),
    Field(20, Real, Optional, SIGNED),
    Field(21, Real, Optional, SIGNED),
    Field(22, Sub(&VECTOR), Optional, Any),
    Field(23, Real, Many(|count| count <= 8), SIGNED),
    Field(24, Real, Many(|count| count <= 8), SIGNED),
    Field(25, Real, Many(|count| count == 0 || entries_of_a_stiffness(count)), SIGNED),
]);

static TABLE: Schema = message(&[
    Field(1, Real, One, SIGNED),
    Field(2, Real, One, Above(0.0, LARGE)),
    Field(3, Real, Many(|count| (2..=16).contains(&count)), SIGNED),
]);

static CONTACT: Schema = Schema {
    fields: &[Field(1, Sub(&VECTOR), Required, Any), Field(2, Real, One, SIGNED), Field(3, Sub(&TABLE), Optional, Any)],
    oneof: &[],
    rule: |node| node.sub(1).map_or(false, |normal| near_one(&normal.reals::<3>())),
};

static LOCAL_MODEL: Schema = message(&[
    Field(1, Sub(&VECTOR), Optional, Any),
    Field(2, Real, Many(entries_of_a_stiffness), SIGNED),
    Field(3, Real, Optional, OrInfinite(0.0, LARGE)),
    Field(4, Sub(&CONTACT), Optional, Any),
]);

pub static ROTATION_MODEL: Schema =
    message(&[Field(1, Sub(&QUATERNION), Required, Any), Field(2, Real, Many(entries_of_a_stiffness), SIGNED)]);

pub static FORCE: Schema = message(&[
    Field(1, Unsigned64, One, Whole(1, MOST)),
    Field(2, Unsigned64, One, Any),
    Field(3, Sub(&VECTOR), Optional, Any),
    Field(4, Sub(&LOCAL_MODEL), Optional, Any),
    Field(5, Unsigned32, One, Whole(1, 10_000_000)),
    Field(6, Unsigned32, One, DEVICE),
    Field(7, Unsigned32, One, CHANNEL),
    Field(8, Bool, One, Any),
    Field(9, Real, Optional, POSITIVE),
    Field(10, Sub(&VECTOR), Optional, Any),
    Field(11, Real, Optional, SIGNED),
    Field(14, Sub(&ROTATION_MODEL), Optional, Any),
    Field(15, Unsigned32, One, Whole(0, 8)),
]);

static STATE_RATE: Schema = message(&[Field(1, Unsigned32, One, Any), Field(2, Unsigned32, One, DEVICE)]);
static OF_DEVICE: Schema = message(&[Field(1, Unsigned32, One, DEVICE)]);
static DESCRIBE: Schema = message(&[Field(1, Unsigned32, One, DEVICE), Field(2, Bool, One, Any)]);
static LEASE: Schema = message(&[Field(1, Unsigned32, One, DEVICE), Field(2, Unsigned32, One, CHANNEL)]);
static LEASE_LOST: Schema =
    message(&[Field(1, Unsigned32, One, DEVICE), Field(2, Unsigned32, One, CHANNEL), Field(3, Text, One, Bytes(64))]);
static DEADBAND: Schema =
    message(&[Field(1, Real, One, SIGNED), Field(2, Real, One, SIGNED), Field(3, Unsigned32, One, Any)]);

static RATE_CONTROL: Schema = message(&[
    Field(1, Real, One, POSITIVE),
    Field(2, Real, One, Above(0.0, LARGE)),
    Field(3, Real, One, Above(0.0, LARGE)),
]);

static COUPLE: Schema = message(&[
    Field(1, Unsigned32, One, DEVICE),
    Field(2, Unsigned32, One, CHANNEL),
    Field(3, Enum, One, Whole(1, 2)),
    Field(4, Enum, One, Whole(1, 7)),
    Field(5, Real, One, Between(0.01, 100.0)),
    Field(6, Real, One, Between(0.01, 100.0)),
    Field(7, Sub(&QUATERNION), Required, Any),
    Field(8, Unsigned32, One, Whole(1, 7)),
    Field(9, Real, One, POSITIVE),
    Field(10, Real, One, POSITIVE),
    Field(11, Real, One, POSITIVE),
    Field(12, Bool, One, Any),
    Field(13, Bool, One, Any),
    Field(14, Unsigned32, One, Whole(1, 10_000_000)),
    Field(15, Bool, One, Any),
    Field(16, Real, One, POSITIVE),
    Field(17, Real, One, POSITIVE),
    Field(18, Real, One, POSITIVE),
    Field(19, Real, One, POSITIVE),
    Field(20, Real, One, POSITIVE),
    Field(21, Sub(&RATE_CONTROL), Optional, Any),
]);

static SET_SCALE: Schema = message(&[
    Field(1, Unsigned32, One, DEVICE),
    Field(2, Real, One, Between(0.01, 100.0)),
    Field(3, Real, One, Between(0.01, 100.0)),
]);

static SET_SHARE: Schema = message(&[
    Field(1, Unsigned32, One, DEVICE),
    Field(2, Unsigned32, One, CHANNEL),
    Field(3, Real, One, Between(0.0, 1.0)),
]);

static VIBRATION: Schema = Schema {
    fields: &[
        Field(1, Real, One, Between(0.0, 1.0)),
        Field(2, Real, One, Between(0.0, 1000.0)),
        Field(3, Unsigned32, One, Whole(0, 10_000)),
    ],
    oneof: &[],
    rule: |node| node.real(2) == 0.0 || node.real(2) >= 20.0,
};

/// Requires one of the two settings.
static SET_OUTPUT: Schema = Schema {
    fields: &[
        Field(1, Unsigned32, One, DEVICE),
        Field(2, Unsigned32, One, Whole(0, 7)),
        Field(3, Fixed32, Optional, Whole(0, 0xFF_FFFF)),
        Field(4, Sub(&VIBRATION), Optional, Any),
    ],
    oneof: &[3, 4],
    rule: |node| !node.all(3).is_empty() || node.sub(4).is_some(),
};

pub static CONTROL: Schema = Schema {
    fields: &[
        Field(1, Unsigned32, One, Whole(1, MOST)),
        Field(2, Sub(&STATE_RATE), Optional, Any),
        Field(3, Sub(&OF_DEVICE), Optional, Any),
        Field(4, Sub(&DESCRIBE), Optional, Any),
        Field(5, Sub(&LEASE), Optional, Any),
        Field(6, Sub(&LEASE), Optional, Any),
        Field(7, Sub(&LEASE_LOST), Optional, Any),
        Field(8, Sub(&DEADBAND), Optional, Any),
        Field(9, Sub(&OF_DEVICE), Optional, Any),
        Field(10, Sub(&SET_OUTPUT), Optional, Any),
        Field(11, Sub(&COUPLE), Optional, Any),
        Field(12, Sub(&OF_DEVICE), Optional, Any),
        Field(13, Sub(&OF_DEVICE), Optional, Any),
        Field(14, Sub(&SET_SCALE), Optional, Any),
        Field(15, Sub(&SET_SHARE), Optional, Any),
    ],
    oneof: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
    rule: |_| true,
};

static CHANNEL_DESCRIPTION: Schema = message(&[
    Field(1, Text, One, Bytes(24)),
    Field(2, Enum, One, Whole(1, 2)),
    Field(3, Unsigned32, One, Whole(0, 3_600_000)),
    Field(4, Text, One, Bytes(24)),
]);

static DEVICE_DESCRIPTION: Schema = Schema {
    fields: &[
        Field(1, Unsigned32, One, DEVICE),
        Field(2, Text, One, Bytes(24)),
        Field(3, Text, One, Bytes(64)),
        Field(4, Unsigned32, One, Whole(1, 6)),
        Field(5, Unsigned32, One, Whole(1, 6)),
        Field(6, Sub(&VECTOR), Optional, Any),
        Field(7, Sub(&VECTOR), Optional, Any),
        Field(8, Real, One, POSITIVE),
        Field(9, Real, One, POSITIVE),
        Field(10, Real, One, POSITIVE),
        Field(11, Real, One, POSITIVE),
        Field(12, Unsigned32, One, Whole(1, 1_000_000)),
        Field(13, Sub(&CHANNEL_DESCRIPTION), Many(|count| (1..=8).contains(&count)), Any),
    ],
    oneof: &[],
    rule: |node| match (node.sub(6), node.sub(7)) {
        (None, None) => true,
        (Some(low), Some(high)) => low.reals::<3>().iter().zip(high.reals::<3>()).all(|(low, high)| *low <= high),
        _ => false,
    },
};

static OUTPUT: Schema = message(&[Field(1, Text, One, Bytes(24)), Field(2, Enum, One, Whole(1, 2))]);

static HANDLE_DESCRIPTION: Schema = message(&[
    Field(1, Unsigned32, One, DEVICE),
    Field(2, Sub(&QUATERNION), Optional, Any),
    Field(3, Text, Many(|count| count <= 16), Bytes(24)),
    Field(4, Bool, One, Any),
    Field(5, Real, One, POSITIVE),
    Field(6, Real, Optional, POSITIVE),
    Field(7, Real, One, POSITIVE),
    Field(8, Text, One, Bytes(24)),
    Field(9, Enum, One, Whole(0, 2)),
    Field(10, Text, Many(|count| count <= 8), Bytes(24)),
    Field(11, Sub(&OUTPUT), Many(|count| count <= 8), Any),
]);

pub static CONTROL_ACK: Schema = message(&[
    Field(1, Unsigned32, One, Whole(1, MOST)),
    Field(2, Enum, One, Whole(1, 9)),
    Field(3, Text, One, Bytes(128)),
    Field(4, Unsigned32, One, Whole(0, 3_600_000)),
    Field(5, Sub(&DEVICE_DESCRIPTION), Optional, Any),
    Field(6, Sub(&HANDLE_DESCRIPTION), Optional, Any),
]);

pub static BYE: Schema = message(&[Field(1, Enum, One, Whole(1, 9)), Field(2, Text, One, Bytes(128))]);

static DELAYS: Schema = message(&[Field(1, Signed64, One, TIME), Field(2, Signed64, One, TIME)]);

pub static LINK_REPORT: Schema = message(&[
    Field(1, Unsigned64, One, Whole(1, MOST)),
    Field(2, Fixed64, One, TIME),
    Field(3, Unsigned64, One, SPAN),
    Field(8, Unsigned64, One, SPAN),
    Field(9, Unsigned64, One, SPAN),
    Field(10, Sub(&DELAYS), Optional, Any),
    Field(11, Sub(&DELAYS), Optional, Any),
    Field(12, Sub(&DELAYS), Optional, Any),
    Field(13, Signed64, One, TIME),
    Field(14, Real, One, SIGNED),
    Field(15, Unsigned64, One, SPAN),
    Field(20, Text, One, Bytes(128)),
]);

pub static DEVICE_REPORT: Schema = Schema {
    fields: &[
        Field(1, Unsigned64, One, Whole(1, MOST)),
        Field(2, Fixed64, One, TIME),
        Field(3, Unsigned64, One, SPAN),
        Field(4, Unsigned32, One, DEVICE),
        Field(5, Unsigned64, One, Any),
        Field(6, Unsigned64, One, Any),
        Field(7, Unsigned64, One, Any),
        Field(8, Unsigned64, One, Any),
        Field(9, Unsigned64, Many(|count| count <= 24), Any),
        Field(10, Enum, One, Whole(1, 8)),
        Field(11, Text, One, Bytes(128)),
        Field(12, Text, One, Bytes(128)),
    ],
    oneof: &[],
    rule: |node| {
        let counted: i128 = node.all(9).iter().map(|value| if let Value::Whole(v) = value { *v } else { 0 }).sum();
        let steps = node.whole(5);
        counted <= steps && node.whole(7) <= steps && node.whole(8) <= steps
    },
};

pub static PEER_REPORT: Schema = message(&[
    Field(1, Unsigned32, One, DEVICE),
    Field(2, Unsigned32, One, CHANNEL),
    Field(3, Text, One, Bytes(64)),
    Field(4, Unsigned32, One, Whole(1, 1000)),
    Field(5, Bool, One, Any),
    Field(6, Sub(&LINK_REPORT), Required, Any),
    Field(7, Real, Optional, POSITIVE),
    Field(8, Text, One, Bytes(24)),
]);

static PORT_SURFACE: Schema = Schema {
    fields: &[Field(1, Sub(&VECTOR), Required, Any), Field(2, Real, One, SIGNED), Field(3, Real, One, POSITIVE)],
    oneof: &[],
    rule: |node| node.sub(1).map_or(false, |normal| near_one(&normal.reals::<3>())),
};

static PORT_TURN: Schema = message(&[
    Field(1, Sub(&QUATERNION), Required, Any),
    Field(2, Sub(&VECTOR), Optional, Any),
    Field(3, Sub(&VECTOR), Optional, Any),
]);

static PORT_GRIP: Schema = message(&[
    Field(1, Real, One, SIGNED),
    Field(2, Real, One, SIGNED),
    Field(3, Real, One, SIGNED),
    Field(4, Real, One, Between(-1e3, 1e3)),
    Field(5, Real, One, Between(0.0, 1e3)),
    Field(6, Real, One, Between(0.0, 1e6)),
    Field(7, Real, One, Between(0.0, 1e6)),
]);

/// A scale of 0 selects the scale of Couple.
fn scale_or_none(scale: f64) -> bool {
    scale == 0.0 || scale >= 0.01
}

pub static PORT_STATE: Schema = Schema {
    fields: &[
        Field(1, Unsigned32, One, DEVICE),
        Field(2, Unsigned32, One, CHANNEL),
        Field(3, Unsigned64, One, Whole(1, MOST)),
        Field(4, Unsigned64, One, Whole(1, MOST)),
        Field(5, Unsigned64, One, Any),
        Field(6, Unsigned64, One, Any),
        Field(7, Fixed64, One, TIME),
        Field(8, Unsigned64, One, Whole(0, 10_000_000_000)),
        Field(9, Enum, One, Whole(1, 7)),
        Field(10, Unsigned64, One, Any),
        Field(11, Fixed32, One, Any),
        Field(12, Sub(&VECTOR), Optional, Any),
        Field(13, Sub(&VECTOR), Optional, Any),
        Field(14, Sub(&VECTOR), Optional, Any),
        Field(15, Sub(&VECTOR), Optional, Any),
        Field(16, Real, One, Between(-1e3, 1e3)),
        Field(17, Real, One, Between(0.0, 1e3)),
        Field(18, Real, One, Between(0.0, 1e6)),
        Field(19, Real, One, Between(0.0, 1e6)),
        Field(20, Sub(&VECTOR), Optional, Any),
        Field(21, Real, One, Between(0.0, 1e6)),
        Field(22, Sub(&PORT_SURFACE), Optional, Any),
        Field(23, Sub(&PORT_TURN), Optional, Any),
        Field(24, Sub(&PORT_GRIP), Optional, Any),
        Field(25, Real, One, Between(0.0, 1e6)),
        Field(26, Real, Optional, Between(0.0, 1.0)),
        Field(27, Real, One, Between(0.0, 100.0)),
        Field(28, Real, One, Between(0.0, 100.0)),
        Field(29, Bool, One, Any),
    ],
    oneof: &[],
    rule: |node| scale_or_none(node.real(27)) && scale_or_none(node.real(28)),
};

pub static FRAME: Schema = Schema {
    fields: &[
        Field(1, Sub(&STATE), Optional, Any),
        Field(2, Sub(&FORCE), Optional, Any),
        Field(3, Sub(&CONTROL), Optional, Any),
        Field(4, Sub(&CONTROL_ACK), Optional, Any),
        Field(5, Sub(&BYE), Optional, Any),
        Field(6, Sub(&LINK_REPORT), Optional, Any),
        Field(7, Sub(&DEVICE_REPORT), Optional, Any),
        Field(8, Sub(&PEER_REPORT), Optional, Any),
        Field(9, Sub(&PORT_STATE), Optional, Any),
    ],
    oneof: &[1, 2, 3, 4, 5, 6, 7, 8, 9],
    rule: |_| true,
};

pub static ECHO: Schema = Schema {
    fields: &[
        Field(1, Fixed64, One, TIME),
        Field(2, Fixed64, One, TIME),
        Field(3, Unsigned64, One, Any),
        Field(4, Fixed32, One, Any),
    ],
    oneof: &[],
    rule: |_| true,
};

/// Frames and echo are validated separately, so `fits` is not used on the whole message.
pub static DATAGRAM: Schema = message(&[
    Field(1, Fixed64, One, TIME),
    Field(2, Sub(&ECHO), Optional, Any),
    Field(3, Sub(&FRAME), Many(any), Any),
]);

pub fn usable_time(ns: i128) -> bool {
    (-(1 << 60)..=1 << 60).contains(&ns)
}

static GRANT: Schema =
    message(&[Field(1, Unsigned32, One, DEVICE), Field(2, Unsigned32, One, CHANNEL), Field(3, Enum, One, Whole(1, 2))]);

static WELCOME: Schema = message(&[
    Field(1, Unsigned32, One, Whole(1, MOST)),
    Field(2, Text, Many(|count| count <= 16), Bytes(32)),
    Field(3, Enum, One, Whole(1, 2)),
    Field(4, Text, One, Bytes(64)),
    Field(5, Real, One, POSITIVE),
    Field(6, Real, One, POSITIVE),
    Field(7, Unsigned32, One, Whole(1, 1_000_000)),
    Field(8, Unsigned32, One, Whole(1, 3_600_000)),
    Field(9, Text, One, Bytes(64)),
    Field(10, Sub(&GRANT), Many(|count| count <= 16), Any),
]);

static REFUSED: Schema = message(&[
    Field(1, Enum, One, Whole(1, 9)),
    Field(2, Text, One, Bytes(128)),
    Field(3, Unsigned32, One, Any),
    Field(4, Unsigned32, One, Any),
]);

pub static ANSWER: Schema = Schema {
    fields: &[Field(1, Sub(&WELCOME), Optional, Any), Field(2, Sub(&REFUSED), Optional, Any)],
    oneof: &[1, 2],
    rule: |node| node.has(1) || node.has(2),
};
