//! What goes beside calls (part A, "SiLA Client Metadata"): the server's lock, and who is logged in.

use std::time::Duration;

use tonic::metadata::{BinaryMetadataKey, BinaryMetadataValue, MetadataMap};

use super::Client;
use crate::call::Failure;
use crate::metadata::{ACCESS, LOCK, LOGIN, STANDARD, affected, key, message};
use crate::raw::Raw;
use crate::service::IDENTIFIER as SERVICE;
use crate::text::shown;
use crate::value::{Value, decode};

/// Taking a server for oneself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lock {
    /// Who takes it: the same name takes it again.
    pub name: String,
    /// When the server lets go of it by itself, where nothing is heard of the one who took it.
    pub lapse: Duration,
}

/// Who calls.
#[derive(Clone, PartialEq, Eq)]
pub struct Login {
    /// The name of the user.
    pub user: String,
    /// Never shown.
    pub password: String,
}

impl std::fmt::Debug for Login {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Login").field("user", &self.user).finish_non_exhaustive()
    }
}

/// One thing that goes beside calls.
pub(super) struct Beside {
    key: BinaryMetadataKey,
    value: BinaryMetadataValue,
    /// Full identifiers of features, commands and properties.
    affected: Vec<String>,
}

impl Beside {
    /// Adds it where the call of this full identifier needs it.
    pub fn add(&self, called: &str, to: &mut MetadataMap) {
        let is_in =
            |of: &String| called.strip_prefix(of.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
        if self.affected.iter().any(is_in) {
            to.insert_bin(self.key.clone(), self.value.clone());
        }
    }
}

impl Client {
    /// Logs in: from here on calls say who makes them.
    pub(super) fn log_in(&mut self, login: &Login) -> Result<(), Failure> {
        let missing = || Failure::Garbled("it knows no users: leave out `user`".to_owned());
        let feature = self.standard(LOGIN).ok_or_else(missing)?;
        let service = self.standard(SERVICE).unwrap_or_default();
        let uuid = self.read(service, "ServerUUID")?;
        let command = self.features[feature].command("Login").cloned().ok_or_else(missing)?;
        let (user, password) = (Value::Text(login.user.clone()), Value::Text(login.password.clone()));
        let answered = self.carry_out(feature, &command, &[user, password, uuid, Value::List(Vec::new())])?;
        let token = answered.first().map(|(_, value)| shown(value)).unwrap_or_default();
        self.beside(ACCESS, "AccessToken", &token)
    }

    /// Takes the server for oneself, also where one has done so before.
    pub(super) fn take(&mut self, lock: &Lock) -> Result<(), Failure> {
        let missing = || Failure::Garbled("it cannot be locked: leave out `lock`".to_owned());
        let feature = self.standard(LOCK).ok_or_else(missing)?;
        let seconds = i64::try_from(lock.lapse.as_secs().max(1)).unwrap_or(i64::MAX);
        let arguments = [Value::Text(lock.name.clone()), Value::Integer(seconds)];
        let command = self.features[feature].command("LockServer").cloned().ok_or_else(missing)?;
        let locked = match self.carry_out(feature, &command, &arguments) {
            // Perhaps by an earlier connection of one's own, which nobody else can unlock.
            Err(Failure::Refused { name, .. }) if name == "ServerAlreadyLocked" => {
                self.release(&lock.name).map_err(|_| {
                    let message = "another client has locked it".to_owned();
                    Failure::Refused { name: name.clone(), message }
                })?;
                self.carry_out(feature, &command, &arguments)
            }
            other => other,
        };
        locked?;
        self.locked = Some(lock.name.clone());
        self.beside(LOCK, "LockIdentifier", &lock.name)
    }

    /// Lets others use the server.
    pub(super) fn release(&mut self, name: &str) -> Result<(), Failure> {
        let Some(feature) = self.standard(LOCK) else { return Ok(()) };
        let Some(command) = self.features[feature].command("UnlockServer").cloned() else { return Ok(()) };
        self.carry_out(feature, &command, &[Value::Text(name.to_owned())]).map(|_| ())
    }

    /// The place of a feature of the standard that the server has.
    fn standard(&self, identifier: &str) -> Option<usize> {
        self.features.iter().position(|f| f.identifier == identifier && f.originator == STANDARD)
    }

    /// From here on a text goes beside all calls that the server says it belongs to.
    fn beside(&mut self, feature: &str, name: &str, text: &str) -> Result<(), Failure> {
        let missing = || Failure::Garbled(format!("it offers no `{feature}` with the metadata `{name}`"));
        let index = self.standard(feature).ok_or_else(missing)?;
        let of = &self.features[index];
        of.metadata.iter().find(|m| m.element.identifier == name).ok_or_else(missing)?;
        let key = BinaryMetadataKey::from_bytes(key(&of.id(), name).as_bytes());
        let key = key.map_err(|e| Failure::Garbled(e.to_string()))?;
        let answer: Raw = self.unary(index, &format!("Get_FCPAffectedByMetadata_{name}"), Raw::default())?;
        let calls = decode(&self.features[index], &[affected()], &answer).map_err(Failure::Garbled)?;
        let affected = match calls.into_iter().next() {
            Some(Value::List(all)) => all.iter().map(shown).collect(),
            _ => Vec::new(),
        };
        self.beside.push(Beside { key, value: BinaryMetadataValue::from_bytes(&message(text)), affected });
        Ok(())
    }
}
