//! Framings: `framing stx { carries: text, frame: "\x02{data}{check :u8 hex}\r", check: sum8(data) }`.
//!
//! A layout is a text with the parts of a frame in braces, in their order, each with the form it has on the line.

use matterix_ir::form::{Encoding, Form, Kind};
use matterix_ir::framing::{CHECKSUMS, Carries, Check, Checksum, Counted, Crc, Frames, Mark, Part, Stretch};
use matterix_ir::{Diagnostic, Span, codes};

use crate::ast::{Arg, Binary, Expr, ExprKind, Field, FieldValue, ItemKind, Name};
use crate::eval::Scope;
use crate::lower::Planner;
use crate::names::DeclId;
use crate::near;

const FIELDS: &[&str] = &["carries", "frame", "request", "reply", "length", "check", "silence"];
const MARKS: &[(&str, Mark)] = &[
    ("begin", Mark::Start),
    ("data", Mark::Data),
    ("address", Mark::Address),
    ("length", Mark::Length),
    ("check", Mark::Check),
    ("number", Mark::Number),
    ("end", Mark::End),
];
const CRC: &str = "crc";

/// A layout, and where it stands.
type Layout = (Vec<Part>, Span);

impl<'a> Planner<'a, '_> {
    /// A framing as it is declared; none where something is wrong with it, which is reported.
    pub fn frames(&mut self, id: DeclId) -> Option<Frames> {
        let decl = self.lab.tables.names.decl(id);
        let ItemKind::Framing { name, fields } = &decl.item.kind else { return None };
        self.known_fields(fields)?;
        let given = |key: &str| fields.iter().find(|f| f.key.text == key);
        let Some(carries) = given("carries") else {
            let help = "`carries: text`, `carries: bytes` or `carries: modbus`";
            return self.no_framing(name.span, "a framing needs `carries`", "it has no default", help);
        };
        let carries = self.carries(carries)?;
        let (request, reply) = match (given("frame"), given("request"), given("reply")) {
            (Some(frame), None, None) => {
                let layout = self.layout(frame)?;
                (layout.clone(), layout)
            }
            (None, Some(request), Some(reply)) => (self.layout(request)?, self.layout(reply)?),
            _ => {
                let help = "write `frame: \"...{data}...\"`, or both `request: \"...\"` and `reply: \"...\"`";
                return self.no_framing(name.span, "give the layout of a frame once", "missing, or given twice", help);
            }
        };
        let length = match given("length") {
            Some(field) => Some((self.counted(field)?, field.span)),
            None => None,
        };
        let check = match given("check") {
            Some(field) => Some((self.checksum(field)?, field.span)),
            None => None,
        };
        let silence = match given("silence") {
            Some(field) => self.silence(field, decl.module)?,
            None => 0.0,
        };
        for (layout, at) in [&request, &reply] {
            self.fits_layout(layout, *at, carries, length.as_ref(), check.as_ref())?;
        }
        let (length, check) = (length.map(|(l, _)| l), check.map(|(c, _)| c));
        Some(Frames { name: name.text.clone(), carries, request: request.0, reply: reply.0, length, check, silence })
    }

    fn known_fields(&mut self, fields: &[Field]) -> Option<()> {
        for (i, field) in fields.iter().enumerate() {
            let key = field.key.text.as_str();
            let again = fields[..i].iter().any(|f| f.key.text == key);
            if again || !FIELDS.contains(&key) {
                let what = if again { "is given twice" } else { "is not a field of a framing" };
                let d = Diagnostic::error(codes::FRAMING, field.key.span, format!("`{key}` {what}"), "not expected");
                let near = if again { Vec::new() } else { near::nearest(key, FIELDS) };
                self.lab.report(near::proposed(d, &near, field.key.span).help(format!("use {}", listed(FIELDS))));
                return None;
            }
        }
        Some(())
    }

    fn carries(&mut self, field: &Field) -> Option<Carries> {
        match word(field) {
            Some("text") => Some(Carries::Text),
            Some("bytes") => Some(Carries::Bytes),
            Some("modbus") => Some(Carries::Modbus),
            _ => self.no_framing(
                field.span,
                "`carries` must be `text`, `bytes` or `modbus`",
                "another value",
                "`text` for printable characters, `bytes` for any bytes, `modbus` for requests and replies of Modbus",
            ),
        }
    }

    /// The parts of a text like `"\x02{address :02}{data}\x03"`.
    fn layout(&mut self, field: &Field) -> Option<Layout> {
        let text = match &field.value {
            FieldValue::Expr(Expr { kind, .. }) => match &**kind {
                ExprKind::Text(text) => Some(text.as_str()),
                _ => None,
            },
            _ => None,
        };
        let Some(text) = text else {
            return self.no_framing(
                field.span,
                "a layout must be a text",
                "not a text",
                "write it as in `\"\\x02{data}\\x03\"`",
            );
        };
        let mut parts: Vec<Part> = Vec::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            let doubled = rest.starts_with("{{") || rest.starts_with("}}");
            if !doubled && c == '{' {
                let Some((inner, after)) = rest[1..].split_once('}') else {
                    return self.no_framing(
                        field.span,
                        "a brace is not closed",
                        "`{` without `}`",
                        "write `{{` for the brace itself",
                    );
                };
                let part = self.part(inner, field.span)?;
                if parts.iter().any(|p| p.mark() == part.mark()) {
                    let headline = format!("a layout contains `{{{inner}}}` twice");
                    return self.no_framing(field.span, &headline, "given twice", "use each part once");
                }
                parts.push(part);
                rest = after;
                continue;
            }
            let Some(byte) = u8::try_from(u32::from(c)).ok().filter(|_| doubled || c != '}') else {
                return self.no_framing(
                    field.span,
                    &format!("`{c}` is not a single byte"),
                    "in a layout",
                    "write bytes as `\\x1b`",
                );
            };
            match parts.last_mut() {
                Some(Part::Fixed(bytes)) => bytes.push(byte),
                _ => parts.push(Part::Fixed(vec![byte])),
            }
            rest = &rest[c.len_utf8() * if doubled { 2 } else { 1 }..];
        }
        if !parts.contains(&Part::Data) {
            return self.no_framing(
                field.span,
                "the layout has no place for the message",
                "no `{data}`",
                "add `{data}`",
            );
        }
        Some((parts, field.span))
    }

    /// `address :02`.
    fn part(&mut self, inner: &str, at: Span) -> Option<Part> {
        let (name, form) = inner.split_once(':').map_or((inner, None), |(name, form)| (name, Some(form.trim())));
        let name = name.trim();
        let form = match form.map(|f| Form::parse(f, false)) {
            Some(Ok(form)) => Some(form),
            Some(Err(why)) => return self.no_framing(at, &why, "in a layout", "write it as in `{length :u16 big}`"),
            None => None,
        };
        let fixed = form.clone().filter(|f| f.width().is_some() && is_whole(f));
        match (name, form, fixed) {
            ("data", None, _) => Some(Part::Data),
            ("data", Some(_), _) => {
                self.no_framing(at, "`data` takes no format", "`{data}` alone", "`carries` gives its format")
            }
            ("address", None, _) => Some(Part::Address(None)),
            ("address", _, Some(form)) => Some(Part::Address(Some(form))),
            ("length", _, Some(form)) => Some(Part::Length(form)),
            ("check", _, Some(form)) => Some(Part::Check(form)),
            ("number", _, Some(form)) => Some(Part::Number(form)),
            ("address" | "length" | "check" | "number", ..) => {
                let headline = format!("`{name}` needs the format of a whole number of fixed width");
                self.no_framing(
                    at,
                    &headline,
                    "another format",
                    "write it as in `:u8`, `:u16 little`, `:02` or `:u8 hex`",
                )
            }
            _ => {
                let headline = format!("a frame has no part `{name}`");
                let help = "`data`, `address`, `length`, `check` and `number` are parts";
                self.no_framing(at, &headline, "not a part", help)
            }
        }
    }

    /// `count(address .. data) + 2`.
    fn counted(&mut self, field: &Field) -> Option<Counted> {
        let (expr, more) = match &field.value {
            FieldValue::Expr(e) => match &*e.kind {
                ExprKind::Binary(Binary::Add, of, more) => (Some(of), number(more)),
                ExprKind::Binary(Binary::Sub, of, less) => (Some(of), number(less).map(|n| -n)),
                _ => (Some(e), Some(0.0)),
            },
            _ => (None, None),
        };
        let call = expr.and_then(|e| match &*e.kind {
            ExprKind::Call(of, args) => Some((name_of(of)?, args.as_slice())),
            _ => None,
        });
        let more = more.filter(|n| n.fract() == 0.0 && n.abs() <= 1000.0);
        match (call, more) {
            (Some(("count", [Arg { name: None, value }])), Some(more)) => {
                Some(Counted { over: self.stretch(value)?, more: more as i32 })
            }
            _ => {
                let help = "write it as in `length: count(data)` or `length: count(address .. data) + 1`";
                self.no_framing(field.span, "`length` must count a part of the frame", "invalid", help)
            }
        }
    }

    /// `crc16_modbus(address .. data)`.
    fn checksum(&mut self, field: &Field) -> Option<Check> {
        let call = match &field.value {
            FieldValue::Expr(e) => match &*e.kind {
                ExprKind::Call(of, args) => name_of(of).map(|name| (name, args.as_slice(), of.span)),
                _ => None,
            },
            _ => None,
        };
        let Some((name, [Arg { name: None, value: over }, more @ ..], at)) = call else {
            let help = "write it as in `check: sum8(data)` or `check: crc16_modbus(address .. data)`";
            return self.no_framing(field.span, "`check` must be a checksum over a part of the frame", "invalid", help);
        };
        let over = self.stretch(over)?;
        if name == CRC {
            let sum = self.crc(more, field.span)?;
            return Some(Check { sum, over });
        }
        let known = CHECKSUMS.iter().find(|(known, _)| *known == name).filter(|_| more.is_empty());
        let Some((_, sum)) = known else {
            let names: Vec<&str> = CHECKSUMS.iter().map(|(name, _)| *name).collect();
            let headline = format!("unknown checksum `{name}`");
            let d = Diagnostic::error(codes::FRAMING, at, headline, "not a built-in checksum");
            let help = format!("use one of {}, or `crc(...)` with its parameters", listed(&names));
            self.lab.report(near::proposed(d, &near::nearest(name, &names), at).help(help));
            return None;
        };
        Some(Check { sum: sum.clone(), over })
    }

    /// `crc(data, width: 16, polynomial: "1021", initial: "FFFF", reflected: false, final: "0000")`.
    fn crc(&mut self, args: &[Arg], at: Span) -> Option<Checksum> {
        let given = |key: &str| args.iter().find(|a| a.name.as_ref().is_some_and(|n| n.text == key)).map(|a| &a.value);
        let hex = |key: &str| match given(key).map(|e| &*e.kind) {
            Some(ExprKind::Text(text)) => u32::from_str_radix(text, 16).ok(),
            _ => None,
        };
        let width = given("width").and_then(number);
        if let Some(e) = given("width").filter(|_| width.is_some_and(|w| ![8.0, 16.0, 32.0].contains(&w))) {
            return self.no_framing(
                e.span,
                "the width of a CRC must be 8, 16 or 32",
                "another width",
                "write it as in `width: 16`",
            );
        }
        let reflected = match given("reflected").map(|e| &*e.kind) {
            Some(ExprKind::Name(n)) if n.text == "true" => Some(true),
            Some(ExprKind::Name(n)) if n.text == "false" => Some(false),
            _ => None,
        };
        let all = (width, hex("polynomial"), hex("initial"), reflected, hex("final"));
        let (Some(width), Some(polynomial), Some(initial), Some(reflected), Some(last), 5) =
            (all.0, all.1, all.2, all.3, all.4, args.len())
        else {
            let help = "write it as in `crc(data, width: 16, polynomial: \"1021\", initial: \"FFFF\", reflected: false, final: \"0\")`";
            return self.no_framing(at, "a CRC needs five parameters", "not these", help);
        };
        let fits = |value: u32| width == 32.0 || f64::from(value) < 2f64.powf(width);
        if ![polynomial, initial, last].into_iter().all(fits) {
            let headline = format!("a parameter of this CRC has more than {width} bits");
            return self.no_framing(at, &headline, "too large", "write the polynomial without its highest bit");
        }
        Some(Checksum::Crc(Crc { width: width as u8, polynomial, initial, reflected, last }))
    }

    /// `address .. data`, or one part alone.
    fn stretch(&mut self, e: &Expr) -> Option<Stretch> {
        let mark = |e: &Expr| {
            let name = match &*e.kind {
                ExprKind::Name(Name { text, .. }) => text.as_str(),
                _ => "",
            };
            MARKS.iter().find(|(known, _)| *known == name).map(|(_, mark)| *mark)
        };
        let ends = match &*e.kind {
            ExprKind::Range(from, to) => mark(from).zip(mark(to)),
            _ => mark(e).map(|mark| (mark, mark)),
        };
        match ends {
            Some((from, to)) => Some(Stretch { from, to }),
            None => {
                let names: Vec<&str> = MARKS.iter().map(|(name, _)| *name).collect();
                let help = format!("write one part, or from one part to another, of {}", listed(&names));
                self.no_framing(e.span, "this is not a part of the frame", "invalid", &help)
            }
        }
    }

    fn silence(&mut self, field: &'a Field, module: usize) -> Option<f64> {
        let FieldValue::Expr(e) = &field.value else {
            return self.no_framing(
                field.span,
                "`silence` must be a duration",
                "not a duration",
                "write it as in `silence: 5 ms`",
            );
        };
        let node = self.duration_node(e, &mut Scope::module(module), "silence")?;
        let most = 1.0;
        match self.lab.known(node).filter(|s| *s <= most) {
            Some(silence) => Some(silence),
            None => self.no_framing(e.span, "`silence` must be at most 1 s", "too long", "it delays every message"),
        }
    }

    /// Whether frames of this layout can be told apart and judged.
    fn fits_layout(
        &mut self,
        layout: &[Part],
        at: Span,
        carries: Carries,
        length: Option<&(Counted, Span)>,
        check: Option<&(Check, Span)>,
    ) -> Option<()> {
        let place = |mark: Mark| layout.iter().position(|p| p.mark() == Some(mark));
        let data = place(Mark::Data)?;
        match (place(Mark::Length), length) {
            (None, None) => {}
            (Some(_), None) => {
                return self.no_framing(
                    at,
                    "the frame has a length, but `length` is missing",
                    "here",
                    "add `length: count(data)`",
                );
            }
            (None, Some((_, span))) => {
                return self.no_framing(
                    *span,
                    "`length` is given, but the frame has no `{length}`",
                    "never sent",
                    "add `{length :u8}`",
                );
            }
            (Some(place), Some((counted, span))) => {
                if place > data {
                    return self.no_framing(
                        at,
                        "a length must come before the part that it counts",
                        "here",
                        "put it before `{data}`",
                    );
                }
                if !counted.over.parts(layout).is_some_and(|parts| parts.contains(&data)) {
                    return self.no_framing(
                        *span,
                        "the length does not count the message",
                        "not over `data`",
                        "write it as in `count(data)`",
                    );
                }
            }
        }
        match (place(Mark::Check), check) {
            (None, None) => {}
            (Some(_), None) => {
                return self.no_framing(
                    at,
                    "the frame has a checksum, but `check` is missing",
                    "here",
                    "add `check: sum8(data)`",
                );
            }
            (None, Some((_, span))) => {
                return self.no_framing(
                    *span,
                    "`check` is given, but the frame has no `{check}`",
                    "never sent",
                    "add `{check :u8}`",
                );
            }
            (Some(place), Some((check, span))) => {
                let parts = check.over.parts(layout);
                if !parts.is_some_and(|mut parts| parts.any(|part| part != place)) {
                    return self.no_framing(
                        *span,
                        "this checksum covers no part of the frame",
                        "empty range",
                        "write it as in `sum8(begin .. data)`",
                    );
                }
                let bits = check.sum.bits();
                let Part::Check(form) = &layout[place] else { return None };
                if form.most() < 2f64.powi(bits.into()) - 1.0 || form.scale != 1.0 {
                    let headline = format!("a checksum of {bits} bits does not fit its format");
                    return self.no_framing(
                        at,
                        &headline,
                        "too narrow",
                        "write it as in `{check :u16 big}` or `{check :u16 hex}`",
                    );
                }
            }
        }
        if length.is_some() || carries == Carries::Modbus {
            return Some(());
        }
        self.fits_end(&layout[data + 1..], at, carries)
    }

    /// Whether the end of a message can be seen by what stands behind it.
    fn fits_end(&mut self, behind: &[Part], at: Span, carries: Carries) -> Option<()> {
        let help = "give frames a length, as in `{length :u8}` with `length: count(data)`";
        let (mark, check) = match behind {
            [Part::Fixed(mark), ..] => (mark, None),
            [Part::Check(check), Part::Fixed(mark), ..] => (mark, Some(check)),
            _ => {
                let help = "add bytes after it, as in `\"{data}\\r\"`, or a length before it";
                return self.no_framing(at, "the end of a message is undefined", "no end mark and no length", help);
            }
        };
        if carries == Carries::Bytes {
            return self.no_framing(at, "a message may contain the byte of its end mark", "no length", help);
        }
        if check.is_some_and(Form::is_raw) {
            return self.no_framing(at, "the checksum may contain the byte of the end mark", "no length", help);
        }
        if mark.iter().all(|b| b.is_ascii_alphanumeric() || b"+-. ".contains(b)) {
            let help = "use a line end, a control character or another sign that messages never contain";
            return self.no_framing(
                at,
                "a message may contain the signs of its end mark",
                "the end mark looks like a number or word",
                help,
            );
        }
        Some(())
    }

    fn no_framing<T>(&mut self, at: Span, headline: &str, label: &str, help: &str) -> Option<T> {
        self.lab.report(Diagnostic::error(codes::FRAMING, at, headline.to_owned(), label).help(help));
        None
    }
}

fn is_whole(form: &Form) -> bool {
    let whole = match form.encoding {
        Encoding::Decimal { digits, .. } => digits.unwrap_or(0) == 0,
        Encoding::Bytes { kind, .. } => kind != Kind::Float,
        Encoding::Bcd { .. } => true,
        Encoding::Significant(_) => false,
    };
    whole && form.scale == 1.0
}

fn word(field: &Field) -> Option<&str> {
    match &field.value {
        FieldValue::Expr(e) => name_of(e),
        _ => None,
    }
}

fn name_of(e: &Expr) -> Option<&str> {
    match &*e.kind {
        ExprKind::Name(name) => Some(&name.text),
        _ => None,
    }
}

fn number(e: &Expr) -> Option<f64> {
    match &*e.kind {
        ExprKind::Number(n) => Some(*n),
        _ => None,
    }
}

fn listed(words: &[&str]) -> String {
    words.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", ")
}
