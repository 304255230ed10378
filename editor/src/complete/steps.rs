//! What can be written in a block of steps, and in calls.

use std::collections::BTreeSet;

use matterix_lang::lower::FAILURES;
use matterix_lang::names::DeclId;
use matterix_lang::semantic_index::Sort;

use super::context::{Context, LABELS};
use super::values::{Place, Wanted};
use super::{Completion, Offer, Offers, follow};
use crate::index::{Def, DefId, Kind};

/// Steps of the language.
pub(crate) const STEPS: &[(&str, &str)] = &[
    ("let", "let ${1:name} = $0"),
    ("var", "var ${1:name} = $0"),
    ("wait", "wait ${1:10 s}"),
    ("wait until", "wait until ${1:condition} timeout ${2:10 min}"),
    ("hold", "hold ${1:condition} for ${2:10 min} timeout ${3:1 h}"),
    ("keep", "keep ${1:condition} {\n    $0\n}"),
    ("step", "step ${1:name} {\n    $0\n}"),
    ("within", "within ${1:5 min} after ${2:name}.end {\n    $0\n}"),
    ("if", "if ${1:condition} {\n    $0\n}"),
    ("repeat", "repeat ${1:3} times {\n    $0\n}"),
    ("repeat while", "repeat while ${1:condition} max ${2:60} {\n    $0\n}"),
    ("for", "for ${1:x} in ${2:set} {\n    $0\n}"),
    ("sequence", "sequence {\n    $0\n}"),
    ("parallel", "parallel {\n    $0\n}"),
    ("start", "start ${1:job} = $0"),
    ("await", "await ${1:job}"),
    ("claim", "claim ${1:thing} {\n    $0\n}"),
    ("try", "try {\n    $0\n} else {\n}"),
    ("fail", "fail ${1:name} \"${2:text}\""),
    ("expect", "expect $0"),
    ("record", "record ${1:value} every ${2:1 s}"),
    ("note", "note \"$0\""),
    ("ask", "ask \"$0\""),
    ("return", "return $0"),
    ("retry", "retry ${1:2}"),
];

/// Lines of a law.
const LAWS: &[(&str, &str)] = &[
    ("let", "let ${1:name} = $0"),
    ("for", "for ${1:x} in ${2:set} {\n    $0\n}"),
    ("if", "if ${1:condition} {\n    $0\n}"),
    ("move", "move(${1:rate}, from: ${2:source}, to: ${3:sink})"),
];

/// Values of the language.
const VALUES: &[&str] = &["true", "false", "nothing", "unlimited", "elapsed", "not"];

/// Folds.
pub(crate) const FOLDS: &[&str] = &["sum", "product", "min", "max", "all", "any"];

impl Place<'_> {
    /// The beginning of a step.
    pub(crate) fn step(&self, out: &mut Offers) {
        for (word, text) in STEPS {
            self.keyword(word, text, 30, out);
        }
        self.verbs(&[], out);
    }

    pub(crate) fn law(&self, out: &mut Offers) {
        for (word, text) in LAWS {
            self.keyword(word, text, 20, out);
        }
        self.locals(&|_, _| true, 10, out);
    }

    /// Verbs that go on after these words: skills that are seen, and commands that something here can do.
    fn verbs(&self, words: &[&str], out: &mut Offers) {
        let Some(module) = self.index.module_of(self.file) else { return };
        let begin = words.iter().map(|w| format!("{w} ")).collect::<String>();
        let able: BTreeSet<DeclId> = self
            .things()
            .iter()
            .flat_map(|t| match t {
                Sort::Thing(kinds, _) => kinds.clone(),
                _ => Vec::new(),
            })
            .flat_map(|k| self.index.ancestors(k).to_vec())
            .collect();
        let mut there: BTreeSet<String> = out.all.iter().filter(|c| c.def.is_some()).map(|c| c.label.clone()).collect();
        for (verb, def) in self.index.all_verbs() {
            let Some(rest) = verb.strip_prefix(begin.as_str()) else { continue };
            let seen = match self.index.def(def).kind {
                Kind::Skill => self.index.lookup(module, verb) == Some(def),
                _ => {
                    let owner = self.index.def(def).owner.and_then(|o| self.index.decl_of(o));
                    owner.is_some_and(|o| able.contains(&o))
                }
            };
            if seen && there.insert(rest.to_string()) {
                let docs = self.index.def(def).docs.first().cloned().unwrap_or_default();
                let detail = if docs.is_empty() { self.index.form(def) } else { docs };
                let own = u8::from(self.index.is_library(self.index.def(def).span.file));
                let text = if words.is_empty() { self.call_form(def) } else { rest.to_string() };
                let kind = Offer::Def(self.index.def(def).kind);
                out.all.push(Completion {
                    label: rest.to_string(),
                    text,
                    kind,
                    detail,
                    def: Some(def),
                    // What makes a verb whole goes before things.
                    rank: if words.is_empty() { 10 } else { 2 } + own,
                });
            }
        }
    }

    /// The things that are seen, with their kinds.
    fn things(&self) -> Vec<Sort> {
        let mut out = Offers::default();
        self.locals(&|sort, _| matches!(sort, Sort::Thing(..) | Sort::List(_)), 0, &mut out);
        let mut all: Vec<Sort> = Vec::new();
        for offer in out.all {
            let Some(def) = offer.def else { continue };
            match &self.index.def(def).sort {
                Sort::Thing(kinds, Some(full)) => {
                    all.push(Sort::Thing(self.index.built(full).unwrap_or(kinds).clone(), None));
                    // Parts do things, too: the pipette of a robot.
                    all.extend(self.index.built_parts(full).into_iter().map(|part| part.1));
                }
                Sort::List(inner) => all.push((**inner).clone()),
                other => all.push(other.clone()),
            }
        }
        all
    }

    /// Parts that fit, of things that have no more than a few such: the pipettes of a robot.
    fn parts(&self, wanted: &Sort, out: &mut Offers) {
        let mut things = Offers::default();
        self.locals(&|sort, _| matches!(sort, Sort::Thing(_, Some(_))), 0, &mut things);
        for thing in things.all {
            let Some(Sort::Thing(_, Some(full))) = thing.def.map(|def| &self.index.def(def).sort) else { continue };
            let fitting = self.index.built_parts(full).into_iter().filter(|(_, sort)| self.index.suits(sort, wanted));
            let fitting: Vec<(String, Sort)> = fitting.take(FEW + 1).collect();
            if fitting.len() > FEW {
                continue;
            }
            for (name, sort) in fitting {
                let label =
                    name.strip_prefix(full.as_str()).map_or(name.clone(), |rest| format!("{}{rest}", thing.label));
                let (text, detail) = (label.clone(), self.index.sort_words(&sort));
                out.all.push(Completion { label, text, kind: Offer::Member, detail, def: None, rank: 6 });
            }
        }
    }

    /// A call with places to fill: its object and the prepositions that have no default.
    fn call_form(&self, def: DefId) -> String {
        let d = self.index.def(def);
        let mut out = d.name.clone();
        let mut place = 0;
        let mut fill = |out: &mut String, name: &str| {
            place += 1;
            out.push_str(&format!("${{{place}:{name}}}"));
        };
        let params: Vec<_> =
            d.inside.iter().map(|p| self.index.def(*p)).filter(|p| p.kind == Kind::Parameter).collect();
        let objects: Vec<_> = params.iter().filter(|p| p.label.is_none()).collect();
        match objects.as_slice() {
            [] if d.kind == Kind::Command => {
                out.push(' ');
                fill(&mut out, "device");
            }
            [] => {}
            [one] => {
                out.push(' ');
                fill(&mut out, &one.name);
            }
            many => {
                out.push_str(" (");
                for (i, p) in many.iter().enumerate() {
                    out.push_str(if i > 0 { ", " } else { "" });
                    fill(&mut out, &p.name);
                }
                out.push(')');
            }
        }
        let mut labels: Vec<&str> = Vec::new();
        for label in params.iter().filter_map(|p| p.label.as_deref()) {
            if !labels.contains(&label) {
                labels.push(label);
            }
        }
        for label in labels {
            let group: Vec<_> = params.iter().filter(|p| p.label.as_deref() == Some(label)).collect();
            let optional = group.iter().all(|p| self.index.text(p.whole).contains('='));
            if optional {
                continue;
            }
            out.push_str(&format!(" {label} "));
            let many = group.len() > 1;
            out.push_str(if many { "(" } else { "" });
            for (i, p) in group.iter().enumerate() {
                out.push_str(if i > 0 { ", " } else { "" });
                fill(&mut out, &p.name);
            }
            out.push_str(if many { ")" } else { "" });
        }
        if d.kind == Kind::Command && !objects.is_empty() {
            out.push_str(" by ");
            fill(&mut out, "device");
        }
        out
    }

    /// A step that has begun: more of a verb, its object, prepositions, or a value.
    pub(crate) fn in_step(&self, context: &Context<'_>, out: &mut Offers) {
        let statement = self.statement(context);
        let words: Vec<&str> = statement.iter().take_while(|t| t.is_word()).map(|t| t.text).collect();
        if words.len() == statement.len() {
            self.verbs(&words, out);
        }
        if statement.is_empty() {
            return self.verbs(&[], out);
        }
        if let Some((call, count)) = self.call(statement) {
            let rest = &statement[count..];
            let after_label = rest.last().is_some_and(|t| LABELS.contains(&t.text));
            if rest.is_empty() || after_label {
                return self.value_offers(&self.wanted(context), out);
            }
            self.labels(call, rest.iter().map(|t| t.text).collect(), out);
            return self.after_value(context, out);
        }
        let unfinished_verb = words.len() == statement.len() && !words.first().is_some_and(|w| follow::begins_step(w));
        if context.apart && !unfinished_verb && context.before.last().is_some_and(follow::ends_value) {
            return self.after_value(context, out);
        }
        match statement.last().map(|t| t.text) {
            Some("start" | "let" | "step") => {}
            Some("wait") => {
                self.keyword("until", "until ", 5, out);
                self.value_offers(&self.wanted(context), out);
            }
            Some("repeat") => {
                self.keyword("while", "while ", 5, out);
                self.value_offers(&self.wanted(context), out);
            }
            Some("await") => {
                let jobs = self.index.own_defs().filter(|(_, d)| d.kind == Kind::Job);
                jobs.for_each(|(id, d)| out.all.push(self.offer(&d.name, id, 5)));
            }
            Some("run") if statement.len() == 1 => self.globals(&[Kind::Workflow], 5, out),
            Some("on") => self.failures(out),
            Some("fail") => self.failures(out),
            _ => self.value_offers(&self.wanted(context), out),
        }
    }

    fn failures(&self, out: &mut Offers) {
        // Those of the package before those of the library.
        let rank = |d: &Def| 8 + 2 * u8::from(self.index.is_library(d.span.file));
        let all = self.index.defs().filter(|(_, d)| matches!(d.kind, Kind::Failure | Kind::Hazard));
        let mut all: Vec<_> = all.map(|(id, d)| (rank(d), id, d.name.clone())).collect();
        all.sort_by_key(|failure| failure.0);
        for (rank, id, name) in all {
            if !out.all.iter().any(|c| c.label == name) {
                out.all.push(self.offer(&name, id, rank));
            }
        }
        FAILURES.iter().for_each(|name| self.keyword(name, name, 12, out));
    }

    /// Prepositions of a call that are not there yet.
    fn labels(&self, call: DefId, there: Vec<&str>, out: &mut Offers) {
        let d = self.index.def(call);
        let mut labels: Vec<(&str, DefId)> = Vec::new();
        for (id, param) in d.inside.iter().map(|p| (*p, self.index.def(*p))) {
            if let Some(label) = param.label.as_deref()
                && !labels.iter().any(|l| l.0 == label)
            {
                labels.push((label, id));
            }
        }
        for (label, param) in labels {
            if !there.contains(&label) {
                let p = self.index.def(param);
                let detail = format!("{}: {}", p.name, self.index.sort_words(&p.sort));
                let kind = Offer::Keyword;
                out.all.push(Completion {
                    label: label.into(),
                    text: format!("{label} "),
                    kind,
                    detail,
                    def: Some(param),
                    rank: 1,
                });
            }
        }
        let takes =
            d.inside.iter().any(|p| self.index.def(*p).kind == Kind::Parameter && self.index.def(*p).label.is_none());
        if d.kind == Kind::Command && takes && !there.contains(&"by") && !out.all.iter().any(|c| c.label == "by") {
            self.keyword("by", "by ", 2, out);
        }
        if d.inside.iter().any(|p| self.index.def(*p).kind == Kind::Option) {
            self.keyword("{ }", "{ $0 }", 3, out);
        }
    }

    /// Values: the words that are expected, then things and other names that fit, then everything else.
    pub(crate) fn value_offers(&self, wanted: &Wanted, out: &mut Offers) {
        for word in &wanted.words {
            let name = self.index.def(*word).name.clone();
            if !out.all.iter().any(|c| c.label == name) {
                out.all.push(self.offer(&name, *word, 0));
            }
        }
        if let Some(Sort::Word(words)) = &wanted.sort {
            for word in words.iter() {
                if !out.all.iter().any(|c| c.label == *word) {
                    self.keyword(word, word, 0, out);
                }
            }
        }
        if wanted.sort == Some(Sort::Truth) {
            ["true", "false"].iter().for_each(|w| self.keyword(w, w, 0, out));
        }
        let fits = |sort: &Sort| wanted.sort.as_ref().is_none_or(|w| self.index.suits(sort, w));
        self.locals(&|sort, _| fits(sort), 5, out);
        if let Some(sort @ Sort::Thing(..)) = &wanted.sort {
            self.parts(sort, out);
        }
        match &wanted.sort {
            Some(Sort::Species | Sort::Concentration) => self.globals(&[Kind::Species, Kind::Solution], 10, out),
            Some(Sort::Material) => self.globals(&[Kind::Material], 10, out),
            Some(Sort::Reaction) => self.globals(&[Kind::Reaction], 10, out),
            Some(Sort::Thing(..) | Sort::Frame | Sort::List(_)) => {}
            _ => {
                self.globals(&[Kind::Constant, Kind::Table, Kind::Function, Kind::Relation], 25, out);
                FOLDS.iter().for_each(|w| self.keyword(w, &format!("{w}(${{1:x}} in ${{2:set}}: $0)"), 35, out));
            }
        }
        // What does not fit itself may have a member that does.
        self.locals(
            &|sort, kind| matches!(sort, Sort::Thing(..) | Sort::Lab(_)) || matches!(kind, Kind::Variable | Kind::Step),
            15,
            out,
        );
        VALUES.iter().for_each(|w| {
            if !out.all.iter().any(|c| c.label == *w) {
                self.keyword(w, w, 36, out);
            }
        });
    }
}

impl crate::Index {
    /// Whether a value of one kind can stand where another is expected.
    pub(crate) fn suits(&self, sort: &Sort, wanted: &Sort) -> bool {
        match (sort, wanted) {
            (_, Sort::Any) => true,
            (Sort::Any, _) => false,
            (Sort::Thing(kinds, _), Sort::Thing(asked, _)) => {
                asked.iter().all(|a| kinds.iter().any(|k| self.ancestors(*k).contains(a)))
            }
            (one, Sort::List(inner)) => match one {
                Sort::List(items) => self.suits(items, inner),
                one => self.suits(one, inner),
            },
            (Sort::Quantity(a, p), Sort::Quantity(b, q)) => a.agrees(b) && p == q,
            (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
        }
    }

    /// The parts of a thing of a lab, as they were built, with their full names.
    fn built_parts(&self, full: &str) -> Vec<(String, Sort)> {
        let begin = format!("{full}.");
        let labs = self.labs_built();
        let parts =
            labs.flat_map(|lab| lab.range(begin.clone()..).take_while(|n| n.0.starts_with(&begin)).take(MOST_PARTS));
        parts.map(|(name, kinds)| (name.clone(), Sort::Thing(kinds.clone(), None))).collect()
    }
}

/// Of a thing with more parts that fit none is offered by name.
const FEW: usize = 8;

/// So many parts of a thing are looked at.
const MOST_PARTS: usize = 200;
