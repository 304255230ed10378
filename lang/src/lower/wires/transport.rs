//! The line of a driver: `serial(baud: 9600, frame: "7E1", framing: line, timeout: 1 s)`.

use matterix_ir::framing::Part;
use matterix_ir::wire::{BUILT_IN, Framing, Transport};
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Arg, Expr, ExprKind, ItemKind, Name};
use crate::eval::{Scope, Value};
use crate::lower::Planner;
use crate::near;

/// A line, understood.
pub(super) struct Line {
    pub transport: Transport,
    pub framing: Framing,
    pub address: Option<String>,
    pub timeout: f64,
}

const SERIAL: &[&str] = &["baud", "frame", "framing", "address", "timeout"];
const TCP: &[&str] = &["framing", "address", "timeout"];
const SILA: &[&str] = &["feature", "timeout", "definition"];
const HTTP: &[&str] = &["header", "timeout"];
/// What a line may go without.
const OPTIONAL: &[&str] = &["address", "header", "definition"];
const BAUDS: std::ops::RangeInclusive<f64> = 50.0..=4_000_000.0;

impl<'a> Planner<'a, '_> {
    pub(super) fn transport(&mut self, name: &'a Name, args: &'a [Arg], at: Span, module: usize) -> Option<Line> {
        let known = match name.text.as_str() {
            "serial" => SERIAL,
            "tcp" => TCP,
            "sila" => SILA,
            "http" => HTTP,
            _ => {
                let headline = format!("unknown transport `{}`", name.text);
                self.wrong(
                    name.span,
                    &headline,
                    "not a transport",
                    "a driver speaks over `serial`, `tcp`, `http` or `sila`, or over the line of another driver",
                );
                return None;
            }
        };
        for (i, arg) in args.iter().enumerate() {
            let Some(word) = &arg.name else {
                self.wrong(
                    arg.value.span,
                    "settings of a line need their names",
                    "without a name",
                    &format!("use {}", list(known)),
                );
                return None;
            };
            let again = args[..i].iter().any(|a| a.name.as_ref().is_some_and(|n| n.text == word.text));
            if again || !known.contains(&word.text.as_str()) {
                let what = if again { "is given twice" } else { "is not a setting of this line" };
                self.wrong(
                    word.span,
                    &format!("`{}` {what}", word.text),
                    "not expected",
                    &format!("use {}", list(known)),
                );
                return None;
            }
        }
        let given = |key: &str| args.iter().find(|a| a.name.as_ref().is_some_and(|n| n.text == key)).map(|a| &a.value);
        let missing: Vec<&str> =
            known.iter().copied().filter(|k| !OPTIONAL.contains(k) && given(k).is_none()).collect();
        if !missing.is_empty() {
            let headline = format!("the line of this driver needs {}", list(&missing));
            let help = match name.text.as_str() {
                "sila" => "write it as in `over sila(feature: \"org.example/heating/Hotplate/v1\", timeout: 5 s)`",
                "http" => "write it as in `over http(timeout: 1 min)`",
                _ => "write it as in `over serial(baud: 9600, frame: \"8N1\", framing: line, timeout: 1 s)`",
            };
            self.wrong(at, &headline, "these settings have no defaults", help);
            return None;
        }
        if name.text == "sila" {
            let transport = self.sila(given("feature")?, given("definition"))?;
            let timeout = self.timeout(given("timeout")?, module)?;
            return Some(Line { transport, framing: Framing::Calls, address: None, timeout });
        }
        let transport = match name.text.as_str() {
            "serial" => self.serial(given("baud")?, given("frame")?, module)?,
            "http" => Transport::Http { header: self.header(given("header"))? },
            _ => Transport::Tcp,
        };
        let framing = match transport {
            Transport::Http { .. } => Framing::Json,
            _ => self.framing(given("framing")?, module)?,
        };
        let address = match given("address") {
            Some(e) => Some(self.address(e, module)?),
            None => None,
        };
        self.addressed(&framing, address.as_deref(), given("address").map_or(at, |e| e.span))?;
        let timeout = self.timeout(given("timeout")?, module)?;
        Some(Line { transport, framing, address, timeout })
    }

    fn timeout(&mut self, e: &'a Expr, module: usize) -> Option<f64> {
        let timeout = self.duration_node(e, &mut Scope::module(module), "timeout")?;
        let known = self.lab.known(timeout)?;
        if known <= 0.0 {
            self.wrong(e.span, "a timeout must be above 0 s", "not above 0 s", "write it as in `timeout: 1 s`");
            return None;
        }
        Some(known)
    }

    /// `org.example/heating/Hotplate/v1`.
    fn sila(&mut self, feature: &'a Expr, definition: Option<&'a Expr>) -> Option<Transport> {
        let packed = definition.map(|e| match &*e.kind {
            ExprKind::Text(text) if matterix_sila::form::unpacked(text).is_some() => Ok(text.clone()),
            _ => Err(e.span),
        });
        let definition = match packed.transpose() {
            Ok(definition) => definition,
            Err(at) => {
                let help = "remove it: only drivers made from a definition have it";
                self.wrong(at, "this is not a definition of a feature", "invalid", help);
                return None;
            }
        };
        let parts: Vec<&str> = match &*feature.kind {
            ExprKind::Text(text) => text.split('/').collect(),
            _ => Vec::new(),
        };
        let word = |p: &str| !p.is_empty() && p.chars().all(|c| c.is_ascii_alphanumeric() || c == '.');
        match parts.as_slice() {
            [_, _, _, version] if parts.iter().all(|p| word(p)) && version.starts_with('v') => {
                Some(Transport::Sila { feature: parts.join("/"), definition })
            }
            _ => {
                let help = "originator, category, identifier, version: `\"org.example/heating/Hotplate/v1\"`";
                self.wrong(feature.span, "name a feature by its full identifier", "not one", help);
                None
            }
        }
    }

    fn serial(&mut self, baud: &'a Expr, frame: &'a Expr, module: usize) -> Option<Transport> {
        let rate = self.plain_number(baud, module).filter(|b| BAUDS.contains(b) && b.fract() == 0.0);
        let Some(rate) = rate else {
            self.wrong(
                baud.span,
                "a baud rate must be a whole number",
                "not a whole number",
                "write it as in `baud: 9600`",
            );
            return None;
        };
        let bits = match &*frame.kind {
            ExprKind::Text(text) => match *text.as_bytes() {
                [data @ b'5'..=b'8', parity @ (b'N' | b'E' | b'O'), stop @ (b'1' | b'2')] => Some((data, parity, stop)),
                _ => None,
            },
            _ => None,
        };
        let Some((data, parity, stop)) = bits else {
            let help = "data bits, parity, stop bits, as in `frame: \"8N1\"` or `frame: \"7E1\"`";
            self.wrong(frame.span, "this is not a frame format of a serial line", "invalid", help);
            return None;
        };
        let parity = char::from(parity);
        Some(Transport::Serial { baud: rate as u32, data_bits: data - b'0', parity, stop_bits: stop - b'0' })
    }

    /// `header: "Name: value"`; the outer nothing where it is no header.
    fn header(&mut self, given: Option<&'a Expr>) -> Option<Option<(String, String)>> {
        let Some(e) = given else { return Some(None) };
        let named = match &*e.kind {
            ExprKind::Text(text) => text.split_once(':').map(|(n, v)| (n.trim().to_owned(), v.trim().to_owned())),
            _ => None,
        };
        let is_token = |n: &str| !n.is_empty() && n.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_".contains(&b));
        let is_value = |v: &str| v.bytes().all(|b| (0x20..0x7f).contains(&b));
        let good = named.filter(|(n, v)| is_token(n) && is_value(v));
        if good.is_none() {
            self.wrong(
                e.span,
                "this is not a header",
                "invalid",
                "write a name and a value, as in `\"Accept: text/json\"`",
            );
        }
        good.map(Some)
    }

    /// A framing that a text declares or that is built in.
    fn framing(&mut self, e: &'a Expr, module: usize) -> Option<Framing> {
        let word = match &*e.kind {
            ExprKind::Name(n) => n.text.as_str(),
            _ => "",
        };
        let names = self.lab.tables.names;
        let is_framing = |id| matches!(names.decl(id).item.kind, ItemKind::Framing { .. });
        if let Some(id) = names.lookup(module, word).filter(|id| is_framing(*id)) {
            return self.frames(id).map(Framing::Frames);
        }
        if let Some((_, framing)) = BUILT_IN.iter().find(|(name, _)| *name == word) {
            return Some(framing.clone());
        }
        let declared = names.visible(module).filter(|(_, id)| is_framing(*id)).map(|(name, _)| name);
        let all: Vec<&str> = declared.chain(BUILT_IN.iter().map(|(name, _)| *name)).collect();
        let mut d = Diagnostic::error(codes::DRIVER_LINE, e.span, "unknown framing", "not declared");
        d.help.extend(near::question(&near::nearest(word, &all)));
        let d = d.help(format!("use one of {}", list(&all)));
        self.lab.report(d.help("declare one: `framing NAME { carries: text, frame: \"{data}\\r\" }`"));
        None
    }

    /// Whether a framing has an address where, and only where, it has room for one.
    fn addressed(&mut self, framing: &Framing, address: Option<&str>, at: Span) -> Option<()> {
        let form = match framing {
            Framing::CavroDt | Framing::CavroOem => Some(None),
            Framing::Frames(frames) => {
                let forms = frames.request.iter().chain(&frames.reply).filter_map(|part| match part {
                    Part::Address(form) => Some(form.as_ref()),
                    _ => None,
                });
                let forms: Vec<_> = forms.collect();
                forms.iter().find(|form| form.is_some()).or(forms.first()).copied()
            }
            Framing::Json | Framing::Calls => return Some(()),
        };
        match (form, address) {
            (None, None) | (Some(None), Some(_)) => Some(()),
            (Some(Some(form)), Some(address)) => {
                let written =
                    address.parse::<f64>().map_err(|_| "it is not a number".to_owned()).and_then(|n| form.write(n));
                if let Err(why) = written {
                    let headline = format!("`{address}` is not an address of this framing: {why}");
                    self.wrong(at, &headline, "does not fit", "the framing defines the format of an address");
                    return None;
                }
                Some(())
            }
            (Some(_), None) => {
                self.wrong(
                    at,
                    "this framing needs the `address` of the device",
                    "no address",
                    "write it as in `address: 1`",
                );
                None
            }
            (None, Some(_)) => {
                let help = "remove it, or add `{address}` to the framing";
                self.wrong(at, "this framing has no place for an address", "never sent", help);
                None
            }
        }
    }

    fn address(&mut self, e: &'a Expr, module: usize) -> Option<String> {
        if let ExprKind::Text(text) = &*e.kind {
            return Some(text.clone());
        }
        let number = self.plain_number(e, module).filter(|n| n.fract() == 0.0 && (0.0..1e6).contains(n));
        if number.is_none() {
            self.wrong(
                e.span,
                "an address must be a whole number or a text",
                "another value",
                "write it as in `address: 1`",
            );
        }
        number.map(|n| format!("{n}"))
    }

    fn plain_number(&mut self, e: &'a Expr, module: usize) -> Option<f64> {
        match self.lab.expr(e, &mut Scope::module(module)) {
            Value::Num(n) if n.dimension.is_one() => self.lab.known(n.node),
            _ => None,
        }
    }

    pub(super) fn wrong(&mut self, span: Span, headline: &str, label: &str, help: &str) {
        self.lab.report(Diagnostic::error(codes::DRIVER_LINE, span, headline, label).help(help));
    }
}

fn list(words: &[&str]) -> String {
    words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ")
}
