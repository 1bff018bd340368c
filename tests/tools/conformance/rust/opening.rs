// SPDX-License-Identifier: Apache-2.0
//! The handshake (SESSION.md, "Opening"), without socket or clock: its inputs and outputs are datagrams and times.

use crate::aead;
use crate::noise::{self, Handshake, Key, Keys};
use crate::protobuf::{decode, fits, Node, Value, Writer};
use crate::schema::ANSWER;

pub const HELLO: u8 = 1;
pub const RETRY: u8 = 2;
pub const DATA: u8 = 3;
pub const ANSWER_TYPE: u8 = 4;
pub const OBSERVER: i128 = 1;
pub const CONTROLLER: i128 = 2;
pub const FEATURES: [&str; 2] = ["local-model", "handle"];
const AES: &str = "aes-256-gcm"; // offers and selects suite 2
const VERSION: i128 = 1;
const REPETITION_NS: i64 = 100_000_000;

pub fn header(kind: u8, epoch: u8, suite: u8, connection: u32, number: u64) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes[..4].copy_from_slice(&[0x54, 1 << 4 | kind, epoch, suite]);
    bytes[4..8].copy_from_slice(&connection.to_le_bytes());
    bytes[8..].copy_from_slice(&number.to_le_bytes());
    bytes
}

pub struct Welcome {
    pub connection: u32,
    pub controls: bool,
    pub local_model: bool,
    pub handle: bool,
    pub max_force_n: f64,
    pub device_name: String,
    /// None in suite 0.
    pub keys: Option<Keys>,
}

pub enum Outcome {
    Nothing,
    Welcome(Welcome),
    Refused { code: i128, detail: String },
}

pub struct Attempt {
    pub random: [u8; 16],
    cookie: Option<[u8; 16]>,
    noise: Option<Handshake>,
    controls: bool,
    body: Vec<u8>, // the Hello from its length field on
    pub due_ns: i64,
}

impl Attempt {
    pub fn new(controls: bool, name: &str, key: Option<&Key>, now_ns: i64) -> Attempt {
        let mut hello = Writer::default();
        hello.whole(1, VERSION as u64);
        hello.whole(2, VERSION as u64);
        hello.whole(3, if controls { CONTROLLER } else { OBSERVER } as u64);
        hello.text(4, name);
        for feature in FEATURES {
            hello.text(5, feature);
        }
        if key.is_some() && aead::has_aes() {
            hello.text(5, AES);
        }
        let random: [u8; 16] = noise::random();
        let mut state = None;
        let body = match key {
            None => hello.0,
            Some(key) => {
                let id = noise::key_id(key);
                let prologue = [b"tendon-1".as_slice(), &header(HELLO, 0, 1, 0, 0), &id, &random].concat();
                let (handshake, message) = Handshake::begin(key, &prologue, noise::random(), &hello.0);
                state = Some(handshake);
                [id.as_slice(), &message].concat()
            }
        };
        Attempt { random, cookie: None, noise: state, controls, body, due_ns: now_ns }
    }

    /// Suite of the handshake: 0 or 1.
    fn suite(&self) -> u8 {
        u8::from(self.noise.is_some())
    }

    /// Returns the Hello when it is due.
    pub fn next(&mut self, now_ns: i64) -> Option<Vec<u8>> {
        if now_ns < self.due_ns {
            return None;
        }
        self.due_ns = now_ns + REPETITION_NS;
        let mut bytes = header(HELLO, 0, self.suite(), 0, 0).to_vec();
        bytes.extend(self.random);
        bytes.extend(self.cookie.unwrap_or_default());
        bytes.extend((self.body.len() as u16).to_le_bytes());
        bytes.extend(&self.body);
        bytes.resize(1200, 0);
        Some(bytes)
    }

    pub fn receive(&mut self, bytes: &[u8], now_ns: i64) -> Outcome {
        // Only an Answer has a connection id in its header.
        let connection = match bytes.get(4..8) {
            Some(field) => u32::from_le_bytes(field.try_into().unwrap()),
            None => return Outcome::Nothing,
        };
        let is = |kind: u8, connection: u32| {
            bytes.starts_with(&header(kind, 0, self.suite(), connection, 0))
                && bytes.get(16..32) == Some(&self.random)
        };
        if bytes.len() == 48 && is(RETRY, 0) {
            if self.cookie.is_none() {
                self.due_ns = now_ns; // only the first Retry is answered immediately
            }
            self.cookie = Some(bytes[32..].try_into().unwrap());
            return Outcome::Nothing;
        }
        if bytes.len() >= 1200 || !is(ANSWER_TYPE, connection) {
            return Outcome::Nothing;
        }
        self.answer(connection, &bytes[32..]).unwrap_or(Outcome::Nothing)
    }

    fn answer(&self, connection: u32, body: &[u8]) -> Option<Outcome> {
        let finished = match &self.noise {
            None => None,
            Some(noise) => Some(noise.finish(body)?),
        };
        let text = finished.as_ref().map_or(body, |finished| &finished.text);
        let answer = decode(&ANSWER, text).ok().filter(|answer| fits(&ANSWER, answer))?;
        if let Some(refused) = answer.sub(2) {
            let outcome = Outcome::Refused { code: refused.whole(1), detail: refused.text(2).to_string() };
            return Some(outcome);
        }
        let welcome: &Node = answer.sub(1)?;
        if welcome.whole(1) != VERSION {
            return None;
        }
        let granted =
            |name: &str| welcome.all(2).iter().any(|feature| matches!(feature, Value::Text(text) if text == name));
        let aes = aead::has_aes() && granted(AES);
        let keys = finished.map(|finished| if aes { finished.keys_of_suite_2() } else { finished.keys });
        Some(Outcome::Welcome(Welcome {
            connection,
            controls: self.controls && welcome.whole(3) == CONTROLLER,
            local_model: granted("local-model"),
            handle: granted("handle"),
            max_force_n: welcome.real(5),
            device_name: welcome.text(4).to_string(),
            keys,
        }))
    }
}
