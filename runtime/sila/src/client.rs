//! A client: commands and properties of one server, by the features that it says it has. It blocks.

mod beside;
mod bytes;
mod dial;
mod given;
mod wire;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use matterix_sila::feature::{Command, Element, Feature};
use tokio::runtime::{Builder, Runtime};
use tonic::Streaming;
use tonic::client::Grpc;
use tonic::transport::{Channel, Endpoint};

use crate::call::Failure;
use crate::framework::{Confirmation, Execution, Info, Stage};
use crate::raw::Raw;
use crate::service;
use crate::text::{self, Call, named, shown};
use crate::tls::Trust;
use crate::value::{Value, decode, encode};
use beside::Beside;
pub use beside::{Lock, Login};
use dial::Dial;
use given::arguments;
pub use given::is_of;
use wire::{Latest, source, within};

/// Longest time in which news of an execution is waited for when it is only looked at.
const GLANCE: Duration = Duration::from_millis(20);

/// How often a server is asked for something while a command goes on of which nothing is heard. Pings of HTTP/2 would do,
/// but servers of gRPC turn those away who send more than one in some minutes.
const WATCH: Duration = Duration::from_secs(5);

/// Longest wait for the answer to a farewell.
const FAREWELL: Duration = Duration::from_secs(2);

/// A command that goes on.
struct Running {
    execution: Execution,
    news: Streaming<Info>,
    told: Option<Latest>,
}

/// A command with its arguments.
pub struct Said {
    /// The place of its feature.
    index: usize,
    command: Command,
    arguments: Vec<Value>,
}

impl Said {
    /// The bytes among its arguments, each by its number and SHA-256 under the name of its parameter.
    pub fn bytes(&self) -> Vec<String> {
        let given = self.command.parameters.iter().zip(&self.arguments);
        let given = given.filter(|(_, value)| value.holds_bytes());
        given.map(|(parameter, value)| format!("{}: {}", parameter.identifier, shown(value))).collect()
    }
}

/// How a server is spoken to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Access {
    /// `HOST:PORT`.
    pub address: String,
    /// Whether it is the right one.
    pub trust: Trust,
    /// Who calls, where the server asks for that.
    pub login: Option<Login>,
    /// How it is taken for oneself, if it is.
    pub lock: Option<Lock>,
}

/// A server that is connected.
pub struct Client {
    runtime: Runtime,
    grpc: Grpc<Channel>,
    timeout: Duration,
    /// As it was given.
    usual: Duration,
    /// The one that is meant where a text names none goes first.
    features: Vec<Feature>,
    running: BTreeMap<(usize, String), Running>,
    /// What commands answered last, and told while they went on.
    last: BTreeMap<(usize, String), Vec<(String, Value)>>,
    /// When it was last asked whether it is there.
    seen: Instant,
    /// What goes beside calls.
    beside: Vec<Beside>,
    /// The name by which it was taken for oneself.
    locked: Option<String>,
    /// When it lets go by itself, and when it heard from the one who has taken it last.
    lapse: Option<Duration>,
    heard: Instant,
    /// Whether it knows who calls.
    is_known: bool,
}

impl Drop for Client {
    /// Others may have it again. One that does not hear this lets go by itself.
    fn drop(&mut self) {
        if let Some(name) = self.locked.take() {
            self.timeout = self.timeout.min(FAREWELL);
            let _ = self.release(&name);
        }
    }
}

impl Client {
    /// A connection to a server that must offer this feature; no call lasts longer than `timeout`.
    pub fn connect(access: &Access, feature: &str, timeout: Duration) -> Result<Client, Failure> {
        let lost = |why: String| Failure::Lost(format!("cannot connect to `{}`: {why}", access.address));
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.map_err(|e| lost(e.to_string()))?;
        let dial = Dial::new(&access.address, &access.trust).map_err(Failure::Garbled)?;
        let endpoint = Endpoint::from_shared(dial.uri()).map_err(|e| lost(e.to_string()))?;
        let channel = within(&runtime, timeout, endpoint.connect_with_connector(dial.clone()));
        let channel = channel.ok_or_else(|| lost("it did not answer in time".to_owned()))?;
        let channel = channel.map_err(|e| match dial.distrusted() {
            Some(shown) => Failure::Garbled(format!(
                "the server at `{}` is not trusted: its certificate has the fingerprint {shown}",
                access.address
            )),
            None if access.trust != Trust::Plain && dial::is_plain(&e) => {
                lost(format!("it does not use TLS ({}): remove its certificate or fingerprint", source(&e)))
            }
            None => lost(source(&e)),
        });
        let mut client = Client {
            runtime,
            grpc: Grpc::new(channel?).max_decoding_message_size(16 << 20),
            timeout,
            usual: timeout,
            features: vec![service::feature()],
            running: BTreeMap::new(),
            last: BTreeMap::new(),
            seen: now(),
            beside: Vec::new(),
            locked: None,
            lapse: None,
            heard: now(),
            is_known: false,
        };
        match client.learn(feature) {
            // Servers that speak TLS hang up on those who do not.
            Err(Failure::Lost(why)) if access.trust == Trust::Plain => {
                let named = dial::encrypted(&client.runtime, &access.address, timeout);
                return Err(named.unwrap_or(Failure::Lost(why)));
            }
            other => other?,
        }
        access.login.iter().try_for_each(|login| client.log_in(login))?;
        access.lock.iter().try_for_each(|lock| client.take(lock))?;
        Ok(client)
    }

    /// Asks what the server offers; the feature that is meant must be there.
    fn learn(&mut self, feature: &str) -> Result<(), Failure> {
        let offered = self.read(0, "ImplementedFeatures")?;
        let offered: Vec<String> = match offered {
            Value::List(list) => list.iter().map(shown).collect(),
            other => vec![shown(&other)],
        };
        if !offered.iter().any(|o| o == feature) {
            let list: Vec<String> = offered.iter().map(|o| format!("`{o}`")).collect();
            return Err(Failure::Garbled(format!("it does not offer `{feature}`, but {}", list.join(", "))));
        }
        let main = self.fetch(feature)?;
        self.features.insert(0, main);
        let own = service::feature().id();
        for other in offered.iter().filter(|o| *o != feature && **o != own) {
            // What cannot be read is not spoken to.
            if let Ok(read) = self.fetch(other) {
                self.features.push(read);
            }
        }
        Ok(())
    }

    /// From here on no call lasts longer than this, where that is less than was given.
    pub fn wait_at_most(&mut self, time: Option<Duration>) {
        self.timeout = time.map_or(self.usual, |time| time.min(self.usual));
    }

    /// The feature that is meant where a text names none.
    pub fn feature(&self) -> &Feature {
        &self.features[0]
    }

    fn fetch(&mut self, id: &str) -> Result<Feature, Failure> {
        let service = self.features.iter().position(|f| f.identifier == service::IDENTIFIER).unwrap_or(0);
        let command = self.features[service].command("GetFeatureDefinition").cloned().unwrap_or_default();
        let answered = self.carry_out(service, &command, &[Value::Text(id.to_owned())])?;
        let text = answered.first().map(|(_, v)| shown(v)).unwrap_or_default();
        matterix_sila::read(&text).map_err(|p| Failure::Garbled(format!("its feature `{id}` cannot be read: {p}")))
    }

    /// A command as it would be sent: the files that it names are read.
    pub fn understood(&self, said: &str) -> Result<Said, Failure> {
        let call = text::call(said).map_err(Failure::Garbled)?;
        let (index, name) = self.place(&call).map_err(Failure::Garbled)?;
        let feature = &self.features[index];
        let Some(command) = feature.command(&name).cloned() else {
            let known: Vec<String> = feature.commands.iter().map(|c| format!("`{}`", c.identifier)).collect();
            let (id, list) = (feature.id(), known.join(", "));
            return Err(Failure::Garbled(format!("`{id}` has no command `{name}`; it has {list}")));
        };
        let arguments = arguments(feature, &command, &call).map_err(Failure::Garbled)?;
        Ok(Said { index, command, arguments })
    }

    /// Says a command; what it answers. One that lasts has only begun, unless it is `waited` for.
    pub fn say(&mut self, said: &str, waited: bool) -> Result<String, Failure> {
        let said = self.understood(said)?;
        self.send(&said, waited)
    }

    /// As [`Client::say`] says it.
    pub fn send(&mut self, said: &Said, waited: bool) -> Result<String, Failure> {
        let Said { index, command, arguments } = said;
        let (index, key) = (*index, (*index, command.identifier.clone()));
        if !command.observable {
            let answered = self.carry_out(index, command, arguments)?;
            let text = named(&answered);
            self.last.insert(key, answered);
            return Ok(text);
        }
        self.begin(index, command, arguments)?;
        if !waited {
            return Ok(String::new());
        }
        let late = Failure::Lost(format!("`{}` did not end within {} s", key.1, self.timeout.as_secs_f64()));
        if let Some(running) = self.running.get_mut(&key) {
            let ended = within(&self.runtime, self.timeout, async {
                while let Some(info) = running.news.message().await? {
                    if has_ended(&info) {
                        break;
                    }
                }
                Ok::<(), tonic::Status>(())
            });
            if let Some(failure) = ended.map_or(Some(late), |end| end.err().map(|s| Failure::of(&s))) {
                self.running.remove(&key);
                return Err(failure);
            }
        }
        self.end(&key, command)?;
        Ok(self.last.get(&key).map(|answered| named(answered)).unwrap_or_default())
    }

    /// Whether a command that was begun has ended; its failure, if that is how.
    pub fn is_done(&mut self, asked: &str) -> Result<bool, Failure> {
        let call = text::call(asked).map_err(Failure::Garbled)?;
        let key = self.place(&call).map_err(Failure::Garbled)?;
        let Some(command) = self.features[key.0].command(&key.1).cloned() else {
            return Err(Failure::Garbled(format!("`{asked}` is not a command")));
        };
        let Some(running) = self.running.get_mut(&key) else {
            return match self.last.contains_key(&key) {
                true => Ok(true),
                false => Err(Failure::Garbled(format!(
                    "`{}` was not started over this connection: its end is unknown",
                    key.1
                ))),
            };
        };
        loop {
            match within(&self.runtime, GLANCE, running.news.message()) {
                // A server that is gone without a word is missed when it is asked for something.
                None => return self.is_there().map(|()| false),
                Some(Ok(Some(info))) if !has_ended(&info) => {}
                Some(Ok(_)) => break,
                Some(Err(status)) => {
                    self.running.remove(&key);
                    return Err(Failure::of(&status));
                }
            }
        }
        self.end(&key, &command).map(|()| true)
    }

    /// Asks now and then for something that every server knows.
    fn is_there(&mut self) -> Result<(), Failure> {
        if self.seen.elapsed() < WATCH {
            return Ok(());
        }
        self.seen = now();
        let service = self.features.iter().position(|f| f.identifier == service::IDENTIFIER).unwrap_or(0);
        self.read(service, "ServerUUID").map(|_| ())
    }

    /// Asks for a property, or for what a command told or answered last: `HoldTemperature.FinalTemperature`.
    pub fn ask(&mut self, asked: &str) -> Result<String, Failure> {
        let call = text::call(asked).map_err(Failure::Garbled)?;
        if let [command, response] = call.path.as_slice()
            && self.features[0].command(command).is_some()
        {
            let key = (0, command.clone());
            let tells = self.features[0]
                .command(command)
                .is_some_and(|c| c.intermediate.iter().any(|e| e.identifier == *response));
            let asked = now();
            loop {
                self.glance(&key)?;
                let known = self.last.get(&key).into_iter().flatten().find(|(name, _)| name == response);
                if let Some((_, value)) = known {
                    return Ok(shown(value));
                }
                // The first news of a command come when the server has them.
                if !(tells && self.running.contains_key(&key)) || asked.elapsed() >= self.timeout {
                    return Err(Failure::Garbled(format!("`{command}` did not return `{response}`")));
                }
                std::thread::sleep(GLANCE);
            }
        }
        let (index, name) = self.place(&call).map_err(Failure::Garbled)?;
        self.read(index, &name).map(|value| shown(&value))
    }

    /// Whether there is what a text asks for; why not.
    pub fn answers(&self, asked: &str) -> Result<(), String> {
        let call = text::call(asked)?;
        let responses = |c: &Command| c.responses.iter().chain(&c.intermediate).map(|e| e.identifier.clone()).collect();
        let (of, known, name): (String, Vec<String>, &str) = match call.path.as_slice() {
            [command, response] if self.features[0].command(command).is_some() => {
                let known = self.features[0].command(command).map(responses).unwrap_or_default();
                (format!("the command `{command}` replied no"), known, response)
            }
            _ => {
                let (index, _) = self.place(&call)?;
                let feature = &self.features[index];
                let known = feature.properties.iter().map(|p| p.identifier.clone()).collect();
                let name = call.path.last().map(String::as_str).unwrap_or_default();
                (format!("`{}` has no property", feature.id()), known, name)
            }
        };
        match known.iter().any(|known| known == name) {
            true => Ok(()),
            false => {
                let list: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
                Err(format!("{of} `{name}`; it has {}", list.join(", ")))
            }
        }
    }

    /// The feature and the name in it that a text means.
    fn place(&self, call: &Call) -> Result<(usize, String), String> {
        match call.path.as_slice() {
            [name] => Ok((0, name.clone())),
            [feature, name] => {
                let found = self.features.iter().position(|f| f.identifier == *feature);
                let found = found.ok_or_else(|| format!("it offers no feature `{feature}`"))?;
                Ok((found, name.clone()))
            }
            _ => Err("the name is empty".to_owned()),
        }
    }

    fn read(&mut self, index: usize, name: &str) -> Result<Value, Failure> {
        let feature = &self.features[index];
        let Some(property) = feature.property(name).cloned() else {
            return Err(Failure::Garbled(format!("`{}` has no property `{name}`", feature.id())));
        };
        let raw: Raw = if property.observable {
            let mut all = self.stream(index, &format!("Subscribe_{name}"), Raw::default())?;
            let first = within(&self.runtime, self.timeout, all.message()).ok_or_else(|| self.silent(name))?;
            first.map_err(|s| Failure::of(&s))?.ok_or_else(|| Failure::Garbled(format!("`{name}` returned nothing")))?
        } else {
            self.unary(index, &format!("Get_{name}"), Raw::default())?
        };
        let told = Element {
            identifier: property.identifier,
            display: String::new(),
            description: String::new(),
            ty: property.ty,
        };
        let values = self.answered(index, std::slice::from_ref(&told), &raw)?;
        let value = values.into_iter().next().map(|(_, value)| value);
        value.ok_or_else(|| Failure::Garbled(format!("`{name}` returned nothing")))
    }

    /// A command that does not last, from its beginning to its end.
    fn carry_out(
        &mut self,
        index: usize,
        command: &Command,
        values: &[Value],
    ) -> Result<Vec<(String, Value)>, Failure> {
        let raw = self.given(index, command, values)?;
        let answer: Raw = self.unary(index, &command.identifier, raw)?;
        self.answered(index, &command.responses, &answer)
    }

    /// The arguments of a command as a message; long bytes are sent before it.
    fn given(&mut self, index: usize, command: &Command, values: &[Value]) -> Result<Raw, Failure> {
        let of = format!("{}/Command/{}/Parameter", self.features[index].id(), command.identifier);
        let given = command.parameters.iter().zip(values);
        let given: Result<Vec<Value>, Failure> =
            given.map(|(parameter, value)| self.sent(value, &format!("{of}/{}", parameter.identifier))).collect();
        encode(&self.features[index], &command.parameters, &given?).map_err(Failure::Garbled)
    }

    /// The values of a message, by their names; long bytes are fetched.
    fn answered(&mut self, index: usize, elements: &[Element], raw: &Raw) -> Result<Vec<(String, Value)>, Failure> {
        let values = decode(&self.features[index], elements, raw).map_err(Failure::Garbled)?;
        let names = elements.iter().map(|e| e.identifier.clone());
        names.zip(values).map(|(name, value)| Ok((name, self.fetched(value)?))).collect()
    }

    fn begin(&mut self, index: usize, command: &Command, values: &[Value]) -> Result<(), Failure> {
        let raw = self.given(index, command, values)?;
        let confirmed: Confirmation = self.unary(index, &command.identifier, raw)?;
        let execution = confirmed.execution.ok_or_else(|| Failure::Garbled("the reply has no execution".to_owned()))?;
        let news = self.stream(index, &format!("{}_Info", command.identifier), execution.clone())?;
        let told = match command.intermediate.as_slice() {
            [] => None,
            _ => Some(self.follow(index, &format!("{}_Intermediate", command.identifier), execution.clone())?),
        };
        let key = (index, command.identifier.clone());
        self.last.remove(&key);
        self.running.insert(key, Running { execution, news, told });
        Ok(())
    }

    /// What a command that goes on has told by now.
    fn glance(&mut self, key: &(usize, String)) -> Result<(), Failure> {
        let Some(command) = self.features[key.0].command(&key.1) else { return Ok(()) };
        let elements = command.intermediate.clone();
        let latest = self.running.get(key).and_then(|r| r.told.as_ref()).and_then(Latest::take);
        if let Some(raw) = latest {
            let values = self.answered(key.0, &elements, &raw)?;
            self.last.insert(key.clone(), values);
        }
        Ok(())
    }

    /// Asks for what came of a command that has ended.
    fn end(&mut self, key: &(usize, String), command: &Command) -> Result<(), Failure> {
        if let Some(told) = self.running.get_mut(key).and_then(|r| r.told.as_mut()) {
            told.ended(&self.runtime, GLANCE);
        }
        self.glance(key)?;
        let Some(running) = self.running.remove(key) else { return Ok(()) };
        let raw: Raw = self.unary(key.0, &format!("{}_Result", command.identifier), running.execution)?;
        let answered = self.answered(key.0, &command.responses, &raw)?;
        self.last.entry(key.clone()).or_default().extend(answered);
        Ok(())
    }
}

#[allow(clippy::disallowed_methods, reason = "servers live by the wall clock")]
fn now() -> Instant {
    Instant::now()
}

fn has_ended(info: &Info) -> bool {
    matches!(info.stage(), Stage::Done | Stage::Failed)
}
