// SPDX-License-Identifier: Apache-2.0
//! The ciphers for Data (WIRE.md, cipher suites 1 and 2), with the nonce and key renewal of each. Uses libsodium, whose
//! AES needs hardware support.

use std::os::raw::{c_int, c_uchar, c_ulonglong};

use crate::noise::Key;

macro_rules! of_libsodium {
    ($encrypt:ident, $decrypt:ident) => {
        extern "C" {
            fn $encrypt(
                out: *mut c_uchar,
                out_size: *mut c_ulonglong,
                text: *const c_uchar,
                size: c_ulonglong,
                associated: *const c_uchar,
                associated_size: c_ulonglong,
                secret_nonce: *const c_uchar,
                nonce: *const c_uchar,
                key: *const c_uchar,
            ) -> c_int;
            fn $decrypt(
                out: *mut c_uchar,
                out_size: *mut c_ulonglong,
                secret_nonce: *mut c_uchar,
                sealed: *const c_uchar,
                size: c_ulonglong,
                associated: *const c_uchar,
                associated_size: c_ulonglong,
                nonce: *const c_uchar,
                key: *const c_uchar,
            ) -> c_int;
        }
    };
}
of_libsodium!(crypto_aead_chacha20poly1305_ietf_encrypt, crypto_aead_chacha20poly1305_ietf_decrypt);
of_libsodium!(crypto_aead_aes256gcm_encrypt, crypto_aead_aes256gcm_decrypt);
extern "C" {
    fn crypto_aead_aes256gcm_is_available() -> c_int;
}

/// Call noise::start() first.
pub fn has_aes() -> bool {
    unsafe { crypto_aead_aes256gcm_is_available() == 1 }
}

#[derive(Clone, Copy, PartialEq)]
pub enum Cipher {
    ChaChaPoly = 1,
    AesGcm = 2,
}

impl Cipher {
    fn nonce(self, number: u64) -> [u8; 12] {
        let mut bytes = [0; 12];
        bytes[4..].copy_from_slice(&match self {
            Cipher::ChaChaPoly => number.to_le_bytes(),
            Cipher::AesGcm => number.to_be_bytes(),
        });
        bytes
    }

    pub fn seal(self, key: &Key, nonce: &[u8; 12], associated: &[u8], text: &[u8]) -> Vec<u8> {
        let mut out = vec![0; text.len() + 16];
        let encrypt = match self {
            Cipher::ChaChaPoly => crypto_aead_chacha20poly1305_ietf_encrypt,
            Cipher::AesGcm => crypto_aead_aes256gcm_encrypt,
        };
        unsafe {
            encrypt(
                out.as_mut_ptr(),
                std::ptr::null_mut(),
                text.as_ptr(),
                text.len() as c_ulonglong,
                associated.as_ptr(),
                associated.len() as c_ulonglong,
                std::ptr::null(),
                nonce.as_ptr(),
                key.as_ptr(),
            );
        }
        out
    }

    /// None unless authentic.
    pub fn open(self, key: &Key, nonce: &[u8; 12], associated: &[u8], sealed: &[u8]) -> Option<Vec<u8>> {
        let mut out = vec![0; sealed.len().checked_sub(16)?];
        let decrypt = match self {
            Cipher::ChaChaPoly => crypto_aead_chacha20poly1305_ietf_decrypt,
            Cipher::AesGcm => crypto_aead_aes256gcm_decrypt,
        };
        let failed = unsafe {
            decrypt(
                out.as_mut_ptr(),
                std::ptr::null_mut(),
                std::ptr::null_mut(),
                sealed.as_ptr(),
                sealed.len() as c_ulonglong,
                associated.as_ptr(),
                associated.len() as c_ulonglong,
                nonce.as_ptr(),
                key.as_ptr(),
            )
        };
        if failed != 0 {
            return None;
        }
        Some(out)
    }
}

/// Seals one direction: a cipher with its key.
#[derive(Clone, Copy)]
pub struct Sealing {
    pub cipher: Cipher,
    pub key: Key,
}

impl Sealing {
    pub fn seal(&self, number: u64, associated: &[u8], text: &[u8]) -> Vec<u8> {
        self.cipher.seal(&self.key, &self.cipher.nonce(number), associated, text)
    }

    /// None unless authentic.
    pub fn open(&self, number: u64, associated: &[u8], sealed: &[u8]) -> Option<Vec<u8>> {
        self.cipher.open(&self.key, &self.cipher.nonce(number), associated, sealed)
    }

    /// The next key of this direction.
    pub fn next(&self) -> Sealing {
        Sealing { cipher: self.cipher, key: self.seal(u64::MAX, &[], &[0; 32])[..32].try_into().unwrap() }
    }
}
