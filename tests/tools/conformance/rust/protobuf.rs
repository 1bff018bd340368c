// SPDX-License-Identifier: Apache-2.0
//! A table-driven Protocol Buffers parser: a `Schema` lists the fields of a message and their bounds. Bytes that are not
//! protobuf are malformed; a message with a value out of bounds is invalid (WIRE.md, "Ground rules").

use std::collections::BTreeMap;

pub enum Kind {
    Unsigned32,
    Unsigned64,
    Signed64, // zigzag
    Fixed32,
    Fixed64, // signed
    Bool,
    Enum,
    Real,
    Text,
    Sub(&'static Schema),
}

pub enum Label {
    /// An absent field is 0, which must be within the bounds.
    One,
    Optional,
    /// An absent field is an error.
    Required,
    Many(fn(usize) -> bool),
}

pub enum Bound {
    Any,
    Whole(i128, i128),
    Between(f64, f64),
    /// Excludes the lower end.
    Above(f64, f64),
    /// Also allows +infinity.
    OrInfinite(f64, f64),
    Bytes(usize),
}

pub struct Field(pub u32, pub Kind, pub Label, pub Bound);

pub struct Schema {
    pub fields: &'static [Field],
    /// At most one of these is present: the last one received.
    pub oneof: &'static [u32],
    /// Constraints beyond the bounds of single fields.
    pub rule: fn(&Node) -> bool,
}

#[derive(Clone, Debug)]
pub enum Value {
    Whole(i128),
    Real(f64),
    Text(String),
    Sub(Node),
}

/// A parsed message: the values of each present field, by number.
#[derive(Clone, Debug, Default)]
pub struct Node(BTreeMap<u32, Vec<Value>>);

impl Node {
    pub fn all(&self, number: u32) -> &[Value] {
        self.0.get(&number).map_or(&[], |values| values.as_slice())
    }
    pub fn has(&self, number: u32) -> bool {
        self.0.contains_key(&number)
    }
    pub fn whole(&self, number: u32) -> i128 {
        match self.all(number).last() {
            Some(Value::Whole(value)) => *value,
            _ => 0,
        }
    }
    pub fn real(&self, number: u32) -> f64 {
        match self.all(number).last() {
            Some(Value::Real(value)) => *value,
            _ => 0.0,
        }
    }
    pub fn text(&self, number: u32) -> &str {
        match self.all(number).last() {
            Some(Value::Text(value)) => value,
            _ => "",
        }
    }
    pub fn sub(&self, number: u32) -> Option<&Node> {
        match self.all(number).last() {
            Some(Value::Sub(value)) => Some(value),
            _ => None,
        }
    }
    pub fn subs(&self, number: u32) -> impl Iterator<Item = &Node> {
        self.all(number).iter().filter_map(|value| match value {
            Value::Sub(node) => Some(node),
            _ => None,
        })
    }
    /// Fields 1 … N, all of them numbers: a vector or a quaternion.
    pub fn reals<const N: usize>(&self) -> [f64; N] {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            *value = self.real(i as u32 + 1);
        }
        values
    }
}

/// Malformed protobuf, or text that is not UTF-8.
#[derive(Debug)]
pub struct Malformed;

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn varint(&mut self) -> Result<u64, Malformed> {
        let mut value = 0u64;
        for i in 0..10 {
            let byte = *self.take(1)?.first().ok_or(Malformed)?;
            value |= u64::from(byte & 0x7f) << (7 * i); // bits beyond 64 in the tenth byte are discarded
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(Malformed)
    }
    fn take(&mut self, length: usize) -> Result<&'a [u8], Malformed> {
        if length > self.0.len() {
            return Err(Malformed);
        }
        let (head, tail) = self.0.split_at(length);
        self.0 = tail;
        Ok(head)
    }
    fn block(&mut self) -> Result<&'a [u8], Malformed> {
        let length = self.varint()?;
        self.take(usize::try_from(length).map_err(|_| Malformed)?)
    }
    fn tag(&mut self) -> Result<(u32, u8), Malformed> {
        let tag = u32::try_from(self.varint()?).map_err(|_| Malformed)?;
        if tag >> 3 == 0 {
            return Err(Malformed);
        }
        Ok((tag >> 3, (tag & 7) as u8))
    }
    fn skip(&mut self, number: u32, wire: u8, depth: usize) -> Result<(), Malformed> {
        match wire {
            0 => self.varint().map(|_| ()),
            1 => self.take(8).map(|_| ()),
            2 => self.block().map(|_| ()),
            3 if depth < 100 => loop {
                let (inner, wire) = self.tag()?;
                if wire == 4 {
                    return if inner == number { Ok(()) } else { Err(Malformed) };
                }
                self.skip(inner, wire, depth + 1)?;
            },
            5 => self.take(4).map(|_| ()),
            _ => Err(Malformed),
        }
    }
    fn number(&mut self, kind: &Kind) -> Result<Value, Malformed> {
        Ok(match kind {
            Kind::Unsigned32 => Value::Whole(i128::from(self.varint()? as u32)),
            Kind::Unsigned64 => Value::Whole(i128::from(self.varint()?)),
            Kind::Signed64 => {
                let value = self.varint()?;
                Value::Whole(i128::from((value >> 1) as i64 ^ -((value & 1) as i64)))
            }
            Kind::Bool => Value::Whole(i128::from(self.varint()? != 0)),
            Kind::Enum => Value::Whole(i128::from(self.varint()? as i32)),
            Kind::Fixed32 => Value::Whole(i128::from(u32::from_le_bytes(self.take(4)?.try_into().unwrap()))),
            Kind::Fixed64 => Value::Whole(i128::from(i64::from_le_bytes(self.take(8)?.try_into().unwrap()))),
            Kind::Real => Value::Real(f64::from_le_bytes(self.take(8)?.try_into().unwrap())),
            Kind::Text | Kind::Sub(_) => return Err(Malformed),
        })
    }
}

fn wire_type(kind: &Kind) -> u8 {
    match kind {
        Kind::Fixed32 => 5,
        Kind::Fixed64 | Kind::Real => 1,
        Kind::Text | Kind::Sub(_) => 2,
        _ => 0,
    }
}

pub fn decode(schema: &Schema, bytes: &[u8]) -> Result<Node, Malformed> {
    let mut node = Node::default();
    merge(schema, bytes, &mut node)?;
    Ok(node)
}

fn merge(schema: &Schema, bytes: &[u8], node: &mut Node) -> Result<(), Malformed> {
    let mut reader = Reader(bytes);
    while !reader.0.is_empty() {
        let (number, wire) = reader.tag()?;
        let Field(_, kind, label, _) = match schema.fields.iter().find(|field| field.0 == number) {
            Some(field) => field,
            None => {
                reader.skip(number, wire, 0)?;
                continue;
            }
        };
        let many = matches!(label, Label::Many(_));
        let packed = many && wire == 2 && wire_type(kind) != 2;
        if wire != wire_type(kind) && !packed {
            reader.skip(number, wire, 0)?;
            continue;
        }
        let mut read = Vec::new();
        match kind {
            Kind::Sub(inner) => {
                let mut child = if many { Node::default() } else { node.sub(number).cloned().unwrap_or_default() };
                merge(inner, reader.block()?, &mut child)?;
                read.push(Value::Sub(child));
            }
            Kind::Text => {
                let text = std::str::from_utf8(reader.block()?).map_err(|_| Malformed)?;
                read.push(Value::Text(text.to_string()));
            }
            _ if packed => {
                let mut inner = Reader(reader.block()?);
                while !inner.0.is_empty() {
                    read.push(inner.number(kind)?);
                }
            }
            _ => read.push(reader.number(kind)?),
        }
        if schema.oneof.contains(&number) {
            for other in schema.oneof.iter().filter(|other| **other != number) {
                node.0.remove(other);
            }
        }
        let values = node.0.entry(number).or_default();
        if !many {
            values.clear();
        }
        values.extend(read);
        if values.is_empty() {
            node.0.remove(&number); // a packed field without entries is absent
        }
    }
    Ok(())
}

fn value_fits(value: &Value, kind: &Kind, bound: &Bound) -> bool {
    match (value, kind, bound) {
        (Value::Sub(node), Kind::Sub(schema), _) => fits(schema, node),
        (Value::Whole(v), _, Bound::Whole(low, high)) => low <= v && v <= high,
        (Value::Real(v), _, Bound::Between(low, high)) => low <= v && v <= high,
        (Value::Real(v), _, Bound::Above(low, high)) => low < v && v <= high,
        (Value::Real(v), _, Bound::OrInfinite(low, high)) => (low <= v && v <= high) || *v == f64::INFINITY,
        (Value::Text(v), _, Bound::Bytes(most)) => v.len() <= *most,
        (_, _, Bound::Any) => true,
        _ => false,
    }
}

/// Whether the whole message is within its bounds. A missing field counts as 0 unless it is optional.
pub fn fits(schema: &Schema, node: &Node) -> bool {
    let fields_fit = schema.fields.iter().all(|Field(number, kind, label, bound)| {
        let values = node.all(*number);
        let count_fits = match label {
            Label::Many(allowed) => allowed(values.len()),
            Label::Required => !values.is_empty(),
            Label::Optional => true,
            Label::One if !values.is_empty() => true,
            Label::One => match kind {
                Kind::Text | Kind::Sub(_) => true,
                Kind::Real => value_fits(&Value::Real(0.0), kind, bound),
                _ => value_fits(&Value::Whole(0), kind, bound),
            },
        };
        count_fits && values.iter().all(|value| value_fits(value, kind, bound))
    });
    fields_fit && (schema.rule)(node)
}

/// Writes a message. Fields are written in the order of the calls. Zeros are omitted, as in proto3.
#[derive(Default)]
pub struct Writer(pub Vec<u8>);

impl Writer {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }
    fn tag(&mut self, number: u32, wire: u32) {
        self.varint(u64::from(number << 3 | wire));
    }
    pub fn whole(&mut self, number: u32, value: u64) {
        if value != 0 {
            self.tag(number, 0);
            self.varint(value);
        }
    }
    pub fn fixed32(&mut self, number: u32, value: u32) {
        if value != 0 {
            self.tag(number, 5);
            self.0.extend(value.to_le_bytes());
        }
    }
    pub fn fixed64(&mut self, number: u32, value: i64) {
        if value != 0 {
            self.tag(number, 1);
            self.0.extend(value.to_le_bytes());
        }
    }
    /// −0 is written, because its bits are not zero.
    pub fn real(&mut self, number: u32, value: f64) {
        if value.to_bits() != 0 {
            self.present_real(number, value);
        }
    }
    /// A field whose presence matters even if it is 0.
    pub fn present_real(&mut self, number: u32, value: f64) {
        self.tag(number, 1);
        self.0.extend(value.to_le_bytes());
    }
    pub fn bytes(&mut self, number: u32, value: &[u8]) {
        self.tag(number, 2);
        self.varint(value.len() as u64);
        self.0.extend(value);
    }
    pub fn text(&mut self, number: u32, value: &str) {
        if !value.is_empty() {
            self.bytes(number, value.as_bytes());
        }
    }
    /// A vector or a quaternion, written even if it is zero.
    pub fn reals(&mut self, number: u32, values: &[f64]) {
        let mut inner = Writer::default();
        for (i, value) in values.iter().enumerate() {
            inner.real(i as u32 + 1, *value);
        }
        self.bytes(number, &inner.0);
    }
    pub fn packed(&mut self, number: u32, values: &[f64]) {
        self.bytes(number, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
    }
}
