// SPDX-License-Identifier: Apache-2.0
//! The client against protocol/vectors: `rustc --test`. TENDON_VECTORS is that folder.

use std::collections::BTreeMap;

use crate::aead::{self, Cipher, Sealing};
use crate::noise::{self, Handshake, Key, Keys};
use crate::opening::{header, Attempt, Outcome, Welcome};
use crate::protobuf::{decode, fits, Node, Value, Writer};
use crate::schema::{usable_time, ANSWER, DATAGRAM, ECHO, FORCE, FRAME};
use crate::session::{Counters, Event, Session, Window};
use crate::Spring;

/// A JSON parser for the subset that the vectors use.
#[derive(Debug)]
enum Json {
    Text(String),
    Number(f64),
    Bool(bool),
    List(Vec<Json>),
    Object(BTreeMap<String, Json>),
}

impl Json {
    fn load(file: &str) -> Json {
        let folder = std::env::var("TENDON_VECTORS").expect("TENDON_VECTORS is the folder protocol/vectors");
        let text = std::fs::read_to_string(format!("{}/{}.json", folder, file)).unwrap();
        Json::parse(&mut text.chars().peekable())
    }
    fn parse(text: &mut std::iter::Peekable<std::str::Chars>) -> Json {
        while text.next_if(|c| c.is_ascii_whitespace() || *c == ',' || *c == ':').is_some() {}
        match text.next().unwrap() {
            '{' => {
                let mut members = BTreeMap::new();
                while !Json::ends(text, '}') {
                    let name = Json::parse(text).text().to_string();
                    members.insert(name, Json::parse(text));
                }
                Json::Object(members)
            }
            '[' => {
                let mut entries = Vec::new();
                while !Json::ends(text, ']') {
                    entries.push(Json::parse(text));
                }
                Json::List(entries)
            }
            '"' => {
                let mut out = String::new();
                loop {
                    match text.next().unwrap() {
                        '"' => return Json::Text(out),
                        '\\' => out.push(match text.next().unwrap() {
                            'n' => '\n',
                            'r' => '\r',
                            't' => '\t',
                            'u' => {
                                let digits: String = text.take(4).collect();
                                char::from_u32(u32::from_str_radix(&digits, 16).unwrap()).unwrap()
                            }
                            other => other,
                        }),
                        other => out.push(other),
                    }
                }
            }
            first => {
                let mut word = first.to_string();
                while let Some(c) = text.next_if(|c| c.is_ascii_alphanumeric() || "+-.".contains(*c)) {
                    word.push(c);
                }
                match word.as_str() {
                    "true" => Json::Bool(true),
                    "false" => Json::Bool(false),
                    number => Json::Number(number.parse().unwrap()),
                }
            }
        }
    }
    fn ends(text: &mut std::iter::Peekable<std::str::Chars>, end: char) -> bool {
        while text.next_if(|c| c.is_ascii_whitespace() || *c == ',').is_some() {}
        text.next_if_eq(&end).is_some()
    }
    fn at(&self, name: &str) -> &Json {
        match self {
            Json::Object(members) => members.get(name).unwrap_or_else(|| panic!("no {}", name)),
            _ => panic!("no object"),
        }
    }
    fn list(&self) -> &[Json] {
        match self {
            Json::List(entries) => entries,
            _ => panic!("no list"),
        }
    }
    fn text(&self) -> &str {
        match self {
            Json::Text(text) => text,
            _ => panic!("no text"),
        }
    }
    fn truth(&self) -> bool {
        matches!(self, Json::Bool(true))
    }
    fn number(&self) -> f64 {
        match self {
            Json::Number(number) => *number,
            Json::Text(text) => text.parse().unwrap(),
            _ => panic!("no number"),
        }
    }
    fn bytes(&self) -> Vec<u8> {
        let text = self.text();
        (0..text.len() / 2).map(|i| u8::from_str_radix(&text[2 * i..2 * i + 2], 16).unwrap()).collect()
    }
    fn array<const N: usize>(&self) -> [u8; N] {
        self.bytes().try_into().unwrap()
    }
}

fn welcome(file: &Json, keys: Option<Keys>) -> Welcome {
    let connection = file.at("connection_id").number() as u32;
    Welcome {
        connection,
        controls: true,
        local_model: true,
        handle: true,
        max_force_n: 8.0,
        device_name: String::new(),
        keys,
    }
}

fn sealed_keys(file: &Json) -> Keys {
    let cipher = if file.at("suite").number() as u8 == 2 { Cipher::AesGcm } else { Cipher::ChaChaPoly };
    let key = |name: &str| Sealing { cipher, key: file.at("welcome").at(name).array() };
    Keys { send: key("client_to_server_key"), receive: key("server_to_client_key") }
}

/// The files of suites 1 and 2; suite 2 only if the processor has AES.
fn sealed_files() -> Vec<Json> {
    noise::start();
    let names: &[&str] = if aead::has_aes() { &["sealed", "sealed_aes"] } else { &["sealed"] };
    names.iter().map(|name| Json::load(name)).collect()
}

#[test]
fn primitives_are_those_of_the_rfcs() {
    noise::start();
    let file = Json::load("primitives");
    for case in file.at("x25519").list() {
        let result = noise::x25519(&case.at("scalar").array(), &case.at("point").array());
        assert_eq!(result.unwrap().to_vec(), case.at("result").bytes());
    }
    for case in file.at("hmac_sha256").list() {
        // RFC 4231 includes a truncated result.
        let result = case.at("result").bytes();
        assert_eq!(noise::hmac(&case.at("key").bytes(), &case.at("data").bytes())[..result.len()], result);
    }
    for (name, cipher) in [("chacha20_poly1305", Cipher::ChaChaPoly), ("aes256_gcm", Cipher::AesGcm)] {
        if cipher == Cipher::AesGcm && !aead::has_aes() {
            continue;
        }
        for case in file.at(name).list() {
            let associated = case.at("associated_data").bytes();
            let (key, nonce) = (case.at("key").array(), case.at("nonce").array());
            assert_eq!(cipher.seal(&key, &nonce, &associated, &case.at("text").bytes()), case.at("sealed").bytes());
        }
    }
}

#[test]
fn a_point_of_low_order_has_no_secret() {
    noise::start();
    assert!(noise::x25519(&[7; 32], &[0; 32]).is_none());
}

#[test]
fn the_handshake_is_that_of_the_vectors() {
    for file in sealed_files() {
        let psk: Key = file.at("psk").array();
        assert_eq!(noise::key_id(&psk).to_vec(), file.at("key_id").bytes());
        let hello = file.at("hello");
        let (handshake, message) = Handshake::begin(
            &psk,
            &hello.at("prologue").bytes(),
            file.at("client_ephemeral").array(),
            &hello.at("body").bytes(),
        );
        assert_eq!(message, hello.at("noise_message").bytes());
        for name in ["welcome", "refused"] {
            let answer = file.at(name);
            let finished = handshake.finish(&answer.at("noise_message").bytes()).unwrap();
            assert_eq!(finished.text, answer.at("body").bytes());
            let aes = file.at("suite").number() as u8 == 2;
            let keys = if aes { finished.keys_of_suite_2() } else { finished.keys };
            assert_eq!(keys.send.key.to_vec(), answer.at("client_to_server_key").bytes());
            assert_eq!(keys.receive.key.to_vec(), answer.at("server_to_client_key").bytes());
        }
    }
}

#[test]
fn the_keys_seal_and_open_every_datagram() {
    for file in sealed_files() {
        for case in file.at("data").list() {
            let (bytes, number) = (case.at("datagram").bytes(), case.at("packet_number").text().parse().unwrap());
            let sends = case.at("direction").text() == "client_to_server";
            let mut key = if sends { sealed_keys(&file).send } else { sealed_keys(&file).receive };
            for _ in 0..case.at("epoch").number() as u32 {
                key = key.next();
            }
            let (epoch, connection) = (case.at("epoch").number() as u8, file.at("connection_id").number() as u32);
            let head = header(3, epoch, key.cipher as u8, connection, number);
            assert_eq!(bytes[..16], head);
            assert_eq!(bytes[16..], key.seal(number, &head, &case.at("body").bytes()));
            assert_eq!(key.open(number, &head, &bytes[16..]).unwrap(), case.at("body").bytes());
        }
    }
}

#[test]
fn each_datagram_to_drop_is_counted_as_what_it_is() {
    for file in sealed_files() {
        for case in file.at("dropped").list() {
            let mut session = Session::new(&welcome(&file, Some(sealed_keys(&file))), None, 0);
            session.receive(&case.at("datagram").bytes(), 0);
            let mut expected = Counters::default();
            match case.at("counter").text() {
                "forged" => expected.forged = 1,
                "old_key" => expected.old_key = 1,
                "malformed" => expected.malformed = 1,
                other => panic!("{}", other),
            }
            assert_eq!(session.counters, expected, "{}", case.at("name").text());
        }
    }
}

#[test]
fn packet_numbers_are_let_in_once() {
    for script in Json::load("replay").at("scripts").list() {
        let mut window = Window::new();
        for (number, accept) in script.at("packet_numbers").list().iter().zip(script.at("accept").list()) {
            let number = number.number() as u64;
            assert_eq!(!window.seen(number), accept.truth(), "{}: {}", script.at("name").text(), number);
            window.remember(number);
        }
    }
}

#[test]
fn key_files_are_read_or_refused() {
    for case in Json::load("key_files").at("files").list() {
        let read = noise::read_key(case.at("text").text());
        assert_eq!(read.is_ok(), case.at("accept").truth(), "{}", case.at("name").text());
        if let Ok((observes, key)) = read {
            assert_eq!(observes, case.at("role").text() == "observer");
            assert_eq!(key.to_vec(), case.at("key").bytes());
        }
    }
}

/// The vectors for messages to a client, and for forces, which the client checks before sending.
#[test]
fn every_bound_is_kept() {
    let mut judged = 0;
    for case in Json::load("bounds").at("bounds").list() {
        let (field, body) = (case.at("field").text(), case.at("body").bytes());
        if field.starts_with("DeviceStates.") {
            continue; // needs the feature `state-columns`
        }
        if field.contains("Field") || field.starts_with("DeviceState.field") {
            continue; // needs the feature `fields`
        }
        let accepted = match case.at("message").text() {
            "Hello" => continue,
            "Answer" => decode(&ANSWER, &body).map_or(false, |answer| fits(&ANSWER, &answer)),
            _ => decode(&DATAGRAM, &body).map_or(false, |datagram| {
                usable_time(datagram.whole(1))
                    && datagram.all(3).len() <= 64
                    && datagram.sub(2).map_or(true, |echo| fits(&ECHO, echo))
                    && datagram.subs(3).all(|frame| fits(&FRAME, frame))
            }),
        };
        assert_eq!(accepted, case.at("accepted").truth(), "{} {}", field, case.at("value").text());
        judged += 1;
    }
    assert!(judged > 700);
}

fn body_of(name: &str) -> Vec<u8> {
    let file = Json::load("plain");
    let case = file.at("data").list().iter().find(|case| case.at("name").text() == name).unwrap().at("body").bytes();
    case
}

#[test]
fn a_state_of_the_whole_handle_is_answered_by_a_torque() {
    let file = Json::load("plain");
    let granted = welcome(&file, None);
    let datagram = decode(&DATAGRAM, &body_of("a handle with all there is")).unwrap();
    let state = datagram.subs(3).find_map(|frame| frame.sub(1)).unwrap();
    let force = Spring::default().answer(state, &granted);
    let force = decode(&FORCE, &force).ok().filter(|force| fits(&FORCE, force)).unwrap();
    let [w, x, y, z] = state.sub(15).unwrap().reals::<4>();
    let [tx, ty, tz] = force.sub(10).unwrap().reals::<3>();
    assert!(tx * x + ty * y + tz * z < 0.0 && w > 0.0, "it turns the handle back");
    assert_eq!(force.sub(14).unwrap().sub(1).unwrap().reals::<4>(), [w, x, y, z]);
    assert!(force.has(11), "a gripper with a motor is pressed");
    let without = Spring::default().answer(state, &Welcome { handle: false, local_model: false, ..granted });
    let without = decode(&FORCE, &without).unwrap();
    assert!([4, 10, 11, 14].iter().all(|number| !without.has(*number)), "nothing that was not granted");
}

#[test]
fn a_force_with_a_torque_has_the_bytes_of_the_vector() {
    let mut model = Writer::default();
    let expected = body_of("torque and grip force");
    let datagram = decode(&DATAGRAM, &expected).unwrap();
    let frame = datagram.subs(3).next().unwrap();
    let force = frame.sub(2).unwrap();
    let mut command = Writer::default();
    command.whole(1, force.whole(1) as u64);
    command.whole(2, force.whole(2) as u64);
    command.reals(3, &force.sub(3).unwrap().reals::<3>());
    if let Some(local) = force.sub(4) {
        model.reals(1, &local.sub(1).unwrap().reals::<3>());
        model.packed(2, &reals_of(local));
        command.bytes(4, &model.0);
    }
    command.whole(5, force.whole(5) as u64);
    command.reals(10, &force.sub(10).unwrap().reals::<3>());
    command.present_real(11, force.real(11));
    let turn = force.sub(14).unwrap();
    let mut rotation = Writer::default();
    rotation.reals(1, &turn.sub(1).unwrap().reals::<4>());
    rotation.packed(2, &reals_of(turn));
    command.bytes(14, &rotation.0);
    assert!(expected.windows(command.0.len()).any(|part| part == command.0));
}

fn reals_of(node: &Node) -> Vec<f64> {
    let values = node.all(2).iter();
    values.map(|value| if let Value::Real(value) = value { *value } else { 0.0 }).collect()
}

#[test]
fn every_datagram_of_a_server_is_taken() {
    let file = Json::load("plain");
    let mut session = Session::new(&welcome(&file, None), None, 0);
    let from_server = |case: &&Json| case.at("direction").text() == "server_to_client";
    let mut cases: Vec<&Json> = file.at("data").list().iter().filter(from_server).collect();
    cases.sort_by_key(|case| case.at("packet_number").text().parse::<u64>().unwrap());
    let mut states = 0;
    let mut byes = 0;
    for case in cases {
        session.receive(&case.at("datagram").bytes(), 10_000_000_000);
        assert_eq!(session.counters.malformed, 0, "{}", case.at("name").text());
        while let Some(event) = session.event() {
            states += u32::from(matches!(event, Event::State(_)));
            byes += u32::from(matches!(event, Event::Closed { .. }));
        }
    }
    assert!(states > 1 && byes == 1);
}

#[test]
fn an_attempt_keeps_to_its_random_and_to_its_suite() {
    noise::start();
    let file = Json::load("plain");
    let mut attempt = Attempt::new(true, "spring", None, 0);
    let mut bytes = file.at("welcome").at("datagram").bytes();
    assert!(matches!(attempt.receive(&bytes, 0), Outcome::Nothing));
    bytes[16..32].copy_from_slice(&attempt.random);
    bytes[3] = 1;
    assert!(matches!(attempt.receive(&bytes, 0), Outcome::Nothing));
    bytes[3] = 0;
    assert!(matches!(attempt.receive(&bytes, 0), Outcome::Welcome(_)));
}
