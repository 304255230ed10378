//! The grammar as people write grammars: without line ends, what is only looked at, and what is there for error messages.

use std::collections::{BTreeMap, BTreeSet};

use pest_meta::ast::{Expr, Rule, RuleType};
use pest_meta::parser;

/// Rules that are not shown: blanks, line ends, and which words are no names.
const LEFT_OUT: [&str; 10] =
    ["WHITESPACE", "COMMENT", "bom", "nl", "end", "field_end", "reserved", "notunit", "missing_value", "EOI"];

/// Names of sets of characters.
const SETS: [(&str, &str); 4] =
    [("ASCII_DIGIT", "digit"), ("ASCII_ALPHA", "letter"), ("ASCII_ALPHANUMERIC", "(letter | digit)"), ("ANY", "any")];

/// The rules of grammars by name.
pub struct Grammar(BTreeMap<String, Rule>);

/// What a rule comes to: its text, and whether that is one symbol or has to stand in brackets beside others.
#[derive(Clone)]
struct Shown {
    text: String,
    binds: Binds,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binds {
    Choice,
    Sequence,
    Repeated,
    Symbol,
}

impl Shown {
    fn symbol(text: impl Into<String>) -> Self {
        Shown { text: text.into(), binds: Binds::Symbol }
    }

    fn within(&self, least: Binds) -> String {
        if self.binds >= least { self.text.clone() } else { format!("({})", self.text) }
    }
}

impl Grammar {
    /// Reads files of rules.
    pub fn read(texts: &[&str]) -> Self {
        let text = texts.concat();
        let pairs = parser::parse(parser::Rule::grammar_rules, &text).unwrap_or_else(|e| panic!("{e}"));
        let rules = parser::consume_rules(pairs).unwrap_or_else(|e| panic!("{e:?}"));
        Grammar(rules.into_iter().map(|r| (r.name.clone(), r)).collect())
    }

    /// The rules that `file` leads to, in the order in which a text writes them, with its headings.
    pub fn show(&self, text: &str) -> String {
        let mut reached = BTreeSet::new();
        self.reach("file", &mut reached);
        let mut loose = BTreeSet::new();
        self.loosen("file", &mut loose);
        let mut out = String::new();
        let mut heading = None;
        for line in text.lines() {
            if let Some(title) = line.strip_prefix("// ---- ") {
                heading = Some(title);
            }
            let name = line.split([' ', '=']).next().unwrap_or_default();
            let Some(rule) = self.0.get(name).filter(|r| reached.contains(&r.name)) else { continue };
            if self.inlined(name).is_some() {
                continue;
            }
            let Some(body) = self.expr(&rule.expr) else { continue };
            if let Some(title) = heading.take() {
                out += &format!("{}/* {title} */\n", if out.is_empty() { "" } else { "\n" });
            }
            let sign = if loose.contains(name) { "::=" } else { ":==" };
            out += &wrapped(&format!("{name} {sign} {}", body.text));
        }
        out
    }

    /// The words that a rule of fixed words stands for.
    pub fn words(&self, name: &str) -> Vec<String> {
        let mut out = self.0.get(name).map(|r| spelt(&r.expr)).unwrap_or_default();
        out.sort();
        out.dedup();
        out
    }

    fn reach(&self, name: &str, reached: &mut BTreeSet<String>) {
        if left_out(name) || !reached.insert(name.to_string()) {
            return;
        }
        let Some(rule) = self.0.get(name) else { return };
        let mut names = Vec::new();
        collect(&rule.expr, &mut names);
        names.iter().for_each(|n| self.reach(n, reached));
    }

    /// Rules between whose parts blanks may stand: those that say so, and what stands in others of that kind.
    fn loosen(&self, name: &str, loose: &mut BTreeSet<String>) {
        let Some(rule) = self.0.get(name).filter(|r| !left_out(&r.name)) else { return };
        if matches!(rule.ty, RuleType::Atomic | RuleType::CompoundAtomic) {
            let mut resets = Vec::new();
            self.resets(name, &mut BTreeSet::new(), &mut resets);
            resets.iter().for_each(|n| self.loosen(n, loose));
        } else if loose.insert(name.to_string()) {
            let mut names = Vec::new();
            collect(&rule.expr, &mut names);
            names.iter().for_each(|n| self.loosen(n, loose));
        }
    }

    /// Rules that let blanks in again, below one that does not.
    fn resets(&self, name: &str, seen: &mut BTreeSet<String>, out: &mut Vec<String>) {
        let Some(rule) = self.0.get(name).filter(|_| seen.insert(name.to_string())) else { return };
        let mut names = Vec::new();
        collect(&rule.expr, &mut names);
        for name in names {
            match self.0.get(&name).map(|r| r.ty) {
                Some(RuleType::NonAtomic) => out.push(name),
                _ => self.resets(&name, seen, out),
            }
        }
    }

    /// What stands for a rule wherever it is named, where that is one text or one other rule.
    fn inlined(&self, name: &str) -> Option<Shown> {
        match core(&self.0.get(name)?.expr)? {
            Expr::Str(text) => quoted(text),
            other => self.expr(other),
        }
    }

    fn expr(&self, e: &Expr) -> Option<Shown> {
        let suffixed = |inner: &Expr, sign: &str| {
            self.expr(inner)
                .map(|s| Shown { text: format!("{}{sign}", s.within(Binds::Symbol)), binds: Binds::Repeated })
        };
        match e {
            Expr::Str(text) => quoted(text),
            Expr::Insens(text) => {
                Some(Shown { text: format!("\"{text}\" | \"{}\"", text.to_uppercase()), binds: Binds::Choice })
            }
            Expr::Range(a, b) => Some(Shown::symbol(format!("\"{a}\"..\"{b}\""))),
            Expr::Ident(name) => {
                if left_out(name) {
                    return None;
                }
                if let Some((_, set)) = SETS.iter().find(|(n, _)| n == name) {
                    return Some(Shown::symbol(*set));
                }
                Some(self.inlined(name).unwrap_or_else(|| Shown::symbol(name.clone())))
            }
            Expr::PosPred(_) | Expr::NegPred(_) => None,
            Expr::Seq(..) => {
                let mut parts = Vec::new();
                sequence(e, &mut parts);
                let shown: Vec<Shown> = parts.into_iter().filter_map(|p| self.expr(p)).collect();
                match shown.as_slice() {
                    [] => None,
                    [one] => Some(one.clone()),
                    several => {
                        let text: Vec<String> = several.iter().map(|s| s.within(Binds::Sequence)).collect();
                        Some(Shown { text: text.join(" "), binds: Binds::Sequence })
                    }
                }
            }
            Expr::Choice(..) => {
                let mut parts = Vec::new();
                choice(e, &mut parts);
                let mut texts: Vec<String> = Vec::new();
                let mut last = None;
                for shown in parts.into_iter().filter_map(|p| self.expr(p)) {
                    if !texts.contains(&shown.text) {
                        texts.push(shown.text.clone());
                        last = Some(shown);
                    }
                }
                match texts.len() {
                    0 => None,
                    1 => last,
                    _ => Some(Shown { text: texts.join(" | "), binds: Binds::Choice }),
                }
            }
            Expr::Opt(inner) => suffixed(inner, "?"),
            Expr::Rep(inner) | Expr::RepMax(inner, _) => suffixed(inner, "*"),
            Expr::RepOnce(inner) | Expr::RepMin(inner, _) => suffixed(inner, "+"),
            _ => None,
        }
    }
}

fn left_out(name: &str) -> bool {
    LEFT_OUT.contains(&name) || name.starts_with("bad_") || name == "SOI"
}

/// Whether nothing of an expression is shown.
fn dropped(e: &Expr) -> bool {
    match e {
        Expr::PosPred(_) | Expr::NegPred(_) => true,
        Expr::Str(text) => text == "\n",
        Expr::Ident(name) => left_out(name),
        Expr::Seq(a, b) | Expr::Choice(a, b) => dropped(a) && dropped(b),
        Expr::Opt(a) | Expr::Rep(a) | Expr::RepOnce(a) | Expr::RepMax(a, _) | Expr::RepMin(a, _) => dropped(a),
        _ => false,
    }
}

/// The one text or name that is left of an expression.
fn core(e: &Expr) -> Option<&Expr> {
    match e {
        Expr::Str(_) | Expr::Ident(_) => Some(e).filter(|e| !dropped(e)),
        Expr::Seq(a, b) | Expr::Choice(a, b) => match (dropped(a), dropped(b)) {
            (true, false) => core(b),
            (false, true) => core(a),
            _ => None,
        },
        _ => None,
    }
}

/// A text as a symbol; nothing for a line end.
fn quoted(text: &str) -> Option<Shown> {
    match text {
        "\n" => None,
        "\"" => Some(Shown::symbol("'\"'")),
        other => Some(Shown::symbol(format!("\"{other}\""))),
    }
}

fn sequence<'a>(e: &'a Expr, out: &mut Vec<&'a Expr>) {
    match e {
        Expr::Seq(a, b) => {
            sequence(a, out);
            sequence(b, out);
        }
        other => out.push(other),
    }
}

fn choice<'a>(e: &'a Expr, out: &mut Vec<&'a Expr>) {
    match e {
        Expr::Choice(a, b) => {
            choice(a, out);
            choice(b, out);
        }
        other => out.push(other),
    }
}

/// The names in an expression, without those that are only looked at.
fn collect(e: &Expr, out: &mut Vec<String>) {
    match e {
        Expr::Ident(name) => out.push(name.clone()),
        Expr::Seq(a, b) | Expr::Choice(a, b) => {
            collect(a, out);
            collect(b, out);
        }
        Expr::Opt(a) | Expr::Rep(a) | Expr::RepOnce(a) | Expr::RepMax(a, _) | Expr::RepMin(a, _) => collect(a, out),
        _ => {}
    }
}

/// All texts that an expression without repetitions stands for.
fn spelt(e: &Expr) -> Vec<String> {
    match e {
        Expr::Str(text) => vec![text.clone()],
        Expr::Seq(a, b) => {
            let ends = spelt(b);
            spelt(a).iter().flat_map(|x| ends.iter().map(move |y| format!("{x}{y}"))).collect()
        }
        Expr::Choice(a, b) => [spelt(a), spelt(b)].concat(),
        Expr::Opt(a) => [vec![String::new()], spelt(a)].concat(),
        _ => vec![String::new()],
    }
}

/// A rule on lines of at most 120 characters.
fn wrapped(rule: &str) -> String {
    let mut out = String::new();
    let mut line = String::new();
    for word in rule.split(' ') {
        if !line.is_empty() && line.len() + word.len() >= 120 {
            out += &format!("{}\n", line.trim_end());
            line = "   ".to_string();
        }
        line += &format!("{}{word}", if line.is_empty() { "" } else { " " });
    }
    format!("{out}{}\n", line.trim_end())
}

#[test]
fn rules_are_shown_as_people_write_them() {
    let text = "// ---- all\nfile = { SOI ~ nl ~ item* ~ EOI }\nnl = _{ \"\\n\"* }\nitem = _{ &kw_a ~ form ~ (end | bad_rest) }\n\
        form = { kw_a ~ nl ~ (name ~ comma)+ | name ~ !\"x\" }\nend = { \";\" }\nbad_rest = { ANY }\nkw_a = @{ \"a\" ~ !\"b\" }\n\
        comma = { \",\" }\nname = @{ ASCII_ALPHA+ }\nwords = { \"i\" ~ (\"n\" ~ \"to\"? | \"s\") }\n";
    let grammar = Grammar::read(&[text]);
    let shown = "/* all */\nfile ::= form*\nform ::= \"a\" (name \",\")+ | name\nname :== letter+\n";
    assert_eq!(grammar.show(text), shown);
    assert_eq!(grammar.words("words"), ["in", "into", "is"]);
}
