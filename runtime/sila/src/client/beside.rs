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
    /// Whether it is the lock's.
    is_lock: bool,
}

impl Beside {
    /// Whether a call of this full identifier needs it.
    fn is_of(&self, called: &str) -> bool {
        let is_in =
            |of: &String| called.strip_prefix(of.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
        self.affected.iter().any(is_in)
    }

    /// Adds it where the call of this full identifier needs it; whether it is the lock's and has been added.
    pub fn add(&self, called: &str, to: &mut MetadataMap) -> bool {
        if self.is_of(called) {
            to.insert_bin(self.key.clone(), self.value.clone());
        }
        self.is_lock && self.is_of(called)
    }
}

impl Client {
    /// Logs in: from here on calls say who makes them.
    pub(super) fn log_in(&mut self, login: &Login) -> Result<(), Failure> {
        let missing = || Failure::Garbled("it has no users: remove `user`".to_owned());
        let feature = self.standard(LOGIN).ok_or_else(missing)?;
        let service = self.standard(SERVICE).unwrap_or_default();
        let uuid = self.read(service, "ServerUUID")?;
        let command = self.features[feature].command("Login").cloned().ok_or_else(missing)?;
        let (user, password) = (Value::Text(login.user.clone()), Value::Text(login.password.clone()));
        let answered = self.carry_out(feature, &command, &[user, password, uuid, Value::List(Vec::new())])?;
        let token = answered.first().map(|(_, value)| shown(value)).unwrap_or_default();
        self.is_known = true;
        self.beside(ACCESS, "AccessToken", &token)
    }

    /// Takes the server for oneself, also where one has done so before.
    pub(super) fn take(&mut self, lock: &Lock) -> Result<(), Failure> {
        let missing = || Failure::Garbled("it cannot be locked: remove `lock`".to_owned());
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
        (self.lapse, self.heard) = (Some(lock.lapse), super::now());
        self.beside(LOCK, "LockIdentifier", &lock.name)
    }

    /// Lets others use the server.
    pub(super) fn release(&mut self, name: &str) -> Result<(), Failure> {
        let Some(feature) = self.standard(LOCK) else { return Ok(()) };
        let Some(command) = self.features[feature].command("UnlockServer").cloned() else { return Ok(()) };
        self.carry_out(feature, &command, &[Value::Text(name.to_owned())]).map(|_| ())
    }

    /// Fails where calls of the feature that is meant need something beside them that nobody gives.
    pub fn lacks_nothing(&mut self) -> Result<(), Failure> {
        let main = self.features[0].id();
        for index in 0..self.features.len() {
            let feature = &self.features[index];
            let (id, own) = (feature.id(), feature.originator == STANDARD);
            let is_given = own && (feature.identifier == LOCK || feature.identifier == ACCESS && self.is_known);
            if is_given {
                continue;
            }
            let names: Vec<String> = feature.metadata.iter().map(|m| m.element.identifier.clone()).collect();
            for name in names {
                let affected = self.affected(index, &name)?;
                let is_in = |of: &String| {
                    of.strip_prefix(main.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
                };
                if !affected.iter().any(is_in) {
                    continue;
                }
                let how = match own && id.contains(ACCESS) {
                    true => "it needs a login: add `user` and `password_env`".to_owned(),
                    false => format!("its calls need the metadata `{name}` of `{id}`, which is not supported"),
                };
                return Err(Failure::Garbled(how));
            }
        }
        Ok(())
    }

    /// The full identifiers of what a metadata goes beside.
    fn affected(&mut self, index: usize, name: &str) -> Result<Vec<String>, Failure> {
        let answer: Raw = self.unary(index, &format!("Get_FCPAffectedByMetadata_{name}"), Raw::default())?;
        let calls = decode(&self.features[index], &[affected()], &answer).map_err(Failure::Garbled)?;
        Ok(match calls.into_iter().next() {
            Some(Value::List(all)) => all.iter().map(shown).collect(),
            _ => Vec::new(),
        })
    }

    /// Whether the server would soon let go of the lock, as nothing was heard.
    pub fn lapses_soon(&self) -> bool {
        self.lapse.is_some_and(|lapse| self.heard.elapsed() > lapse / 3)
    }

    /// Lets the server hear that the one who has locked it is there.
    pub fn hold(&mut self) -> Result<(), Failure> {
        let main = self.features[0].id();
        let asked = (0..self.features.len()).find_map(|index| {
            let feature = &self.features[index];
            let affected = |id: &str| self.beside.iter().any(|b| b.is_lock && b.is_of(&format!("{id}/Property/")));
            let property = feature.properties.iter().min_by_key(|p| p.observable)?;
            affected(&feature.id()).then(|| (index, property.identifier.clone()))
        });
        let Some((index, property)) = asked else {
            self.lapse = None;
            let why = format!(
                "`{main}` has no property that keeps the lock alive: give `lock` a longer time than the run takes"
            );
            return Err(Failure::Garbled(why));
        };
        match self.read(index, &property) {
            // Who is told no has been heard.
            Ok(_) | Err(Failure::Garbled(_)) => Ok(()),
            Err(Failure::Refused { name, message }) if name.contains("Lock") || name == "InvalidMetadata" => {
                Err(Failure::Lost(format!("the lock was lost: it replied `{name}`: {message}")))
            }
            Err(Failure::Refused { .. }) => Ok(()),
            Err(lost) => Err(lost),
        }
    }

    /// The place of a feature of the standard that the server has.
    fn standard(&self, identifier: &str) -> Option<usize> {
        self.features.iter().position(|f| f.identifier == identifier && f.originator == STANDARD)
    }

    /// From here on a text goes beside all calls that the server says it belongs to.
    fn beside(&mut self, feature: &str, name: &str, text: &str) -> Result<(), Failure> {
        let missing = || Failure::Garbled(format!("it has no `{feature}` with the metadata `{name}`"));
        let index = self.standard(feature).ok_or_else(missing)?;
        let of = &self.features[index];
        of.metadata.iter().find(|m| m.element.identifier == name).ok_or_else(missing)?;
        let key = BinaryMetadataKey::from_bytes(key(&of.id(), name).as_bytes());
        let key = key.map_err(|e| Failure::Garbled(e.to_string()))?;
        let (affected, is_lock) = (self.affected(index, name)?, feature == LOCK);
        let value = BinaryMetadataValue::from_bytes(&message(text));
        self.beside.push(Beside { key, value, affected, is_lock });
        Ok(())
    }
}
