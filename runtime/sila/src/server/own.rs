//! What is answered without the lab: the features of the standard that every server has.

use std::sync::{Arc, PoisonError};

use matterix_sila::Feature;
use tonic::Status;

use super::answer::{Answers, Meant, told};
use super::{cancel, guard};
use crate::call::{Failure, status};
use crate::framework::{Fully, Kind};
use crate::metadata::{ACCESS, LOCK, LOGIN, STANDARD, affected};
use crate::raw::Raw;
use crate::service::{IDENTIFIER as SERVICE, UNIMPLEMENTED};
use crate::text::shown;
use crate::value::{Value, encode};

/// Longest name of a server, characters (part A, `SetServerName`).
const LONGEST_NAME: usize = 255;

impl Answers {
    /// Whether a call of a feature of the standard needs what the lab's features need: those that change something for others.
    pub(super) fn is_guarded(&self, feature: &Feature, meant: &Meant) -> bool {
        matches!((feature.identifier.as_str(), meant), (LOCK | cancel::IDENTIFIER, Meant::Command(..)))
    }

    /// The full identifiers of what a feature's metadata goes beside.
    pub(super) fn affected(&self, f: usize) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let goes_beside = |other: &&Feature| match (other.originator.as_str(), other.identifier.as_str()) {
            (STANDARD, LOCK) => feature.identifier == ACCESS,
            (STANDARD, cancel::IDENTIFIER) => true,
            (originator, _) => originator != STANDARD,
        };
        // Whether a server is locked may everybody ask.
        let named = |other: &Feature| match other.identifier.as_str() {
            LOCK if other.originator == STANDARD => {
                other.commands.iter().map(|c| format!("{}/Command/{}", other.id(), c.identifier)).collect()
            }
            _ => vec![other.id()],
        };
        let all = self.features.iter().filter(goes_beside).flat_map(named).map(Value::Text).collect();
        encode(feature, &[affected()], &[Value::List(all)]).map_err(Status::internal)
    }

    /// What a server says of itself.
    pub(super) fn own_property(&self, f: usize, p: usize) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let about = self.about.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let text = match feature.properties[p].identifier.as_str() {
            "IsLocked" => return told(feature, p, Value::Boolean(self.guard.is_taken())),
            "ServerName" => about.name,
            "ServerType" => "Matterixc".to_owned(),
            "ServerUUID" => about.uuid,
            "ServerDescription" => about.description,
            "ServerVersion" => about.version,
            "ServerVendorURL" => "https://matterixc.invalid".to_owned(),
            _ => {
                let all = self.features.iter().map(|f| Value::Text(f.id())).collect();
                return told(feature, p, Value::List(all));
            }
        };
        told(feature, p, Value::Text(text))
    }

    /// Carries out a command of a feature of the standard.
    pub(super) async fn own_command(self: Arc<Self>, f: usize, c: usize, raw: Raw) -> Result<Raw, Status> {
        let feature = &self.features[f];
        let command = &feature.commands[c];
        let path = format!("Command/{}", command.identifier);
        let arguments = self.arguments(f, &command.parameters, &path, &raw)?;
        let text = |at: usize| arguments.get(at).map(shown).unwrap_or_default();
        let answered = match (feature.identifier.as_str(), command.identifier.as_str()) {
            (SERVICE, "SetServerName") => {
                let name = text(0);
                if name.chars().count() > LONGEST_NAME {
                    let identifier = format!("{}/{path}/Parameter/ServerName", feature.id());
                    let message = format!("a name may have at most {LONGEST_NAME} characters");
                    return Err(status(Kind::Validation(Fully { identifier, message })));
                }
                self.about.lock().unwrap_or_else(PoisonError::into_inner).name = name;
                Vec::new()
            }
            (SERVICE, _) => vec![self.definition(feature, &text(0))?],
            (cancel::IDENTIFIER, _) => {
                self.cancel(feature, arguments.first().map(shown).as_deref())?;
                Vec::new()
            }
            (LOCK, "LockServer") => {
                let lapse = match arguments.get(1) {
                    Some(Value::Integer(seconds)) => *seconds,
                    _ => 0,
                };
                self.guard.take(text(0), lapse)?;
                Vec::new()
            }
            (LOCK, _) => {
                self.guard.release(&text(0))?;
                Vec::new()
            }
            (LOGIN, "Login") => {
                let (token, lifetime) = Arc::clone(&self).log_in(&arguments).await?;
                vec![Value::Text(token), Value::Integer(lifetime)]
            }
            (LOGIN, _) => {
                self.guard.log_out(&text(0))?;
                Vec::new()
            }
            _ => return Err(Status::unimplemented("unknown call")),
        };
        encode(feature, &command.responses, &answered).map_err(Status::internal)
    }

    fn definition(&self, feature: &Feature, wanted: &str) -> Result<Value, Status> {
        let Some(asked) = self.features.iter().find(|f| f.id() == wanted) else {
            let message = format!("this server has no `{wanted}`");
            let failure = Failure::Refused { name: UNIMPLEMENTED.to_owned(), message };
            return Err(failure.status(&feature.id()));
        };
        Ok(Value::Text(matterix_sila::write(asked)))
    }

    /// Breaks off a command that goes on, or all.
    fn cancel(&self, feature: &Feature, named: Option<&str>) -> Result<(), Status> {
        if !self.executions.cancel(named)
            && let Some(name) = named
        {
            let message = format!("no command with the execution `{name}` is running");
            return Err(Failure::Refused { name: cancel::UNKNOWN.to_owned(), message }.status(&feature.id()));
        }
        Ok(())
    }

    async fn log_in(self: Arc<Self>, arguments: &[Value]) -> Result<(String, i64), Status> {
        let [user, password, server, features] = arguments else {
            return Err(Status::internal("a login needs four parameters"));
        };
        let features = match features {
            Value::List(all) => all.iter().map(shown).collect(),
            _ => Vec::new(),
        };
        let own = self.about.lock().unwrap_or_else(PoisonError::into_inner).uuid == shown(server);
        if !own {
            return Err(guard::error(LOGIN, "AuthenticationFailed", "the login is for another server"));
        }
        let (user, password) = (shown(user), shown(password));
        // Passwords are dear to check on purpose; others are answered meanwhile.
        let judged = tokio::task::spawn_blocking(move || self.guard.log_in(&user, &password, features)).await;
        judged.unwrap_or_else(|e| Err(Status::internal(e.to_string())))
    }
}
