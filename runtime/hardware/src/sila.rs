//! Devices that are servers of SiLA 2: what a driver says is a call, what it asks a property or what a command answered.

use std::time::Duration;

use matterix_ir::wire::{Driver, Pattern, Told, Until};
use matterix_sila::form::{difference, form, unpacked};
use matterix_sila_wire::tls::Trust;
use matterix_sila_wire::{Access, Client, Failure, Lock, Login, Said, discovery, is_of};

use crate::link::{DeviceError, Line, WireTap, forms, showable};
use crate::pattern::{matched, written};
use crate::place::{SilaServer, SilaTrust, is_uuid};
use crate::template;

/// A server that is connected.
pub struct Server(Client);

impl Server {
    /// Connects to a server, which must offer the feature, by the definition that the driver was made from if it was made from one.
    pub fn connect(
        server: &SilaServer,
        feature: &str,
        definition: Option<&str>,
        timeout: f64,
    ) -> Result<Server, DeviceError> {
        let timeout = Duration::try_from_secs_f64(timeout)
            .ok()
            .filter(|t| !t.is_zero())
            .ok_or_else(|| DeviceError::Lost("the timeout is not a duration".to_owned()))?;
        let mut access = access(server).map_err(DeviceError::Unsaid)?;
        let mut failed = None;
        for address in addresses(server, timeout).map_err(DeviceError::Lost)? {
            access.address = address;
            match Client::connect(&access, feature, timeout) {
                Ok(mut client) => {
                    client.lacks_nothing().map_err(|failure| match failure {
                        Failure::Lost(why) => DeviceError::Lost(why),
                        Failure::Garbled(why) => DeviceError::Garbled(why),
                        Failure::Refused { name, message } => {
                            DeviceError::Garbled(format!("it replied `{name}`: {message}"))
                        }
                    })?;
                    let promised = definition.and_then(unpacked).unwrap_or_default();
                    return match difference(&promised, &form(client.feature())) {
                        None => Ok(Server(client)),
                        Some(how) => Err(DeviceError::Garbled(format!("its `{feature}` differs: {how}"))),
                    };
                }
                // It may be reached by another of its addresses.
                Err(Failure::Lost(why)) => failed = failed.or(Some(why)),
                Err(Failure::Refused { name, message }) => {
                    return Err(DeviceError::Garbled(format!("it replied `{name}`: {message}")));
                }
                Err(Failure::Garbled(why)) => return Err(DeviceError::Garbled(why)),
            }
        }
        let missing = || format!("the network has no server with the UUID `{}`", server.at);
        Err(DeviceError::Lost(failed.unwrap_or_else(missing)))
    }
}

/// Where a server is, as said or as it says to the network.
fn addresses(server: &SilaServer, timeout: Duration) -> Result<Vec<String>, String> {
    if !is_uuid(&server.at) {
        return Ok(vec![server.at.clone()]);
    }
    let found = discovery::look(timeout, Some(&server.at.to_lowercase()))?;
    Ok(found.iter().flat_map(|f| &f.addresses).map(ToString::to_string).collect())
}

fn access(server: &SilaServer) -> Result<Access, String> {
    let trust = match &server.trust {
        SilaTrust::None => Trust::Plain,
        SilaTrust::Fingerprint(digest) => Trust::Fingerprint(*digest),
        SilaTrust::Certificate(path) => {
            let read = std::fs::read_to_string(path);
            let text = read.map_err(|e| format!("its `certificate = \"{path}\"` cannot be read: {e}"))?;
            if !text.contains("BEGIN CERTIFICATE") {
                return Err(format!("its `certificate = \"{path}\"` holds no certificate in PEM"));
            }
            Trust::Certificates(text)
        }
    };
    let login = server.user.as_ref().map(|(user, variable)| {
        let password = std::env::var(variable);
        let password =
            password.map_err(|_| format!("the environment variable `{variable}` of `password_env` is not set"));
        Ok::<_, String>(Login { user: user.clone(), password: password? })
    });
    let lock = server.lock.map(|seconds| Lock { name: who(), lapse: Duration::from_secs(seconds) });
    Ok(Access { address: String::new(), trust, login: login.transpose()?, lock })
}

/// Who takes a server for themselves: the same after a restart, so that what a process that was killed has taken can be used again.
fn who() -> String {
    let user = std::env::var("USER").or_else(|_| std::env::var("LOGNAME")).unwrap_or_else(|_| "somebody".to_owned());
    format!("matterixc {user}@{}", rustix::system::uname().nodename().to_string_lossy())
}

/// What went wrong as what the driver calls it.
fn trouble(failure: Failure, driver: &Driver, ear: &mut dyn WireTap) -> DeviceError {
    match failure {
        Failure::Lost(why) => DeviceError::Lost(why),
        Failure::Garbled(why) => DeviceError::Garbled(why),
        Failure::Refused { name, message } => {
            ear.back(format!("{name}: {message}").as_bytes());
            let named = driver.refusals.iter().find(|r| matched(&r.reply, &name).is_some());
            let failure = named.map_or_else(|| "refused".to_owned(), |named| named.failure.clone());
            DeviceError::Refused { failure, text: format!("it replied `{name}`: {message}") }
        }
    }
}

/// Whether a command goes on after it was said, because its line says how its end is known.
fn goes_on(driver: &Driver, text: &str) -> bool {
    let all = driver.calls.iter().map(|(_, e)| e).chain(driver.served.iter().map(|s| &s.exchange)).chain(&driver.open);
    let mut asked = all.filter_map(|e| e.until.as_ref()).filter(|u| u.expects.is_none());
    asked.any(|u| is_of(text, &template::written(&u.asks)))
}

fn understood(asked: &str, reply: &str, expects: &Pattern) -> Result<Vec<f64>, DeviceError> {
    matched(expects, reply)
        .ok_or_else(|| DeviceError::Garbled(format!("it replied `{reply}` to `{asked}`, not `{}`", written(expects))))
}

impl Line for Server {
    fn say(
        &mut self,
        texts: &[String],
        expects: Option<&Pattern>,
        driver: &Driver,
        ear: &mut dyn WireTap,
    ) -> Result<Vec<f64>, DeviceError> {
        let mut numbers = Vec::new();
        self.0.wait_at_most(ear.patience());
        for (place, text) in texts.iter().enumerate() {
            let said = self.0.understood(text);
            // A file may be another one later: what is kept of a run says which one it was.
            let bytes = said.as_ref().map(Said::bytes).unwrap_or_default();
            ear.out([vec![text.clone()], bytes].concat().join(", ").as_bytes());
            let reply = said.and_then(|said| self.0.send(&said, !goes_on(driver, text)));
            let reply = reply.map_err(|f| trouble(f, driver, ear))?;
            ear.back(reply.as_bytes());
            if let Some(expects) = expects {
                numbers = understood(text, &reply, expects.of(place))?;
            }
        }
        Ok(numbers)
    }

    fn is_to_be_held(&self) -> bool {
        self.0.lapses_soon()
    }

    fn hold(&mut self, driver: &Driver, ear: &mut dyn WireTap) -> Result<(), DeviceError> {
        self.0.wait_at_most(ear.patience());
        self.0.hold().map_err(|f| trouble(f, driver, ear))
    }

    fn judge(&self, text: &str) -> Result<(), String> {
        match self.0.understood(text) {
            Err(Failure::Garbled(why)) => Err(why),
            _ => Ok(()),
        }
    }

    fn judge_question(&self, text: &str) -> Result<(), String> {
        self.0.answers(text)
    }

    fn ask(&mut self, text: &str, told: &Told, driver: &Driver, ear: &mut dyn WireTap) -> Result<f64, DeviceError> {
        self.0.wait_at_most(ear.patience());
        ear.out(text.as_bytes());
        let reply = self.0.ask(text).map_err(|f| trouble(f, driver, ear))?;
        ear.back(reply.as_bytes());
        let found = told.forms().find_map(|(form, shows)| Some((matched(form, &reply)?, form, shows)));
        let Some((numbers, form, shows)) = found else {
            return Err(DeviceError::Garbled(format!("it replied `{reply}` to `{text}`, not `{}`", forms(told))));
        };
        showable(told, &numbers, form, shows)
    }

    fn is_ready(
        &mut self,
        text: &str,
        until: &Until,
        driver: &Driver,
        ear: &mut dyn WireTap,
    ) -> Result<bool, DeviceError> {
        self.0.wait_at_most(ear.patience());
        let Some(expects) = &until.expects else {
            return self.0.is_done(text).map_err(|f| trouble(f, driver, ear));
        };
        ear.out(text.as_bytes());
        let reply = self.0.ask(text).map_err(|f| trouble(f, driver, ear))?;
        ear.back(reply.as_bytes());
        Ok(matched(expects, &reply).is_some())
    }
}
