//! What tests of files share: the error that should have come, and damage.
#![allow(dead_code)] // each test file uses its part

use marmor::math::hash;
use marmor::{Error, ErrorKind};

/// The message and kind of what should have failed.
pub fn failure<T>(result: Result<T, Error>, case: &str) -> (String, ErrorKind) {
    match result {
        Ok(_) => panic!("accepted: {case}"),
        Err(e) => (e.to_string(), e.kind()),
    }
}

/// Deterministic damage: bytes replaced, cut out, doubled.
pub fn damaged(text: &[u8], seed: u64) -> Vec<u8> {
    const SPICE: &[u8] = b"0123456789-+./\\ \n\teEnvftlgo#[]{}=\"',\xff\x00";
    let mut bytes = text.to_vec();
    for i in 0..1 + seed % 6 {
        let h = hash(seed * 16 + i + 1);
        let at = (h >> 8) as usize % bytes.len();
        match h % 4 {
            0 | 1 => bytes[at] = SPICE[(h >> 40) as usize % SPICE.len()],
            2 => drop(bytes.remove(at)),
            _ => bytes.extend_from_within(at..bytes.len().min(at + (h >> 40) as usize % 40)),
        }
    }
    bytes
}
