// SPDX-License-Identifier: Apache-2.0
//! SESSION.md after the Welcome, without socket or clock: datagrams and times (ns) in, datagrams and events out.

use std::collections::{BTreeMap, VecDeque};

use crate::aead::Sealing;
use crate::opening::{header, Welcome, ANSWER_TYPE, DATA, RETRY};
use crate::protobuf::{decode, fits, Node, Writer};
use crate::schema::{usable_time, CONTROL_ACK, DATAGRAM, ECHO, FORCE, FRAME};

pub const CODE_OK: i128 = 1;
const CODE_INVALID: i128 = 2;
const CODE_UNSUPPORTED: i128 = 3;
const CODE_TIMED_OUT: i128 = 7;
pub const CODE_EXPIRED: i128 = 8;
const MS: i64 = 1_000_000;
const KEEP_ALIVE_NS: i64 = 50 * MS;
const KEY_AGE_NS: i64 = 590_000 * MS; // 10 s before the latest renewal of the key
const KEY_DATAGRAMS: u64 = 1 << 20;
const OVERLAP_NS: i64 = 2_000 * MS;
const SESSION_AGE_NS: i64 = 86_400_000 * MS;
const NUMBERS: u64 = 1 << 60;
const OPEN_REQUESTS: u32 = 16;
const ROOM: usize = 1200 - 16 - 16 - 64; // for frames: without header, tag, time and echo

/// Replaces an answer that is out of bounds.
fn invalid_answer(id: i128) -> Node {
    let mut answer = Writer::default();
    answer.whole(1, id as u64);
    answer.whole(2, CODE_INVALID as u64);
    answer.text(3, "a field of the answer is out of bounds");
    decode(&CONTROL_ACK, &answer.0).unwrap_or_default()
}

/// The 1984 newest packet numbers, in a ring of 2048 bits.
pub struct Window {
    bits: [u64; 32],
    newest: Option<u64>,
}

impl Window {
    pub fn new() -> Window {
        Window { bits: [0; 32], newest: None }
    }
    pub fn seen(&self, number: u64) -> bool {
        match self.newest {
            Some(newest) if number <= newest => {
                newest - number >= 1984 || self.bits[(number / 64 % 32) as usize] >> (number % 64) & 1 == 1
            }
            _ => false,
        }
    }
    /// Returns true if the number is the newest so far.
    pub fn remember(&mut self, number: u64) -> bool {
        let newer = self.newest.map_or(true, |newest| number > newest);
        if newer {
            let words = match self.newest {
                Some(newest) => (number / 64 - newest / 64).min(32),
                None => 32,
            };
            for i in 0..words {
                self.bits[((number / 64).wrapping_sub(i) % 32) as usize] = 0;
            }
            self.newest = Some(number);
        }
        self.bits[(number / 64 % 32) as usize] |= 1 << (number % 64);
        newer
    }
}

#[derive(Debug, Default, PartialEq)]
pub struct Counters {
    pub received: u64,
    pub duplicated: u64,
    pub malformed: u64,
    pub forged: u64,
    pub old_key: u64,
    pub invalid: u64,
    pub stale: u64,
    pub reordered: u64,
}

fn suite_of(key: &Option<Sealing>) -> u8 {
    key.map_or(0, |key| key.cipher as u8)
}

pub enum Event {
    State(Node),
    /// The answer to the request with this number.
    Answer(u32, Node),
    Report(Node),
    Closed {
        code: i128,
        reason: String,
    },
}

struct Request {
    id: u32,
    frame: Vec<u8>,
    due_ns: i64,
    interval_ns: i64,
    answer: Option<Node>,
}

struct Newest {
    number: u64,
    tx_time_ns: i64,
    arrival_ns: i64,
    mask: u32,
}

pub struct Session {
    pub counters: Counters,
    pub closed: bool,
    random: Option<[u8; 16]>,
    connection: u32,
    timeout_ns: i64,
    opened_ns: i64,
    heard_ns: i64,
    sent_ns: i64,
    send_key: Option<Sealing>, // None in suite 0
    send_epoch: u8,
    send_number: u64,
    key_number: u64,
    key_ns: i64,
    receive_key: Option<Sealing>,
    receive_epoch: u8,
    previous: Option<(Sealing, i64)>,
    window: Window,
    newest: Option<Newest>,
    smoothed_ns: Option<(i64, i64)>,
    newest_of: BTreeMap<(u32, i128, i128), i128>, // by kind of frame, device and channel
    force: Option<Vec<u8>>,
    requests: VecDeque<Request>,
    next_request: u32,
    next_asked: u32,
    asked: BTreeMap<u32, Node>,
    answers: BTreeMap<u32, Vec<u8>>,
    answers_due: VecDeque<u32>,
    events: VecDeque<Event>,
}

impl Session {
    pub fn new(welcome: &Welcome, random: Option<[u8; 16]>, now_ns: i64) -> Session {
        Session {
            counters: Counters::default(),
            closed: false,
            random,
            connection: welcome.connection,
            timeout_ns: 2_000 * MS,
            opened_ns: now_ns,
            heard_ns: now_ns,
            sent_ns: now_ns,
            send_key: welcome.keys.map(|keys| keys.send),
            send_epoch: 0,
            send_number: 0,
            key_number: 0,
            key_ns: now_ns,
            receive_key: welcome.keys.map(|keys| keys.receive),
            receive_epoch: 0,
            previous: None,
            window: Window::new(),
            newest: None,
            smoothed_ns: None,
            newest_of: BTreeMap::new(),
            force: None,
            requests: VecDeque::new(),
            next_request: 1,
            next_asked: 1,
            asked: BTreeMap::new(),
            answers: BTreeMap::new(),
            answers_due: VecDeque::new(),
            events: VecDeque::new(),
        }
    }

    pub fn event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Replaces a force that has not been sent yet. Returns false and sends nothing if a value is out of bounds.
    pub fn send_force(&mut self, force: Vec<u8>) -> bool {
        let good = decode(&FORCE, &force).map_or(false, |node| fits(&FORCE, &node));
        if good {
            self.force = Some(force);
        }
        good
    }

    /// `operation`: the field number in Control. None while 16 requests are open.
    pub fn request(&mut self, operation: u32, body: &[u8], now_ns: i64) -> Option<u32> {
        if self.requests.len() >= OPEN_REQUESTS as usize {
            return None;
        }
        let id = self.next_request;
        self.next_request += 1;
        let mut control = Writer::default();
        control.whole(1, u64::from(id));
        control.bytes(operation, body);
        let interval_ns = match self.smoothed_ns {
            Some((srtt, variation)) => (srtt + 4 * variation).clamp(20 * MS, 1_000 * MS),
            None => 100 * MS,
        };
        self.requests.push_back(Request { id, frame: control.0, due_ns: now_ns, interval_ns, answer: None });
        Some(id)
    }

    pub fn receive(&mut self, bytes: &[u8], now_ns: i64) {
        if self.closed {
            return;
        }
        let sealed = self.receive_key.is_some();
        if bytes.len() < 16 || bytes.len() > 1200 {
            self.counters.malformed += 1;
            return;
        }
        let late = [RETRY, ANSWER_TYPE].iter().any(|kind| bytes[..4] == header(*kind, 0, u8::from(sealed), 0, 0)[..4]);
        if late && self.random.is_some() && bytes.get(16..32) == self.random.as_ref().map(|random| random.as_slice()) {
            self.counters.duplicated += 1;
            return;
        }
        let number = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
        let epoch = bytes[2];
        if bytes[..8] != header(DATA, epoch, suite_of(&self.receive_key), self.connection, 0)[..8]
            || number >= NUMBERS
            || (!sealed && epoch != 0)
        {
            self.counters.malformed += 1;
            return;
        }
        if self.window.seen(number) {
            self.counters.duplicated += 1;
            return;
        }
        let text = match self.open(bytes, epoch, number, now_ns) {
            Some(text) => text,
            None => return,
        };
        if sealed {
            self.window.remember(number); // authentic, so the number is used up regardless of the body
        }
        let datagram = match decode(&DATAGRAM, &text) {
            Ok(datagram) if usable_time(datagram.whole(1)) && datagram.all(3).len() <= 64 => datagram,
            _ => {
                self.counters.malformed += 1;
                return;
            }
        };
        self.window.remember(number);
        self.counters.received += 1;
        self.heard_ns = now_ns;
        self.note_arrival(number, datagram.whole(1) as i64, now_ns);
        if let Some(echo) = datagram.sub(2) {
            self.take_echo(echo, datagram.whole(1), now_ns);
        }
        for frame in datagram.subs(3) {
            self.take_frame(frame);
            if self.closed {
                return;
            }
        }
    }

    fn open(&mut self, bytes: &[u8], epoch: u8, number: u64, now_ns: i64) -> Option<Vec<u8>> {
        let current = match self.receive_key {
            Some(key) => key,
            None => return Some(bytes[16..].to_vec()),
        };
        if self.previous.map_or(false, |(_, until_ns)| now_ns > until_ns) {
            self.previous = None;
        }
        let next = epoch == self.receive_epoch.wrapping_add(1);
        let key = if epoch == self.receive_epoch {
            current
        } else if next {
            current.next()
        } else if let (true, Some((key, _))) = (epoch.wrapping_add(1) == self.receive_epoch, self.previous) {
            key
        } else {
            self.counters.old_key += 1;
            return None;
        };
        let text = key.open(number, &bytes[..16], &bytes[16..]);
        if text.is_none() {
            self.counters.forged += 1;
        } else if next {
            self.previous = Some((current, now_ns + OVERLAP_NS));
            self.receive_key = Some(key);
            self.receive_epoch = epoch;
        }
        text
    }

    fn note_arrival(&mut self, number: u64, tx_time_ns: i64, arrival_ns: i64) {
        let mask_after = |mask: u32, ahead: u64| match ahead {
            1..=31 => mask << ahead | 1 << (ahead - 1),
            32 => 1 << 31,
            _ => 0,
        };
        match &mut self.newest {
            Some(newest) if number < newest.number => {
                self.counters.reordered += 1;
                let behind = newest.number - number;
                if behind <= 32 {
                    newest.mask |= 1 << (behind - 1);
                }
            }
            newest => {
                let mask = newest.as_ref().map_or(0, |newest| mask_after(newest.mask, number - newest.number));
                *newest = Some(Newest { number, tx_time_ns, arrival_ns, mask });
            }
        }
    }

    fn take_echo(&mut self, echo: &Node, t3: i128, now_ns: i64) {
        let (t1, t2) = (echo.whole(1), echo.whole(2));
        let ours = echo.whole(3) < i128::from(self.send_number)
            && (i128::from(self.opened_ns)..=i128::from(now_ns)).contains(&t1);
        if !fits(&ECHO, echo) || !ours || t3 < t2 {
            self.counters.invalid += 1;
            return;
        }
        let sample = (i128::from(now_ns) - t1) - (t3 - t2);
        if sample < 0 {
            return;
        }
        let sample = sample as i64;
        self.smoothed_ns = Some(match self.smoothed_ns {
            None => (sample, sample / 2),
            Some((srtt, variation)) => {
                ((7 * srtt + sample) / 8, (3 * variation + (srtt - sample).abs()) / 4)
                // RFC 6298, 2.3
            }
        });
    }

    fn take_frame(&mut self, frame: &Node) {
        let kind = match FRAME.oneof.iter().find(|kind| frame.has(**kind)) {
            Some(kind) => *kind,
            None => return, // from a later version
        };
        let body = frame.sub(kind).unwrap();
        if kind == 2 || !fits(&FRAME, frame) {
            self.counters.invalid += 1;
            // An invalid request or answer still uses its number, because later ones wait for it.
            match kind {
                3 if body.whole(1) > 0 => self.take_request(body),
                4 if body.whole(1) > 0 => self.take_answer(&invalid_answer(body.whole(1))),
                _ => {}
            }
            return;
        }
        match kind {
            1 => self.take_newest(kind, (body.whole(12), 0), body.whole(1) + 1, Event::State(body.clone())),
            3 => self.take_request(body),
            4 => self.take_answer(body),
            5 => {
                let reason = body.text(2).to_string();
                self.end(body.whole(1), reason);
            }
            6 => self.take_newest(kind, (0, 0), body.whole(1), Event::Report(body.clone())),
            _ => {} // DeviceReport and PeerReport need `diagnostics`, which this client does not request
        }
    }

    fn take_newest(&mut self, kind: u32, of: (i128, i128), count: i128, event: Event) {
        let newest = self.newest_of.entry((kind, of.0, of.1)).or_insert(0);
        if count <= *newest {
            self.counters.stale += 1;
            return;
        }
        *newest = count;
        self.events.push_back(event);
    }

    /// Handles each request once and in order. This client supports no requests, so the answer is always the same.
    fn take_request(&mut self, control: &Node) {
        let id = control.whole(1) as u32;
        if id >= self.next_asked.saturating_add(OPEN_REQUESTS) {
            self.counters.invalid += 1;
            return;
        }
        if id < self.next_asked {
            if self.answers.contains_key(&id) && !self.answers_due.contains(&id) {
                self.answers_due.push_back(id);
            }
            return;
        }
        self.asked.insert(id, control.clone());
        while self.asked.remove(&self.next_asked).is_some() {
            let mut answer = Writer::default();
            answer.whole(1, u64::from(self.next_asked));
            answer.whole(2, CODE_UNSUPPORTED as u64);
            answer.text(3, "this client knows no such request");
            self.answers.insert(self.next_asked, answer.0);
            self.answers.remove(&self.next_asked.saturating_sub(OPEN_REQUESTS));
            self.answers_due.push_back(self.next_asked);
            self.next_asked += 1;
        }
    }

    fn take_answer(&mut self, ack: &Node) {
        let id = ack.whole(1);
        if id >= i128::from(self.next_request) {
            self.counters.invalid += 1; // never requested
            return;
        }
        if let Some(request) = self.requests.iter_mut().find(|request| i128::from(request.id) == id) {
            request.answer.get_or_insert_with(|| ack.clone());
        }
        while self.requests.front().map_or(false, |request| request.answer.is_some()) {
            let request = self.requests.pop_front().unwrap();
            self.events.push_back(Event::Answer(request.id, request.answer.unwrap()));
        }
    }

    fn end(&mut self, code: i128, reason: String) {
        self.closed = true;
        self.events.push_back(Event::Closed { code, reason });
    }

    /// Ends the session after its timeout and returns its final datagrams.
    pub fn tick(&mut self, now_ns: i64) -> Vec<Vec<u8>> {
        if self.closed {
            return Vec::new();
        }
        if now_ns - self.heard_ns >= self.timeout_ns {
            self.end(CODE_TIMED_OUT, "nothing was heard for 2 s".to_string());
        } else if self.send_key.is_some()
            && (now_ns - self.opened_ns >= SESSION_AGE_NS || self.send_number >= NUMBERS - 3)
        {
            let byes = self.close(CODE_EXPIRED, "the session is 24 h old", now_ns);
            self.events.push_back(Event::Closed { code: CODE_EXPIRED, reason: "24 h are over".to_string() });
            return byes;
        }
        Vec::new()
    }

    /// Sends Bye three times.
    pub fn close(&mut self, code: i128, reason: &str, now_ns: i64) -> Vec<Vec<u8>> {
        let mut bye = Writer::default();
        bye.whole(1, code as u64);
        bye.text(2, reason);
        let mut frame = Writer::default();
        frame.bytes(5, &bye.0);
        let byes = (0..3).map(|_| self.write(&[frame.0.clone()], now_ns)).collect();
        self.closed = true;
        byes
    }

    /// Returns the next due datagram.
    pub fn next(&mut self, now_ns: i64) -> Option<Vec<u8>> {
        if self.closed {
            return None;
        }
        let mut frames: Vec<Vec<u8>> = Vec::new();
        let mut room = ROOM;
        let mut fit = |kind: u32, body: &[u8], frames: &mut Vec<Vec<u8>>| {
            let mut frame = Writer::default();
            frame.bytes(kind, body);
            if frame.0.len() + 3 > room || frames.len() == 64 {
                return false;
            }
            room -= frame.0.len() + 3;
            frames.push(frame.0);
            true
        };
        if let Some(force) = self.force.take() {
            fit(2, &force, &mut frames);
        }
        while let Some(id) = self.answers_due.front() {
            if let Some(answer) = self.answers.get(id) {
                if !fit(4, answer, &mut frames) {
                    break;
                }
            }
            self.answers_due.pop_front();
        }
        for request in self.requests.iter_mut() {
            if request.answer.is_none() && request.due_ns <= now_ns && fit(3, &request.frame, &mut frames) {
                request.due_ns = now_ns + request.interval_ns;
                request.interval_ns = (2 * request.interval_ns).min(1_000 * MS);
            }
        }
        let first = self.send_number == 0;
        if frames.is_empty() && !first && now_ns - self.sent_ns < KEEP_ALIVE_NS {
            return None;
        }
        Some(self.write(&frames, now_ns))
    }

    /// The time of the next action if nothing is received.
    pub fn wake_ns(&self) -> i64 {
        let requests = self.requests.iter().filter(|request| request.answer.is_none()).map(|request| request.due_ns);
        requests.fold((self.sent_ns + KEEP_ALIVE_NS).min(self.heard_ns + self.timeout_ns), i64::min)
    }

    fn write(&mut self, frames: &[Vec<u8>], now_ns: i64) -> Vec<u8> {
        let mut datagram = Writer::default();
        datagram.fixed64(1, now_ns);
        if let Some(newest) = &self.newest {
            let mut echo = Writer::default();
            echo.fixed64(1, newest.tx_time_ns);
            echo.fixed64(2, newest.arrival_ns);
            echo.whole(3, newest.number);
            echo.fixed32(4, newest.mask);
            datagram.bytes(2, &echo.0);
        }
        for frame in frames {
            datagram.bytes(3, frame);
        }
        if let Some(key) = self.send_key {
            if self.send_number - self.key_number >= KEY_DATAGRAMS || now_ns - self.key_ns >= KEY_AGE_NS {
                self.send_key = Some(key.next());
                self.send_epoch = self.send_epoch.wrapping_add(1);
                self.key_number = self.send_number;
                self.key_ns = now_ns;
            }
        }
        let number = self.send_number;
        self.send_number += 1;
        self.sent_ns = now_ns;
        let mut bytes = header(DATA, self.send_epoch, suite_of(&self.send_key), self.connection, number).to_vec();
        let body = match &self.send_key {
            Some(key) => key.seal(number, &bytes, &datagram.0),
            None => datagram.0,
        };
        bytes.extend(body);
        bytes
    }
}
