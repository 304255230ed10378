//! How a server of SiLA 2 is spoken to: whom it is trusted by, who calls, and whether it is taken for oneself.

use toml::de::DeTable;

use super::Reader;
use crate::place::{Place, SilaTrust, fingerprint};

pub(super) const CERTIFICATE: &str = "certificate";
pub(super) const FINGERPRINT: &str = "fingerprint";
pub(super) const USER: &str = "user";
pub(super) const PASSWORD: &str = "password_env";
pub(super) const LOCK: &str = "lock";

/// The shortest lock, s: a program that was killed keeps others out for so long, and one that waits must not lose it.
const SHORTEST: u64 = 10;

/// The longest, s: a week.
const LONGEST: u64 = 7 * 24 * 3600;

impl Reader<'_> {
    /// Adds to a server what its binding says of it; what is wrong is reported.
    pub(super) fn access(&mut self, table: &DeTable<'_>, place: &mut Place) {
        let [certificate, print, user, password, lock] =
            [CERTIFICATE, FINGERPRINT, USER, PASSWORD, LOCK].map(|key| self.text(table, key).map(|text| (key, text)));
        let Place::Sila(server) = place else {
            for (key, (_, at)) in [certificate, print, user, password, lock].into_iter().flatten() {
                self.wrong(at, &format!("`{key}` is only for a SiLA 2 server"), "this is not one", None);
            }
            return;
        };
        match (certificate, print) {
            (Some(_), Some((_, (_, at)))) => {
                let headline = "give either the certificate or the fingerprint of a server";
                self.wrong(at, headline, "both are given", None);
            }
            (Some((_, (path, _))), None) => server.trust = SilaTrust::Certificate(path),
            (None, Some((_, (text, at)))) => match fingerprint(&text) {
                Some(digest) => server.trust = SilaTrust::Fingerprint(digest),
                None => {
                    let help =
                        "write the SHA-256 of the certificate: `openssl x509 -in FILE -noout -fingerprint -sha256`";
                    self.wrong(
                        at,
                        "a fingerprint must have 32 bytes in hexadecimal",
                        "not a fingerprint",
                        Some(help.to_owned()),
                    );
                }
            },
            (None, None) => {}
        }
        match (user, password) {
            (Some((_, (_, at))), Some(_)) if server.trust == SilaTrust::None => {
                let help = format!("add `{FINGERPRINT} = ...` or `{CERTIFICATE} = ...`");
                self.wrong(
                    at,
                    "a password cannot be sent without encryption",
                    "this server has no encryption",
                    Some(help),
                );
            }
            (Some((_, (user, _))), Some((_, (variable, _)))) => server.user = Some((user, variable)),
            (None, None) => {}
            (Some((_, (_, at))), None) => {
                let help = format!("add `{PASSWORD} = \"NAME\"` with the environment variable that holds it");
                self.wrong(at, "a user needs a password", "missing", Some(help));
            }
            (None, Some((_, (_, at)))) => self.wrong(at, "a password needs a user", "missing", None),
        }
        let Some((_, (text, at))) = lock else { return };
        match seconds(&text) {
            Some(seconds) if (SHORTEST..=LONGEST).contains(&seconds) => server.lock = Some(seconds),
            other => {
                let help =
                    "the server releases the lock after this time without a message: `lock = \"10 min\"`".to_owned();
                let headline = match other {
                    Some(_) => "a lock must last from 10 s to 168 h",
                    None => "a lock needs a duration, as in `\"10 min\"`",
                };
                self.wrong(at, headline, "not such a duration", Some(help));
            }
        }
    }
}

/// Whole seconds as they are written: `90 s`, `10 min`, `1 h`.
fn seconds(text: &str) -> Option<u64> {
    let (number, unit) = text.trim().split_once(' ')?;
    let factor = match unit.trim() {
        "s" => 1,
        "min" => 60,
        "h" => 3600,
        _ => return None,
    };
    number.parse::<u64>().ok()?.checked_mul(factor)
}
