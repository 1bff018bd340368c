// SPDX-License-Identifier: Apache-2.0
//! The handshake of cipher suites 1 and 2 (WIRE.md): Noise_NNpsk0_25519_ChaChaPoly_SHA256 of the client, key files, and
//! the keys of a session. Uses libsodium's primitives.

use std::os::raw::{c_int, c_uchar, c_ulonglong, c_void};

use crate::aead::{Cipher, Sealing};

extern "C" {
    fn sodium_init() -> c_int;
    fn randombytes_buf(out: *mut c_void, size: usize);
    fn crypto_scalarmult_curve25519(out: *mut c_uchar, scalar: *const c_uchar, point: *const c_uchar) -> c_int;
    fn crypto_scalarmult_curve25519_base(out: *mut c_uchar, scalar: *const c_uchar) -> c_int;
    fn crypto_hash_sha256(out: *mut c_uchar, text: *const c_uchar, size: c_ulonglong) -> c_int;
}

pub type Key = [u8; 32];

/// Call this before any other function of this file. libsodium initializes its random number generator here.
pub fn start() {
    assert!(unsafe { sodium_init() } >= 0, "libsodium does not start");
}

pub fn random<const N: usize>() -> [u8; N] {
    let mut bytes = [0; N];
    unsafe { randombytes_buf(bytes.as_mut_ptr().cast(), N) };
    bytes
}

pub fn sha256(text: &[u8]) -> Key {
    let mut out = [0; 32];
    unsafe { crypto_hash_sha256(out.as_mut_ptr(), text.as_ptr(), text.len() as c_ulonglong) };
    out
}

/// RFC 2104. Keys of Noise are never longer than a block.
pub fn hmac(key: &[u8], data: &[u8]) -> Key {
    let mut block = [0u8; 64];
    if key.len() > 64 {
        block[..32].copy_from_slice(&sha256(key));
    } else {
        block[..key.len()].copy_from_slice(key);
    }
    let inner: Vec<u8> = block.iter().map(|byte| byte ^ 0x36).chain(data.iter().copied()).collect();
    let outer: Vec<u8> = block.iter().map(|byte| byte ^ 0x5c).chain(sha256(&inner)).collect();
    sha256(&outer)
}

fn public_of(secret: &Key) -> Key {
    let mut out = [0; 32];
    unsafe { crypto_scalarmult_curve25519_base(out.as_mut_ptr(), secret.as_ptr()) };
    out
}

/// None for a public key of low order: libsodium refuses a result of 32 zeros.
pub fn x25519(secret: &Key, public: &Key) -> Option<Key> {
    let mut out = [0; 32];
    let failed = unsafe { crypto_scalarmult_curve25519(out.as_mut_ptr(), secret.as_ptr(), public.as_ptr()) } != 0;
    if failed || out == [0; 32] {
        return None;
    }
    Some(out)
}

pub fn key_id(key: &Key) -> [u8; 8] {
    sha256(&[b"tendon-key-id", key.as_slice()].concat())[..8].try_into().unwrap()
}

/// Seals Data, client → server and server → client.
#[derive(Clone, Copy)]
pub struct Keys {
    pub send: Sealing,
    pub receive: Sealing,
}

/// The payload of message 2, the keys of suite 1, and h.
pub struct Finished {
    pub text: Vec<u8>,
    pub keys: Keys,
    pub hash: Key,
}

impl Finished {
    pub fn keys_of_suite_2(&self) -> Keys {
        let bound = |of: &Sealing| Sealing {
            cipher: Cipher::AesGcm,
            key: hmac(&of.key, &[b"tendon-suite-2".as_slice(), &self.hash].concat()),
        };
        Keys { send: bound(&self.keys.send), receive: bound(&self.keys.receive) }
    }
}

/// The client side of one attempt. Invalid messages 2 do not change the state after message 1.
pub struct Handshake {
    ephemeral: Key,
    state: Symmetric,
}

#[derive(Clone)]
struct Symmetric {
    chaining_key: Key,
    hash: Key,
    key: Key,
    nonce: u64,
}

impl Symmetric {
    fn sealing(&self) -> Sealing {
        Sealing { cipher: Cipher::ChaChaPoly, key: self.key }
    }
    fn mix_hash(&mut self, data: &[u8]) {
        self.hash = sha256(&[&self.hash, data].concat());
    }
    fn derive(&self, input: &[u8]) -> [Key; 3] {
        let secret = hmac(&self.chaining_key, input);
        let first = hmac(&secret, &[1]);
        let second = hmac(&secret, &[first.as_slice(), &[2]].concat());
        let third = hmac(&secret, &[second.as_slice(), &[3]].concat());
        [first, second, third]
    }
    fn mix_key(&mut self, input: &[u8]) {
        let [chaining_key, key, _] = self.derive(input);
        self.chaining_key = chaining_key;
        self.key = key;
        self.nonce = 0;
    }
    fn mix_key_and_hash(&mut self, input: &[u8]) {
        let [chaining_key, hash, key] = self.derive(input);
        self.chaining_key = chaining_key;
        self.mix_hash(&hash);
        self.key = key;
        self.nonce = 0;
    }
}

impl Handshake {
    /// Writes Noise message 1, whose payload is `text`.
    pub fn begin(psk: &Key, prologue: &[u8], ephemeral: Key, text: &[u8]) -> (Handshake, Vec<u8>) {
        let name = sha256(b"Noise_NNpsk0_25519_ChaChaPoly_SHA256");
        let mut state = Symmetric { chaining_key: name, hash: name, key: [0; 32], nonce: 0 };
        state.mix_hash(prologue);
        state.mix_key_and_hash(psk);
        let public = public_of(&ephemeral);
        state.mix_hash(&public);
        state.mix_key(&public); // with a psk, Noise also mixes an ephemeral key into the key
        let sealed = state.sealing().seal(state.nonce, &state.hash, text);
        state.nonce += 1;
        state.mix_hash(&sealed);
        (Handshake { ephemeral, state }, [public.as_slice(), &sealed].concat())
    }

    pub fn finish(&self, message: &[u8]) -> Option<Finished> {
        let theirs: Key = message.get(..32)?.try_into().ok()?;
        let mut state = self.state.clone();
        state.mix_hash(&theirs);
        state.mix_key(&theirs);
        state.mix_key(&x25519(&self.ephemeral, &theirs)?);
        let text = state.sealing().open(state.nonce, &state.hash, &message[32..])?;
        state.mix_hash(&message[32..]);
        let [send, receive, _] = state.derive(&[]);
        let [send, receive] = [send, receive].map(|key| Sealing { cipher: Cipher::ChaChaPoly, key });
        Some(Finished { text, keys: Keys { send, receive }, hash: state.hash })
    }
}

/// Returns whether the key grants only observation, and the key. The error is a sentence for users.
pub fn read_key(text: &str) -> Result<(bool, Key), &'static str> {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let words: Vec<&str> = lines.next().ok_or("no key in it")?.split_ascii_whitespace().collect();
    if lines.next().is_some() {
        return Err("more than one key in it");
    }
    let (role, digits) = match words.as_slice() {
        [role, digits] => (*role, *digits),
        _ => return Err("a key is a role and 64 hexadecimal digits"),
    };
    if role != "controller" && role != "observer" {
        return Err("the role is neither controller nor observer");
    }
    if digits.len() != 64 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err("not 64 hexadecimal digits");
    }
    let mut key = [0; 32];
    for (i, byte) in key.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).unwrap();
    }
    let different = |bytes: &mut dyn Iterator<Item = u8>| bytes.collect::<std::collections::HashSet<u8>>().len();
    if different(&mut key.iter().copied()) < 18
        || different(&mut key.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]))) < 18
        || key.iter().all(|byte| (0x20..0x7f).contains(byte))
    {
        return Err("a weak key");
    }
    Ok((role == "observer", key))
}
