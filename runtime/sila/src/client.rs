//! A client: commands and properties of one server, by the features that it says it has. It blocks.

mod encrypted;
mod given;
mod wire;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use hyper_util::rt::TokioIo;
use matterix_sila::feature::{Command, Element, Feature};
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};
use tonic::Streaming;
use tonic::client::Grpc;
use tonic::transport::{Channel, Endpoint};

use crate::call::Failure;
use crate::framework::{Confirmation, Execution, Info, Stage};
use crate::raw::Raw;
use crate::service;
use crate::text::{self, Call, named, shown};
use crate::value::{Value, decode, encode};
use given::arguments;
pub use given::is_of;
use wire::{source, within};

/// Longest time in which news of an execution is waited for when it is only looked at.
const GLANCE: Duration = Duration::from_millis(20);

/// How often a server is asked for something while a command goes on of which nothing is heard. Pings of HTTP/2 would do,
/// but servers of gRPC turn those away who send more than one in some minutes.
const WATCH: Duration = Duration::from_secs(5);

/// A command that goes on.
struct Running {
    execution: Execution,
    news: Streaming<Info>,
    told: Option<Streaming<Raw>>,
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
}

impl Client {
    /// A connection to a server, `HOST:PORT`, that must offer this feature; no call lasts longer than `timeout`. The
    /// connection is not encrypted.
    pub fn connect(address: &str, feature: &str, timeout: Duration) -> Result<Client, Failure> {
        Client::connected(address, feature, timeout).map_err(|failure| match failure {
            Failure::Lost(_) if encrypted::is_encrypted(address, timeout) => Failure::Garbled(format!(
                "the server at `{address}` is encrypted (TLS), and calls are made without encryption only: start it without"
            )),
            other => other,
        })
    }

    #[allow(clippy::disallowed_methods, reason = "servers live by the wall clock")]
    fn connected(address: &str, feature: &str, timeout: Duration) -> Result<Client, Failure> {
        let lost = |why: String| Failure::Lost(format!("cannot connect to `{address}`: {why}"));
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.map_err(|e| lost(e.to_string()))?;
        let endpoint = Endpoint::from_shared(format!("http://{address}")).map_err(|e| lost(e.to_string()))?;
        // A connection that is gone is not made again in silence: nobody knows what became of the device meanwhile.
        let once = AtomicBool::new(false);
        let place = address.to_owned();
        let connector = tower::service_fn(move |_: http::Uri| {
            let (again, place) = (once.swap(true, Ordering::SeqCst), place.clone());
            async move {
                if again {
                    return Err(std::io::Error::other("it was cut"));
                }
                let stream = TcpStream::connect(place).await?;
                stream.set_nodelay(true)?;
                Ok(TokioIo::new(stream))
            }
        });
        let channel = within(&runtime, timeout, endpoint.connect_with_connector(connector))
            .ok_or_else(|| lost("it did not answer in time".to_owned()))?
            .map_err(|e| lost(source(&e)))?;
        let grpc = Grpc::new(channel).max_decoding_message_size(16 << 20);
        let features = vec![service::feature()];
        let mut client = Client {
            runtime,
            grpc,
            timeout,
            usual: timeout,
            features,
            running: BTreeMap::new(),
            last: BTreeMap::new(),
            seen: Instant::now(),
        };
        let offered = client.read(0, "ImplementedFeatures")?;
        let offered: Vec<String> = match offered {
            Value::List(list) => list.iter().map(shown).collect(),
            other => vec![shown(&other)],
        };
        if !offered.iter().any(|o| o == feature) {
            let list: Vec<String> = offered.iter().map(|o| format!("`{o}`")).collect();
            return Err(Failure::Garbled(format!("it does not offer `{feature}`, but {}", list.join(", "))));
        }
        let main = client.fetch(feature)?;
        client.features.insert(0, main);
        let own = service::feature().id();
        for other in offered.iter().filter(|o| *o != feature && **o != own) {
            // What cannot be read is not spoken to.
            if let Ok(read) = client.fetch(other) {
                client.features.push(read);
            }
        }
        Ok(client)
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

    /// Says a command; what it answers. One that lasts has only begun, unless it is `waited` for.
    pub fn say(&mut self, said: &str, waited: bool) -> Result<String, Failure> {
        let call = text::call(said).map_err(Failure::Garbled)?;
        let (index, name) = self.place(&call)?;
        let feature = &self.features[index];
        let Some(command) = feature.command(&name).cloned() else {
            let known: Vec<String> = feature.commands.iter().map(|c| format!("`{}`", c.identifier)).collect();
            let (id, list) = (feature.id(), known.join(", "));
            return Err(Failure::Garbled(format!("`{id}` has no command `{name}`; it has {list}")));
        };
        let arguments = arguments(feature, &command, &call).map_err(Failure::Garbled)?;
        let key = (index, name);
        if !command.observable {
            let answered = self.carry_out(index, &command, &arguments)?;
            let text = named(&answered);
            self.last.insert(key, answered);
            return Ok(text);
        }
        self.begin(index, &command, &arguments)?;
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
        self.end(&key, &command)?;
        Ok(self.last.get(&key).map(|answered| named(answered)).unwrap_or_default())
    }

    /// Whether a command that was begun has ended; its failure, if that is how.
    pub fn is_done(&mut self, asked: &str) -> Result<bool, Failure> {
        let call = text::call(asked).map_err(Failure::Garbled)?;
        let key = self.place(&call)?;
        let Some(command) = self.features[key.0].command(&key.1).cloned() else {
            return Err(Failure::Garbled(format!("`{asked}` is no command")));
        };
        let Some(running) = self.running.get_mut(&key) else {
            return match self.last.contains_key(&key) {
                true => Ok(true),
                false => Err(Failure::Garbled(format!(
                    "`{}` was not begun over this connection: whether it has ended is not known",
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
    #[allow(clippy::disallowed_methods, reason = "servers live by the wall clock")]
    fn is_there(&mut self) -> Result<(), Failure> {
        if self.seen.elapsed() < WATCH {
            return Ok(());
        }
        self.seen = Instant::now();
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
            self.glance(&key)?;
            let known = self.last.get(&key).into_iter().flatten().find(|(name, _)| name == response);
            let found = known.map(|(_, value)| shown(value));
            return found.ok_or_else(|| Failure::Garbled(format!("`{command}` has not told `{response}`")));
        }
        let (index, name) = self.place(&call)?;
        self.read(index, &name).map(|value| shown(&value))
    }

    /// The feature and the name in it that a text means.
    fn place(&self, call: &Call) -> Result<(usize, String), Failure> {
        match call.path.as_slice() {
            [name] => Ok((0, name.clone())),
            [feature, name] => {
                let found = self.features.iter().position(|f| f.identifier == *feature);
                let found = found.ok_or_else(|| Failure::Garbled(format!("it offers no feature `{feature}`")))?;
                Ok((found, name.clone()))
            }
            _ => Err(Failure::Garbled("nothing is named".to_owned())),
        }
    }

    fn read(&mut self, index: usize, name: &str) -> Result<Value, Failure> {
        let feature = &self.features[index];
        let Some(property) = feature.property(name).cloned() else {
            return Err(Failure::Garbled(format!("`{}` has no property `{name}`", feature.id())));
        };
        let raw: Raw = if property.observable {
            let path = self.path(index, &format!("Subscribe_{name}"))?;
            let mut all = self.stream(path, Raw::default())?;
            let first = within(&self.runtime, self.timeout, all.message()).ok_or_else(|| self.silent(name))?;
            first.map_err(|s| Failure::of(&s))?.ok_or_else(|| Failure::Garbled(format!("`{name}` told nothing")))?
        } else {
            let path = self.path(index, &format!("Get_{name}"))?;
            self.unary(path, Raw::default())?
        };
        let told = Element {
            identifier: property.identifier,
            display: String::new(),
            description: String::new(),
            ty: property.ty,
        };
        let values = decode(&self.features[index], std::slice::from_ref(&told), &raw).map_err(Failure::Garbled)?;
        values.into_iter().next().ok_or_else(|| Failure::Garbled(format!("`{name}` told nothing")))
    }

    /// A command that does not last, from its beginning to its end.
    fn carry_out(
        &mut self,
        index: usize,
        command: &Command,
        values: &[Value],
    ) -> Result<Vec<(String, Value)>, Failure> {
        let raw = encode(&self.features[index], &command.parameters, values).map_err(Failure::Garbled)?;
        let path = self.path(index, &command.identifier)?;
        let answer: Raw = self.unary(path, raw)?;
        self.answered(index, &command.responses, &answer)
    }

    fn answered(&self, index: usize, elements: &[Element], raw: &Raw) -> Result<Vec<(String, Value)>, Failure> {
        let values = decode(&self.features[index], elements, raw).map_err(Failure::Garbled)?;
        Ok(elements.iter().map(|e| e.identifier.clone()).zip(values).collect())
    }

    fn begin(&mut self, index: usize, command: &Command, values: &[Value]) -> Result<(), Failure> {
        let raw = encode(&self.features[index], &command.parameters, values).map_err(Failure::Garbled)?;
        let path = self.path(index, &command.identifier)?;
        let confirmed: Confirmation = self.unary(path, raw)?;
        let execution = confirmed.execution.ok_or_else(|| Failure::Garbled("it names no execution".to_owned()))?;
        let path = self.path(index, &format!("{}_Info", command.identifier))?;
        let news = self.stream(path, execution.clone())?;
        let told = match command.intermediate.as_slice() {
            [] => None,
            _ => {
                let path = self.path(index, &format!("{}_Intermediate", command.identifier))?;
                Some(self.stream(path, execution.clone())?)
            }
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
        let mut latest = None;
        if let Some(told) = self.running.get_mut(key).and_then(|r| r.told.as_mut()) {
            while let Some(Ok(Some(raw))) = within(&self.runtime, GLANCE, told.message()) {
                latest = Some(raw);
            }
        }
        if let Some(raw) = latest {
            let values = self.answered(key.0, &elements, &raw)?;
            self.last.insert(key.clone(), values);
        }
        Ok(())
    }

    /// Asks for what came of a command that has ended.
    fn end(&mut self, key: &(usize, String), command: &Command) -> Result<(), Failure> {
        self.glance(key)?;
        let Some(running) = self.running.remove(key) else { return Ok(()) };
        let path = self.path(key.0, &format!("{}_Result", command.identifier))?;
        let raw: Raw = self.unary(path, running.execution)?;
        let answered = self.answered(key.0, &command.responses, &raw)?;
        self.last.entry(key.clone()).or_default().extend(answered);
        Ok(())
    }
}

fn has_ended(info: &Info) -> bool {
    matches!(info.stage(), Stage::Done | Stage::Failed)
}
