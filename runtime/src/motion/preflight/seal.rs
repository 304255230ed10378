//! Where what was found out is kept, and the form it is kept in: one line of a checksum, then JSON.

use std::hash::Hasher;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;
use siphasher::sip128::{Hasher128, SipHasher13};

/// Keeps bytes under a name for another time. Nothing depends on it but the time that a check takes.
pub trait Store: Sync {
    /// What was kept under a name, if it still is.
    fn load(&self, name: &str) -> Option<Vec<u8>>;
    /// Keeps bytes under a name.
    fn save(&self, name: &str, bytes: &[u8]);
    /// Whether it keeps anything at all.
    fn keeps(&self) -> bool {
        true
    }
}

/// Keeps nothing.
pub struct Nowhere;

impl Store for Nowhere {
    fn load(&self, _: &str) -> Option<Vec<u8>> {
        None
    }

    fn save(&self, _: &str, _: &[u8]) {}

    fn keeps(&self) -> bool {
        false
    }
}

/// One at a time adds to what is kept: workflows are looked at on several threads.
static ADDING: Mutex<()> = Mutex::new(());

/// What is kept under a name, made anew from what is there now.
pub fn add(store: &dyn Store, name: &str, made: impl FnOnce(Option<Vec<u8>>) -> Option<Vec<u8>>) {
    let _alone = ADDING.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(bytes) = made(store.load(name)) {
        store.save(name, &bytes);
    }
}

/// Which code it was that planned: another one may plan otherwise.
pub const MADE_BY: &str = concat!(env!("CARGO_PKG_VERSION"), "-", env!("MATTERIX_MOTION_SOURCES"));

/// The bytes that a value is kept as.
pub fn closed<T: Serialize>(value: &T) -> Option<Vec<u8>> {
    let body = serde_json::to_vec(value).ok()?;
    let mut bytes = sum(&body).into_bytes();
    bytes.push(b'\n');
    bytes.extend(body);
    Some(bytes)
}

/// The value that was kept; none where something else was, or not all of it is there.
pub fn opened<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let (line, body) = (bytes.get(..end)?, bytes.get(end + 1..)?);
    if line == sum(body).as_bytes() { serde_json::from_slice(body).ok() } else { None }
}

/// What bytes are known by.
pub fn sum(bytes: &[u8]) -> String {
    let mut hash = SipHasher13::new();
    hash.write(bytes);
    hex(&hash)
}

/// A hash as text.
pub fn hex(hash: &SipHasher13) -> String {
    format!("{:032x}", hash.finish128().as_u128())
}
