//! Where the devices of a lab are, as a file says: a table of TOML for each.
//!
//! ```toml
//! [plate]
//! port = "/dev/ttyUSB0"
//! tolerance = { temperature = "5 K" }
//! ```

use matterix_ir::wire::Transport;
use matterix_ir::{Diagnostic, FileId, Program, Span, codes, hidden};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::calibration::CALIBRATION;
use crate::deploy::{Binding, Carrier};
use crate::place::{Place, SilaServer};

mod sila;

const KEYS: [&str; 15] = [
    "port",
    "address",
    "http",
    "sila",
    "driver",
    "unit",
    "by",
    "tolerance",
    IDENTITY,
    CALIBRATION,
    sila::CERTIFICATE,
    sila::FINGERPRINT,
    sila::USER,
    sila::PASSWORD,
    sila::LOCK,
];
const HAND: &str = "hand";
const IDENTITY: &str = "identity";

/// The bindings of a file for the lab of a program, with what is wrong with them.
pub fn read(program: &Program, file: FileId, text: &str) -> (Vec<Binding>, Vec<Diagnostic>) {
    let mut reader = Reader { program, file, found: hidden::characters(file, text) };
    let table = match DeTable::parse(text) {
        Ok(table) => table,
        Err(e) => {
            let at = e.span().map_or(0..0, |s| s);
            reader.wrong(at, "this file is not valid TOML", e.message().to_owned(), None);
            return (Vec::new(), reader.found);
        }
    };
    let mut bindings = Vec::new();
    for (name, value) in table.get_ref() {
        bindings.extend(reader.device(name, value).map(|binding| (binding, name.span())));
    }
    reader.beside_each_other(&bindings);
    reader.one_by_one(&bindings);
    let bindings = reader.with_shared(bindings);
    (bindings, reader.found)
}

/// What a plan rests on of its bindings, as a text: who speaks to what, by which driver, under which address of its line and with
/// which tolerances; not where lines are, as a device may be moved to another port.
pub fn canonical(program: &Program, bindings: &[Binding]) -> String {
    let mut lines: Vec<String> = bindings.iter().map(|b| line(program, b)).collect();
    lines.sort();
    lines.concat()
}

fn line(program: &Program, binding: &Binding) -> String {
    let name = &program.scene.get(binding.instance).name;
    let driver = |index: usize| program.drivers.get(index).map_or("", |d| d.name.as_str());
    let by = match &binding.carrier {
        Carrier::Line { driver: index, address, .. } => {
            format!("{} {}", driver(*index), address.as_deref().unwrap_or_default())
        }
        Carrier::Shared { driver: index, .. } => driver(*index).to_owned(),
        Carrier::Hand => HAND.to_owned(),
    };
    format!("{name}: {by} {:?}\n", binding.tolerances)
}

struct Reader<'p> {
    program: &'p Program,
    file: FileId,
    found: Vec<Diagnostic>,
}

type Range = std::ops::Range<usize>;

/// A text, and where it stands.
type Text = (String, Range);

/// The texts of a binding.
struct Said {
    /// In the order of their keys.
    places: Vec<(Place, Range)>,
    driver: Option<Text>,
    unit: Option<Text>,
    by: Option<Text>,
}

impl Said {
    /// Whether it says where a line is, or who speaks on it.
    fn names_a_line(&self) -> bool {
        !self.places.is_empty() || self.driver.is_some()
    }
}

impl Reader<'_> {
    fn wrong(&mut self, at: Range, headline: &str, label: impl Into<String>, help: Option<String>) {
        let span = Span::new(self.file, at.start, at.end);
        let mut d = Diagnostic::error(codes::BINDING, span, headline.to_owned(), label.into());
        d.help.extend(help);
        self.found.push(d);
    }

    fn device(&mut self, name: &Spanned<std::borrow::Cow<'_, str>>, value: &Spanned<DeValue<'_>>) -> Option<Binding> {
        let key = name.get_ref().as_ref();
        let Some(instance) = self.program.scene.find(key) else {
            let lab = &self.program.scene.lab;
            let top =
                self.program.scene.instances.iter().filter(|i| i.owner.is_none()).map(|i| format!("`{}`", i.name));
            let help = format!("use one of {}", top.take(12).collect::<Vec<_>>().join(", "));
            self.wrong(name.span(), &format!("the lab `{lab}` has no `{key}`"), "no such device", Some(help));
            return None;
        };
        let DeValue::Table(table) = value.get_ref() else {
            self.wrong(
                value.span(),
                &format!("`{key}` needs a table"),
                "not a table",
                Some(format!("write `[{key}]`, then one key on each line")),
            );
            return None;
        };
        for (k, _) in table.iter().filter(|(k, _)| !KEYS.contains(&k.get_ref().as_ref())) {
            let help = format!("use {}", KEYS.map(|k| format!("`{k}`")).join(", "));
            self.wrong(
                k.span(),
                &format!("unknown key `{}` in a binding", k.get_ref()),
                "not a key of a binding",
                Some(help),
            );
        }
        let before = self.found.len();
        if let Some((_, value)) = table.iter().find(|(k, _)| k.get_ref() == CALIBRATION) {
            self.calibration(value);
            // What stands on a device's deck is told over its line.
            if table.len() == 1 {
                return None;
            }
        }
        let mut said = self.said(table);
        if let Some((by, at)) = said.by.take() {
            let binding = Binding {
                instance,
                at: Span::new(self.file, at.start, at.end),
                carrier: Carrier::Hand,
                tolerances: Vec::new(),
                identity: None,
            };
            self.by_hand(key, &by, at, said.names_a_line());
            return (self.found.len() == before).then_some(binding);
        }
        let Said { driver, unit, places, .. } = said;
        let (mut place, at) = self.place(key, places, name.span())?;
        self.access(table, &mut place);
        let driver = self.driver(key, instance, driver, name.span())?;
        self.fits(driver, &place, &at)?;
        let place = match place.checked() {
            Ok(place) => place,
            Err(no) => {
                self.wrong(at, &format!("the place of `{key}` is invalid: {}", no.why), "invalid place", Some(no.help));
                return None;
            }
        };
        if let Some((unit, at)) = &unit
            && let Err(why) = crate::codec::Codec::new(&self.program.drivers[driver].framing, Some(unit))
        {
            self.wrong(at.clone(), &why, "not an address of this line", None);
        }
        let tolerances = self.tolerances(key, driver, table);
        let identity = self.identity(key, driver, table);
        let carrier = Carrier::Line { driver, place, address: unit.map(|(unit, _)| unit) };
        let at = Span::new(self.file, at.start, at.end);
        (self.found.len() == before).then_some(Binding { instance, at, carrier, tolerances, identity })
    }

    /// Reports devices of one kind that are to be the same one.
    fn one_by_one(&mut self, bound: &[(Binding, Range)]) {
        let driver = |binding: &Binding| match binding.carrier {
            Carrier::Line { driver, .. } => Some(&self.program.drivers[driver].name),
            _ => None,
        };
        let mut twice = Vec::new();
        for (later, (binding, at)) in bound.iter().enumerate() {
            let Some(identity) = &binding.identity else { continue };
            let same = |other: &&(Binding, Range)| {
                other.0.identity.as_ref() == Some(identity) && driver(&other.0) == driver(binding)
            };
            let Some((other, _)) = bound[..later].iter().find(same) else { continue };
            let [first, second] = [other, binding].map(|b| &self.program.scene.get(b.instance).name);
            twice.push((at.clone(), format!("`{first}` and `{second}` cannot both be `{identity}`")));
        }
        for (at, headline) in twice {
            self.wrong(at, &headline, "the same device", Some("give each its own `identity`".to_owned()));
        }
    }

    /// Reports devices that are bound to one line and cannot be told apart there.
    fn beside_each_other(&mut self, bound: &[(Binding, Range)]) {
        for (later, (binding, at)) in bound.iter().enumerate() {
            let Carrier::Line { driver, place: place @ (Place::Serial(_) | Place::Tcp(_)), address } = &binding.carrier
            else {
                continue;
            };
            let own = &self.program.drivers[*driver];
            let address = address.as_ref().or(own.address.as_ref());
            let beside = bound[..later].iter().find_map(|(other, _)| match &other.carrier {
                Carrier::Line { driver, place: there, address } if there == place => Some((other, *driver, address)),
                _ => None,
            });
            let Some((other, driver, known)) = beside else { continue };
            let theirs = &self.program.drivers[driver];
            let known = known.as_ref().or(theirs.address.as_ref());
            let (name, first) =
                (&self.program.scene.get(binding.instance).name, &self.program.scene.get(other.instance).name);
            let (why, help) = if address.is_none() || known.is_none() {
                ("their framing has no address", "bind each to its own line, or use a framing with an `{address}`")
            } else if address == known {
                ("both have the same address", "give each its own: `unit = \"2\"`")
            } else if own.transport != theirs.transport || own.framing != theirs.framing {
                ("their drivers use different protocols", "use drivers with the same transport and framing")
            } else {
                continue;
            };
            let headline = format!("`{first}` and `{name}` cannot share a line: {why}");
            self.wrong(at.clone(), &headline, "the same line", Some(help.to_owned()));
        }
    }

    /// The texts of a binding; what is none is reported.
    fn said(&mut self, table: &DeTable<'_>) -> Said {
        let mut text = |wanted: &str| self.text(table, wanted);
        let mut place = |key: &str, of: fn(String) -> Place| text(key).map(|(said, at)| (of(said), at));
        let places = [
            place("port", Place::Serial),
            place("address", Place::Tcp),
            place("http", Place::Http),
            place("sila", |at| Place::Sila(Box::new(SilaServer { at, ..SilaServer::default() }))),
        ];
        let places = places.into_iter().flatten().collect();
        Said { places, driver: text("driver"), unit: text("unit"), by: text("by") }
    }

    /// The text of a key, if it is there; what is no text is reported.
    fn text(&mut self, table: &DeTable<'_>, wanted: &str) -> Option<Text> {
        let value = table.iter().find(|(k, _)| k.get_ref() == wanted)?.1;
        if let DeValue::String(text) = value.get_ref() {
            return Some((text.to_string(), value.span()));
        }
        let headline = format!("`{wanted}` must be a text");
        self.wrong(value.span(), &headline, "not a text", Some("write it in quotes".into()));
        None
    }

    /// Reports what does not go with a device that a person does by hand.
    fn by_hand(&mut self, key: &str, by: &str, at: Range, names_a_line: bool) {
        if by != HAND {
            let help = "write `by = \"hand\"`";
            self.wrong(at.clone(), "the only value of `by` is `hand`", "another value", Some(help.into()));
        }
        if names_a_line {
            let headline = format!("`{key}` is bound both to a person and to a line");
            self.wrong(at, &headline, "choose one of them", None);
        }
    }

    /// The only place of a device named at `name`; none, or more than one, is reported.
    fn place(&mut self, key: &str, places: Vec<(Place, Range)>, name: Range) -> Option<(Place, Range)> {
        let mut places = places.into_iter();
        match (places.next(), places.next()) {
            (Some(place), None) => Some(place),
            (_, Some((_, at))) => {
                let label = "use only one of `port`, `address`, `http` and `sila`";
                self.wrong(at, &format!("`{key}` has two lines"), label, None);
                None
            }
            (None, None) => {
                let help = "write `port = \"/dev/ttyUSB0\"`, `address = \"HOST:PORT\"`, `http = \"HOST:PORT\"`, \
                            `sila = \"HOST:PORT\"` or `by = \"hand\"`";
                self.wrong(name, &format!("the binding of `{key}` has no place"), "no place", Some(help.into()));
                None
            }
        }
    }

    /// Who a device has to be, where its driver can ask it.
    fn identity(&mut self, key: &str, driver: usize, table: &DeTable<'_>) -> Option<String> {
        let (identity, at) = self.text(table, IDENTITY)?;
        let driver = &self.program.drivers[driver];
        if driver.identity.is_empty() {
            let headline = format!("the driver `{}` cannot ask `{key}` for its identity", driver.name);
            let help = "add its line `identity sends \"...\" expects \"... {<serial>}\"`";
            self.wrong(at, &headline, "cannot be checked", Some(help.to_owned()));
            return None;
        }
        Some(identity)
    }

    /// Whether a driver can speak to a place said at `at`; none, and reported, where it cannot.
    fn fits(&mut self, driver: usize, place: &Place, at: &Range) -> Option<()> {
        let matterix_ir::wire::Driver { transport, name, .. } = &self.program.drivers[driver];
        let fits = match (transport, place) {
            (Transport::Sila { .. }, _) => matches!(place, Place::Sila(_)),
            (Transport::Http { .. }, _) => matches!(place, Place::Http(_)),
            (_, Place::Sila(_) | Place::Http(_)) => false,
            _ => true,
        };
        if fits {
            return Some(());
        }
        let (headline, help) = match transport {
            Transport::Sila { .. } => {
                (format!("the driver `{name}` needs a SiLA 2 server"), format!("write `sila = \"{place}\"`"))
            }
            Transport::Http { .. } => {
                (format!("the driver `{name}` needs HTTP"), format!("write `http = \"{place}\"`"))
            }
            _ => (
                format!("the driver `{name}` needs a serial line or a network address"),
                "write `port = \"/dev/ttyUSB0\"` or `address = \"HOST:PORT\"`".to_owned(),
            ),
        };
        self.wrong(at.clone(), &headline, "another kind of place", Some(help));
        None
    }

    fn driver(
        &mut self,
        key: &str,
        instance: matterix_ir::scene::InstanceId,
        wanted: Option<(String, Range)>,
        at: Range,
    ) -> Option<usize> {
        let own = |d: &matterix_ir::wire::Driver| d.instance == instance && d.host.is_none();
        let drivers = self.program.drivers.iter().enumerate().filter(|(_, d)| own(d));
        let all: Vec<(usize, &str)> = drivers.map(|(i, d)| (i, d.name.as_str())).collect();
        let list = all.iter().map(|(_, n)| format!("`{n}`")).collect::<Vec<_>>().join(", ");
        match (&wanted, all.as_slice()) {
            (Some((name, at)), _) => {
                let found = all.iter().find(|(_, n)| n == name).map(|(i, _)| *i);
                if found.is_none() {
                    let help = (!list.is_empty()).then(|| format!("it has {list}"));
                    self.wrong(at.clone(), &format!("`{key}` has no driver `{name}`"), "no such driver", help);
                }
                found
            }
            (None, [(only, _)]) => Some(*only),
            (None, []) => {
                let help =
                    "declare one: `driver NAME for ASSET over serial(...) { }`, or let a person do it: `by = \"hand\"`";
                self.wrong(at, &format!("`{key}` has no driver"), "a driver is missing", Some(help.into()));
                None
            }
            (None, _) => {
                let help = format!("choose one: `driver = ...` with one of {list}");
                self.wrong(at, &format!("`{key}` has several drivers"), "ambiguous", Some(help));
                None
            }
        }
    }

    /// All that is bound, and after each device what speaks over its line, is not bound itself and has one driver for it.
    fn with_shared(&mut self, bound: Vec<(Binding, Range)>) -> Vec<Binding> {
        let program = self.program;
        let mut all: Vec<Binding> = bound.iter().map(|(binding, _)| binding.clone()).collect();
        for (host, (binding, at)) in bound.iter().enumerate() {
            let Carrier::Line { driver, .. } = &binding.carrier else { continue };
            let is_its = |d: &matterix_ir::wire::Driver| {
                let name = &program.drivers[*driver].name;
                d.host.as_ref().is_some_and(|h| h.instance == binding.instance && h.driver == *name)
            };
            for (index, d) in program.drivers.iter().enumerate().filter(|(_, d)| is_its(d)) {
                if bound.iter().any(|(b, _)| b.instance == d.instance) {
                    continue;
                }
                let other = program.drivers[..index].iter().find(|o| is_its(o) && o.instance == d.instance);
                if let Some(other) = other {
                    let name = &program.scene.get(d.instance).name;
                    let headline = format!(
                        "`{name}` has several drivers over the line of `{}`",
                        program.scene.get(binding.instance).name
                    );
                    let help = format!("keep one of `{}` and `{}`", other.name, d.name);
                    self.wrong(at.clone(), &headline, "bound here", Some(help));
                }
                let carrier = Carrier::Shared { driver: index, host };
                all.push(Binding {
                    instance: d.instance,
                    at: binding.at,
                    carrier,
                    tolerances: Vec::new(),
                    identity: None,
                });
            }
        }
        all
    }

    /// `calibration = { offset_x = "0.1 mm" }`; what the values mean is seen when the program is compiled with them.
    fn calibration(&mut self, value: &Spanned<DeValue<'_>>) {
        let help = || Some("write `calibration = { offset_x = \"0.1 mm\" }`".to_owned());
        let DeValue::Table(all) = value.get_ref() else {
            self.wrong(value.span(), "a calibration must be a table", "not a table", help());
            return;
        };
        for (_, value) in all.iter().filter(|(_, v)| !matches!(v.get_ref(), DeValue::String(_))) {
            self.wrong(value.span(), "a measured value must be a text with its unit", "not a text", help());
        }
    }

    /// `tolerance = { temperature = "5 K" }`.
    fn tolerances(&mut self, key: &str, driver: usize, table: &DeTable<'_>) -> Vec<(String, f64)> {
        let Some((_, value)) = table.iter().find(|(k, _)| k.get_ref() == "tolerance") else { return Vec::new() };
        let DeValue::Table(all) = value.get_ref() else {
            let help = "write `tolerance = { temperature = \"5 K\" }`";
            self.wrong(value.span(), "tolerances must be a table", "not a table", Some(help.into()));
            return Vec::new();
        };
        let mut out = Vec::new();
        for (member, value) in all.iter() {
            let program = self.program;
            let told = program.drivers[driver].told.iter().find(|t| t.name == format!("{key}.{}", member.get_ref()));
            let Some(told) = told else {
                let names: Vec<String> =
                    program.drivers[driver].told.iter().map(|t| format!("`{}`", &t.name[key.len() + 1..])).collect();
                let help = format!("it reports {}", names.join(", "));
                self.wrong(
                    member.span(),
                    &format!("`{key}` does not report `{}`", member.get_ref()),
                    "not reported",
                    Some(help),
                );
                continue;
            };
            let unit = &told.difference;
            let text = match value.get_ref() {
                DeValue::String(text) => text.as_ref(),
                _ => "",
            };
            let (number, symbol) = text.split_once(' ').unwrap_or((text, ""));
            match number.parse::<f64>().ok().filter(|n| n.is_finite() && *n >= 0.0 && symbol.trim() == unit.symbol) {
                Some(number) => out.push((member.get_ref().to_string(), number * unit.factor)),
                None => {
                    let help = format!("write it as in `{} = \"2 {}\"`", member.get_ref(), unit.symbol);
                    let headline =
                        format!("the tolerance of `{}` must be a number in {}", member.get_ref(), unit.symbol);
                    self.wrong(value.span(), &headline, "not such a number", Some(help));
                }
            }
        }
        out
    }
}
