//! Who may call: the one who has taken the server, and those who have logged in.

mod users;

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use http::HeaderMap;
use matterix_sila::Feature;
use tonic::Status;
use tonic::metadata::{BinaryMetadataValue, MetadataMap};

pub use users::Users;

use crate::call::{Failure, refused};
use crate::framework::Refusal;
use crate::metadata::{ACCESS, LOCK, LOGIN, PREFIX, key, text};

/// How long a token lives after the last call with it, s.
const TOKEN_LIFETIME: i64 = 3600;

/// The most tokens that are kept: the ones used longest ago end first.
const MOST_TOKENS: usize = 1000;

/// The definitions, in the order in which they are offered.
pub(super) fn features(has_users: bool) -> Vec<Feature> {
    let texts = [
        include_str!("../../features/lock.sila.xml"),
        include_str!("../../features/login.sila.xml"),
        include_str!("../../features/access.sila.xml"),
    ];
    let taken = if has_users { texts.len() } else { 1 };
    // A test reads them all.
    texts[..taken].iter().filter_map(|text| matterix_sila::read(text).ok()).collect()
}

/// A client that has taken the server.
struct Taken {
    name: String,
    /// How long it may be silent.
    lapse: Option<Duration>,
    heard: Instant,
}

impl Taken {
    fn has_lapsed(&self) -> bool {
        self.lapse.is_some_and(|lapse| self.heard.elapsed() > lapse)
    }
}

/// Somebody who has logged in.
struct Token {
    user: String,
    /// Full identifiers of features; all where there are none.
    features: Vec<String>,
    heard: Instant,
}

impl Token {
    fn has_ended(&self) -> bool {
        self.heard.elapsed() > Duration::from_secs(TOKEN_LIFETIME.unsigned_abs())
    }
}

/// Who may call.
pub(super) struct Guard {
    users: Option<Users>,
    taken: Mutex<Option<Taken>>,
    tokens: Mutex<BTreeMap<String, Token>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[allow(clippy::disallowed_methods, reason = "servers live by the wall clock")]
fn now() -> Instant {
    Instant::now()
}

/// The full identifier of one of the features above.
fn id(identifier: &str) -> String {
    format!("org.silastandard/core/{identifier}/v1")
}

/// A defined error of one of the features above.
pub(super) fn error(identifier: &str, name: &str, message: &str) -> Status {
    Failure::Refused { name: name.to_owned(), message: message.to_owned() }.status(&id(identifier))
}

impl Guard {
    /// Only these may call, once they have logged in; everybody where there are none.
    pub fn new(users: Option<Users>) -> Self {
        Guard { users, taken: Mutex::default(), tokens: Mutex::default() }
    }

    /// Whether people must log in.
    pub fn has_users(&self) -> bool {
        self.users.is_some()
    }

    /// Whether nothing goes beside a call but what is known here, and nothing at all where it asks the server about itself.
    pub fn knows(&self, of_service: bool, headers: &HeaderMap) -> Result<(), Status> {
        let (lock, token) = (key(&id(LOCK), "LockIdentifier"), key(&id(ACCESS), "AccessToken"));
        let is_known = |k: &str| k == lock || k == token && self.has_users();
        let mut beside = headers.keys().map(|k| k.as_str()).filter(|k| k.starts_with(PREFIX));
        match of_service {
            true => beside.next().map_or(Ok(()), |key| {
                Err(refused(Refusal::NoMetadata, format!("calls of SiLAService take no `{key}`")))
            }),
            false => beside
                .find(|k| !is_known(k))
                .map_or(Ok(()), |unknown| Err(refused(Refusal::Metadata, format!("`{unknown}` is unknown here")))),
        }
    }

    /// Whether a feature may be called with what goes beside the call; who calls, if that is known.
    pub fn admits(&self, feature: &Feature, beside: &MetadataMap) -> Result<Option<String>, Status> {
        let user = self.user(&feature.id(), beside)?;
        // Who may lock and unlock is asked by these commands themselves.
        if feature.identifier != LOCK || feature.originator != crate::metadata::STANDARD {
            self.is_free(beside)?;
        }
        Ok(user)
    }

    fn user(&self, feature: &str, beside: &MetadataMap) -> Result<Option<String>, Status> {
        if !self.has_users() {
            return Ok(None);
        }
        let given = one(beside, &key(&id(ACCESS), "AccessToken"))?;
        let given = given.ok_or_else(|| refused(Refusal::Metadata, "log in first: the call has no access token"))?;
        let mut tokens = locked(&self.tokens);
        tokens.retain(|_, token| !token.has_ended());
        let none = || error(ACCESS, "InvalidAccessToken", "the access token is unknown or has expired");
        let token = tokens.get_mut(&given).ok_or_else(none)?;
        if !token.features.is_empty() && !token.features.iter().any(|f| f == feature) {
            return Err(error(ACCESS, "InvalidAccessToken", "the access token is for other features"));
        }
        token.heard = now();
        Ok(Some(token.user.clone()))
    }

    fn is_free(&self, beside: &MetadataMap) -> Result<(), Status> {
        let given = one(beside, &key(&id(LOCK), "LockIdentifier"))?;
        let mut held = locked(&self.taken);
        let Some(taken) = held.as_mut().filter(|taken| !taken.has_lapsed()) else {
            *held = None;
            return Ok(());
        };
        match given {
            Some(name) if name == taken.name => {
                taken.heard = now();
                Ok(())
            }
            Some(_) => Err(error(LOCK, "InvalidLockIdentifier", "another client has locked the server")),
            None => {
                Err(refused(Refusal::Metadata, "a client has locked the server, and the call has no lock identifier"))
            }
        }
    }

    /// Whether a client has taken the server.
    pub fn is_taken(&self) -> bool {
        locked(&self.taken).as_ref().is_some_and(|taken| !taken.has_lapsed())
    }

    /// Takes the server; it lets go after so many seconds without a call, never where these are 0.
    pub fn take(&self, name: String, lapse: i64) -> Result<(), Status> {
        let mut held = locked(&self.taken);
        if held.as_ref().is_some_and(|taken| !taken.has_lapsed()) {
            return Err(error(LOCK, "ServerAlreadyLocked", "a client has locked the server"));
        }
        let lapse = u64::try_from(lapse).ok().filter(|s| *s > 0).map(Duration::from_secs);
        *held = Some(Taken { name, lapse, heard: now() });
        Ok(())
    }

    /// Lets others call again.
    pub fn release(&self, name: &str) -> Result<(), Status> {
        let mut held = locked(&self.taken);
        let Some(taken) = held.as_ref().filter(|taken| !taken.has_lapsed()) else {
            return Err(error(LOCK, "ServerNotLocked", "nobody has locked the server"));
        };
        if taken.name != name {
            return Err(error(LOCK, "InvalidLockIdentifier", "the server was locked with another identifier"));
        }
        *held = None;
        Ok(())
    }

    /// A token for a user, and how long it lives, s. Slow on purpose: who guesses passwords waits for each.
    pub fn log_in(&self, user: &str, password: &str, features: Vec<String>) -> Result<(String, i64), Status> {
        let known = self.users.as_ref().is_some_and(|users| users.knows(user, password));
        if !known {
            return Err(error(LOGIN, "AuthenticationFailed", "the user name or the password is wrong"));
        }
        let mut tokens = locked(&self.tokens);
        tokens.retain(|_, token| !token.has_ended());
        if tokens.len() >= MOST_TOKENS
            && let Some(oldest) = tokens.iter().min_by_key(|(_, token)| token.heard).map(|(name, _)| name.clone())
        {
            tokens.remove(&oldest);
        }
        let name = format!("{}{}", uuid::Uuid::new_v4().simple(), uuid::Uuid::new_v4().simple());
        tokens.insert(name.clone(), Token { user: user.to_owned(), features, heard: now() });
        Ok((name, TOKEN_LIFETIME))
    }

    /// Ends a token.
    pub fn log_out(&self, token: &str) -> Result<(), Status> {
        let ended = locked(&self.tokens).remove(token);
        let none = || error(LOGIN, "InvalidAccessToken", "the access token is unknown or has expired");
        ended.filter(|token| !token.has_ended()).map(|_| ()).ok_or_else(none)
    }
}

/// The text of a header, if it is there once.
fn one(beside: &MetadataMap, key: &str) -> Result<Option<String>, Status> {
    let mut all = beside.get_all_bin(key).iter();
    let Some(value) = all.next() else { return Ok(None) };
    let wrong = || refused(Refusal::Metadata, format!("`{key}` must be given once, as a text"));
    let bytes = |value: &BinaryMetadataValue| value.to_bytes().ok().and_then(|bytes| text(&bytes));
    let read = bytes(value).ok_or_else(wrong)?;
    all.next().map_or(Ok(Some(read)), |_| Err(wrong()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_features_are_sound() {
        assert_eq!(features(false).len(), 1);
        let all: Vec<String> = features(true).iter().map(Feature::id).collect();
        assert_eq!(all, [id(LOCK), id(LOGIN), id(ACCESS)]);
    }

    #[test]
    fn a_lock_lapses_where_nothing_is_heard() {
        let guard = Guard::new(None);
        guard.take("ana".into(), 0).expect("it is free");
        assert!(guard.is_taken());
        assert!(guard.take("bob".into(), 5).is_err());
        assert!(guard.release("bob").is_err());
        guard.release("ana").expect("it is hers");
        assert!(guard.release("ana").is_err());
        guard.take("bob".into(), 1).expect("it is free");
        if let Some(taken) = locked(&guard.taken).as_mut() {
            taken.lapse = Some(Duration::ZERO);
        }
        std::thread::sleep(Duration::from_millis(2));
        assert!(!guard.is_taken());
        guard.take("ana".into(), 1).expect("it has lapsed");
    }
}
