//! What kind of value a few tokens have, and what is expected at a cursor.

use matterix_ir::FileId;
use matterix_lang::semantic_index::Sort;

use super::context::{Context, Token, primary, unnamed};
use crate::index::{DefId, Kind, Meaning};
use crate::{Drift, Index};

/// What is expected at a cursor.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wanted {
    /// The kind of value.
    pub(crate) sort: Option<Sort>,
    /// The words it may be.
    pub(crate) words: Vec<DefId>,
}

impl Wanted {
    fn of(index: &Index, def: DefId) -> Wanted {
        let d = index.def(def);
        Wanted { sort: Some(d.sort.clone()), words: d.words.clone() }
    }
}

/// A text with a cursor, and the place in the last analysis that it comes from.
pub(crate) struct Place<'i> {
    pub(crate) index: &'i Index,
    pub(crate) file: FileId,
    /// The cursor in the text of the last analysis.
    pub(crate) offset: usize,
    /// What the text before the cursor binds, outermost first.
    pub(crate) bound: Vec<(String, Sort)>,
}

impl<'i> Place<'i> {
    /// A place of the current text of a file.
    pub(crate) fn of(index: &'i Index, file: FileId, text: &str, at: usize) -> Place<'i> {
        let drift = Drift::between(index.sources().get(file).map_or("", |s| &s.text), text);
        Place { index, file, offset: drift.back(at), bound: Vec::new() }
    }

    /// What a name stands for here, with its kind of value.
    pub(crate) fn named(&self, name: &str) -> Option<(DefId, Sort)> {
        let found = self.index.named_at(self.file, self.offset, name);
        // A thing of any lab will do where the text around the cursor was not read.
        let thing = || self.index.own_defs().find(|(_, d)| d.kind == Kind::Thing && d.name == name).map(|d| d.0);
        let def = found.or_else(thing)?;
        let d = self.index.def(def);
        let sort = match (&d.sort, d.kind) {
            (Sort::Thing(kinds, Some(full)), _) => {
                Sort::Thing(self.index.built(full).unwrap_or(kinds).clone(), Some(full.clone()))
            }
            (sort, _) => sort.clone(),
        };
        Some((def, sort))
    }

    /// What kind of value a name with members, places and arguments has.
    pub(crate) fn value(&self, tokens: &[Token<'_>]) -> Option<(Option<DefId>, Sort)> {
        let (first, mut rest) = tokens.split_first()?;
        let bound = self.bound.iter().rev().find(|b| b.0 == first.text);
        let (mut def, mut sort) = match (first.text, bound) {
            (_, Some((_, sort))) => (None, sort.clone()),
            ("self", None) => (None, self.this()?),
            ("elapsed", None) => (None, self.index.duration()),
            ("(", None) => return None,
            (name, None) => self.named(name).map(|(d, s)| (Some(d), s))?,
        };
        while let Some((token, after)) = rest.split_first() {
            match token.text {
                "." => {
                    let Some((name, after)) = after.split_first() else { break };
                    let member = self.index.member_of(&sort, name.text)?;
                    sort = member.sort;
                    def = match member.meaning {
                        Meaning::Def(def) => Some(def),
                        _ => None,
                    };
                    rest = after;
                }
                "[" | "(" => {
                    let (open, close) = if token.text == "[" { ("[", "]") } else { ("(", ")") };
                    let mut depth = 1;
                    let end = after.iter().position(|t| {
                        depth += i32::from(t.text == open) - i32::from(t.text == close);
                        depth == 0
                    })?;
                    let ranged = after[..end].iter().any(|t| t.text == "..");
                    if open == "[" {
                        let element = self.index.element_of(&sort).unwrap_or(Sort::Concentration);
                        sort = if ranged { Sort::List(Box::new(element)) } else { element };
                        def = None;
                    }
                    rest = &after[end + 1..];
                }
                _ => break,
            }
        }
        Some((def, sort))
    }

    /// The thing whose members are seen without a dot.
    pub(crate) fn this(&self) -> Option<Sort> {
        let region = self.index.region(self.file, self.offset)?;
        Some(Sort::Thing(vec![self.index.decl_of(region.this?)?], None))
    }

    /// The call of a skill or command that the tokens begin with: what it may mean, best first, and the words of its verb.
    pub(crate) fn call(&self, statement: &[Token<'_>]) -> Option<(DefId, usize)> {
        let module = self.index.module_of(self.file)?;
        let words = statement.iter().take_while(|t| t.is_word()).count();
        for count in (1..=words.min(5)).rev() {
            let verb = statement[..count].iter().map(|t| t.text).collect::<Vec<_>>().join(" ");
            let all = self.index.meant_by(module, &verb);
            if all.is_empty() {
                continue;
            }
            let object = self.value(&statement[count..]).map(|v| v.1).unwrap_or(Sort::Any);
            let by = statement.iter().position(|t| t.text == "by").and_then(|at| self.value(&statement[at + 1..]));
            let able =
                |d: &&DefId| self.index.can(&object, **d) || by.as_ref().is_some_and(|b| self.index.can(&b.1, **d));
            let commands = all.iter().filter(|d| self.index.def(**d).kind == Kind::Command);
            let fits = commands.into_iter().find(able);
            return fits.or(all.first()).map(|d| (*d, count));
        }
        None
    }

    /// Parameters of a skill or command behind a preposition, or those of its object.
    pub(crate) fn group(&self, call: DefId, label: Option<&str>) -> Vec<DefId> {
        let inside = self.index.def(call).inside.iter().copied();
        inside
            .filter(|p| self.index.def(*p).kind == Kind::Parameter && self.index.def(*p).label.as_deref() == label)
            .collect()
    }

    /// What is expected at the cursor.
    pub(crate) fn wanted(&self, context: &Context<'_>) -> Wanted {
        let none = Wanted::default();
        // An argument of a function, or a value in round or square brackets.
        if let Some(open) = context.open.last().filter(|o| o.bracket == '(')
            && let Some(name) = open.head.last().filter(|t| t.is_word() && t.end() == open.at)
            && let Some(def) = self.function(name.text)
        {
            let given = context.before.iter().filter(|t| t.text == ",").count();
            let named = context
                .before
                .iter()
                .rev()
                .take_while(|t| t.text != ",")
                .last()
                .filter(|_| context.last() == Some(":"));
            let params = &self.index.def(def).inside;
            let param = match named {
                Some(name) => params.iter().find(|p| self.index.def(**p).name == name.text),
                None => params.get(given),
            };
            return param.map_or(none, |p| Wanted::of(self.index, *p));
        }
        let tokens = &context.before;
        if self.is_duration(tokens) {
            return Wanted { sort: Some(self.index.duration()), words: Vec::new() };
        }
        // What it is compared with.
        if let Some(at) = tokens.iter().rposition(|t| {
            matches!(t.text, "==" | "!=" | "<" | "<=" | ">" | ">=" | "is" | "=" | "+=" | "-=")
                || t.text == "in" && !self.is_label(context)
        }) && tokens[at + 1..].iter().all(|t| {
            t.is_number()
                || t.text == ".."
                || t.text == "["
                || t.is_word()
                || t.text == ","
                || t.text == "/"
                || t.text == "*"
        }) {
            let typed = tokens[..at].iter().position(|t| t.text == ":").filter(|_| tokens[at].text == "=");
            if let Some(colon) = typed {
                return Wanted { sort: tokens.get(colon + 1).and_then(|t| self.type_named(t.text)), words: Vec::new() };
            }
            if let Some((def, sort)) = self.value(primary(&tokens[..at])) {
                let mut words = def.map(|d| self.index.def(d).words.clone()).unwrap_or_default();
                if words.is_empty()
                    && let Sort::Thing(kinds, _) = &sort
                {
                    words =
                        self.index.members_of(kinds).iter().flat_map(|d| self.index.def(*d).words.clone()).collect();
                }
                return Wanted { sort: Some(sort), words };
            }
            return none;
        }
        // A field or an option.
        if let Some(colon) = tokens.iter().rposition(|t| t.text == ":")
            && colon > 0
            && let Some(def) = self.field(context, tokens[colon - 1].text)
        {
            return Wanted::of(self.index, def);
        }
        if let Some(sort) = self.setting(context) {
            return Wanted { sort: Some(sort), words: Vec::new() };
        }
        // An argument of a call.
        if let Some((call, words)) = self.call(self.statement(context)) {
            let statement = self.statement(context);
            let label =
                statement[words..].iter().rev().find(|t| super::context::LABELS.contains(&t.text)).map(|t| t.text);
            let group = self.group(call, label);
            if let Some(param) = group.first() {
                return Wanted::of(self.index, *param);
            }
            let def = self.index.def(call);
            if label == Some("by") || (label.is_none() && def.kind == Kind::Command) {
                let kind = def.owner.and_then(|o| self.index.decl_of(o));
                return Wanted { sort: kind.map(|k| Sort::Thing(vec![k], None)), words: Vec::new() };
            }
        }
        match tokens.iter().rev().find(|t| t.is_word()).map(|t| t.text) {
            Some("wait" | "timeout" | "every" | "within" | "for") => {
                Wanted { sort: Some(self.index.duration()), words: Vec::new() }
            }
            _ => none,
        }
    }

    /// Whether the last clause of a step asks for a time, and nothing but a number was given yet.
    fn is_duration(&self, tokens: &[Token<'_>]) -> bool {
        let Some(at) = tokens.iter().rposition(|t| t.is_word()) else { return false };
        let given = tokens[at + 1..].iter().all(|t| t.is_number());
        let first = tokens.first().map_or("", |t| t.text);
        given
            && match tokens[at].text {
                "timeout" | "every" => at > 0,
                "for" => first == "hold",
                "within" | "wait" => at == 0,
                _ => false,
            }
    }

    /// What kind of value a setting in the lines of a lab has.
    fn setting(&self, context: &Context<'_>) -> Option<Sort> {
        let [name, colon, ..] = context.before.as_slice() else { return None };
        let in_lab = context.block().is_some_and(|open| open.head.first().is_some_and(|t| t.text == "lab"));
        if !in_lab || colon.text != ":" {
            return None;
        }
        // The one setting that every lab has.
        if name.text == "ambient" {
            return Some(Sort::Quantity(self.index.units().named("Temperature"), true));
        }
        // A number whose unit is still to come says nothing.
        let known = self.index.setting(name.text).map(|def| self.index.def(def).sort.clone());
        known.filter(|sort| !matches!(sort, Sort::Any) && *sort != Sort::number())
    }

    fn is_label(&self, context: &Context<'_>) -> bool {
        self.call(self.statement(context)).is_some()
    }

    /// The tokens of the call at the cursor, without what stands before it in its line.
    pub(crate) fn statement<'a, 't>(&self, context: &'a Context<'t>) -> &'a [Token<'t>] {
        let tokens = match context.open.last() {
            Some(open) if matches!(open.bracket, '(' | '[') => &open.head,
            _ => &context.before,
        };
        let call = unnamed(tokens);
        match tokens.first() {
            Some(first) if first.text == "start" && call.len() == tokens.len() => {
                &tokens[tokens.iter().position(|t| t.text == "=").map_or(0, |at| at + 1)..]
            }
            _ => call,
        }
    }

    /// The function of a name.
    pub(crate) fn function(&self, name: &str) -> Option<DefId> {
        let module = self.index.module_of(self.file)?;
        let def = self.index.lookup(module, name)?;
        matches!(self.index.def(def).kind, Kind::Function | Kind::Relation).then_some(def)
    }

    /// What a key in braces is: an option of the call before them, or a member of the type.
    pub(crate) fn field(&self, context: &Context<'_>, key: &str) -> Option<DefId> {
        let fields = self.fields(context);
        fields.into_iter().find(|d| self.index.def(*d).name == key)
    }

    /// What can be given in the innermost braces.
    pub(crate) fn fields(&self, context: &Context<'_>) -> Vec<DefId> {
        let Some(open) = context.block() else { return Vec::new() };
        // Braces in braces: `{ contents: { air: ... } }`.
        let head = &open.head;
        if head.first().is_some_and(|t| t.text == "asset") {
            let extends = head.iter().skip_while(|t| t.text != ":").filter(|t| t.is_word());
            let kinds: Vec<_> = extends.filter_map(|t| self.kind(t.text)).collect();
            return self.params_of(&kinds);
        }
        let literal = head.iter().rposition(|t| t.text == "=" || t.text == ":").map(|at| &head[at + 1..]);
        if let Some(kind) = literal.and_then(|l| l.first()).and_then(|t| self.kind(t.text)) {
            return self.params_of(&[kind]);
        }
        if head.first().is_some_and(|t| t.text == "run" || t.text == "include") {
            let of = head.get(1).and_then(|t| self.index.named_at(self.file, self.offset, t.text));
            let inside = of.map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
            return inside.into_iter().filter(|d| self.index.def(*d).kind == Kind::Parameter).collect();
        }
        if head.first().is_some_and(|t| t.text == "between") {
            return self.pairs();
        }
        if let Some((call, _)) = self.call(unnamed(head)) {
            let inside = self.index.def(call).inside.iter().copied();
            return inside.filter(|d| self.index.def(*d).kind == Kind::Option).collect();
        }
        Vec::new()
    }

    /// What can be stated of two things of a lab: functions of two things, and relations that have no definition.
    fn pairs(&self) -> Vec<DefId> {
        let Some(module) = self.index.module_of(self.file) else { return Vec::new() };
        let of_two = |def: &DefId| {
            let d = self.index.def(*def);
            let params: Vec<&Sort> = d.inside.iter().map(|p| &self.index.def(*p).sort).collect();
            let things = matches!(params.as_slice(), [Sort::Thing(..), Sort::Thing(..)]);
            let open = d.kind == Kind::Function || d.kind == Kind::Relation && !self.index.text(d.whole).contains('=');
            things && open
        };
        self.index.visible(module).map(|(_, def)| def).filter(of_two).collect()
    }

    /// The capability or asset of a name.
    pub(crate) fn kind(&self, name: &str) -> Option<matterix_lang::names::DeclId> {
        let module = self.index.module_of(self.file)?;
        let def = self.index.lookup(module, name)?;
        let fits = matches!(self.index.def(def).kind, Kind::Capability | Kind::Asset);
        self.index.decl_of(def).filter(|_| fits)
    }

    /// What of the members of kinds can be given: parameters, states and parts.
    fn params_of(&self, kinds: &[matterix_lang::names::DeclId]) -> Vec<DefId> {
        let given = |d: &DefId| {
            let text = self.index.text(self.index.def(*d).whole);
            let def = self.index.def(*d);
            match def.kind {
                Kind::Member => ["param", "state", "part", "extensive", "derived"].iter().any(|r| text.starts_with(r)),
                Kind::Part | Kind::Grid => true,
                _ => false,
            }
        };
        self.index.members_of(kinds).into_iter().filter(given).collect()
    }

    fn type_named(&self, name: &str) -> Option<Sort> {
        if let Some(def) = self.index.units().dimension(name) {
            return Some(Sort::Quantity(def.dimension.clone(), def.point));
        }
        self.kind(name).map(|k| Sort::Thing(vec![k], None))
    }
}
