//! What is said of a name or an expression: its kind, type, unit, value, what is written about it and where it is declared.

use matterix_ir::quantity::show_number;
use matterix_ir::{FileId, Span, Unit};
use matterix_lang::semantic_index::{Seen, Sort};

use crate::Index;
use crate::index::{Def, DefId, Kind, Meaning, Use};

/// What is said, in Markdown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// About what.
    pub span: Span,
    /// The text.
    pub text: String,
}

impl Index {
    /// What is said of the name at a place.
    pub fn about(&self, file: FileId, offset: usize) -> Option<Said> {
        let found = self.at(file, offset).or_else(|| self.behind_prefix(file, offset))?;
        let text = match found.meaning {
            Meaning::Def(def) if self.def(def).kind == Kind::Unit => {
                let whole = self.with_prefix(found.span);
                let name = self.text(whole);
                let size = Some(whole).filter(|whole| *whole != found.span).and_then(|_| self.size(name));
                let size = size.map(|size| format!("\n\n`{name}`: {size}")).unwrap_or_default();
                let text = self.about_def(def, self.seen(found.span)) + &size;
                return Some(Said { span: whole, text });
            }
            Meaning::Def(def) => self.about_def(def, self.seen(found.span)),
            Meaning::Module(module) => self.about_module(module)?,
            Meaning::Language(what) => {
                let sort = self.seen(found.span).map(|seen| format!("\n\n{}", self.valued(seen))).unwrap_or_default();
                format!("`{}`: {what}{sort}", self.text(found.span))
            }
            Meaning::Open => {
                format!("`{}`: a member of an argument whose type is open here", self.text(found.span))
            }
            Meaning::Unknown => return None,
        };
        Some(Said { span: found.span, text })
    }

    /// What kind of value the innermost expression at a place has.
    pub fn type_of(&self, file: FileId, offset: usize) -> Option<Said> {
        let (span, seen) = self.seen_at(file, offset)?;
        Some(Said { span, text: self.valued(seen) })
    }

    /// What is said of a declaration; `seen` is what was found where it is named.
    pub fn about_def(&self, id: DefId, seen: Option<&Seen>) -> String {
        let def = self.def(id);
        let mut out = format!("```mtx\n{}\n```\n", self.head(def));
        let mut line = def.kind.word().to_string();
        if let Some(owner) = def.owner.map(|o| self.def(o)).filter(|o| !o.name.is_empty()) {
            line.push_str(&format!(" of {} `{}`", owner.kind.word(), owner.name));
        }
        if !matches!(def.kind, Kind::Unit | Kind::Dimension) {
            let module = self.module_name(def.span.file);
            if !module.is_empty() {
                line.push_str(&format!(", in `{module}`"));
            }
        }
        out.push_str(&line);
        if let Some(value) = self.value_line(def, seen) {
            out.push_str(&format!("\n\n{value}"));
        }
        if !def.docs.is_empty() {
            out.push_str(&format!("\n\n{}", def.docs.join("\n")));
        }
        out
    }

    fn about_module(&self, module: u32) -> Option<String> {
        let module = self.module_at(module)?;
        Some(format!("```mtx\nuse {}\n```\nmodule\n\n{}", module.name, module.tree.docs.join("\n")))
    }

    /// The head of a declaration on as few lines as its text has.
    fn head(&self, def: &Def) -> String {
        let text = self.text(def.head).trim_end();
        let text = text.strip_suffix('{').unwrap_or(text).trim_end();
        let lines: Vec<&str> = text.lines().collect();
        let from = lines.iter().position(|l| !l.trim_start().starts_with("///")).unwrap_or(0);
        let indent = lines.get(from + 1).map_or(0, |l| l.len() - l.trim_start().len());
        let shown = lines.iter().skip(from).take(HEAD_LINES).enumerate();
        let shown =
            shown.map(|(i, l)| if i == 0 { l.trim() } else { l.get(indent.min(4)..).unwrap_or_else(|| l.trim()) });
        let mut out = shown.collect::<Vec<_>>().join("\n");
        if lines.len() - from > HEAD_LINES {
            out.push_str("\n…");
        }
        out
    }

    /// How large a unit is in SI, with or without prefix.
    fn size(&self, name: &str) -> Option<String> {
        let (unit, factor) = self.units().find(name)?;
        let si = self.units().symbol(&unit.dimension);
        let size = show_number(unit.factor * factor);
        let zero = unit.offset.filter(|o| *o != 0.0).map(|o| format!(", 0 {name} is {} {si}", show_number(o)));
        Some(format!("1 {name} is {size} {si}{}", zero.unwrap_or_default()))
    }

    /// The unit whose prefix stands at a place: `m` of `mmol`.
    fn behind_prefix(&self, file: FileId, offset: usize) -> Option<Use> {
        let uses = self.uses(file);
        let next = uses.get(uses.partition_point(|u| (u.span.start as usize) <= offset))?;
        let unit = matches!(next.meaning, Meaning::Def(def) if self.def(def).kind == Kind::Unit);
        (unit && self.with_prefix(next.span).start as usize <= offset).then_some(*next)
    }

    /// The span of a unit with the prefix before it.
    fn with_prefix(&self, unit: Span) -> Span {
        let text = self.sources().get(unit.file).map_or("", |source| &source.text);
        let before = text.get(..unit.start as usize).unwrap_or_default();
        let length: usize = before.chars().rev().take_while(|c| c.is_alphabetic()).map(char::len_utf8).sum();
        let whole = Span { start: unit.start - length as u32, ..unit };
        if self.units().find(self.text(whole)).is_some() { whole } else { unit }
    }

    fn value_line(&self, def: &Def, seen: Option<&Seen>) -> Option<String> {
        match def.kind {
            Kind::Unit => {
                let (unit, _) = self.units().find(&def.name)?;
                let dimension = self.units().describe(&unit.dimension, unit.offset.is_some());
                Some(format!("{dimension}; {}", self.size(&def.name)?))
            }
            Kind::Dimension => match &def.sort {
                Sort::Quantity(dimension, point) => {
                    let unit = self.units().symbol(dimension);
                    let scale = if *point { ", a point on a scale" } else { "" };
                    Some(format!("in {unit}{scale}"))
                }
                _ => None,
            },
            Kind::Skill | Kind::Command | Kind::Capability | Kind::Asset | Kind::Lab | Kind::Workflow => None,
            _ => match seen.or_else(|| self.seen_of(def)) {
                Some(seen) => Some(self.valued(seen)).filter(|t| !t.is_empty()),
                None => Some(self.sort_words(&def.sort)).filter(|t| !t.is_empty()),
            },
        }
    }

    /// What was found of the value with which something is declared.
    fn seen_of(&self, def: &Def) -> Option<&Seen> {
        if !matches!(def.kind, Kind::Variable | Kind::Constant | Kind::Table | Kind::Setting | Kind::Parameter) {
            return None;
        }
        // The value is the last thing of the declaration.
        self.seen_ending(def.whole)
    }

    /// A kind of value with the value itself where it is always the same: in the unit it was written in and in SI.
    pub(crate) fn valued(&self, seen: &Seen) -> String {
        let words = self.sort_words(&seen.sort);
        let (Some(value), Sort::Quantity(dimension, point)) = (seen.value, &seen.sort) else { return words };
        let si = if dimension.is_one() { Unit::one() } else { Unit::scaled(self.units().symbol(dimension), 1.0) };
        let own = match &seen.unit {
            Some(unit) => Some(unit.clone()),
            None if *point => self.units().preferred_point(dimension),
            None => None,
        };
        match own.filter(|u| u.symbol != si.symbol) {
            Some(own) => format!("{words}: {} = {}", own.show(value), si.show(value)),
            None => format!("{words}: {}", si.show(value)),
        }
    }

    /// A kind of value in words.
    pub fn sort_words(&self, sort: &Sort) -> String {
        let kinds = |kinds: &[matterix_lang::names::DeclId]| {
            let names = kinds.iter().filter_map(|k| self.of_decl(*k)).map(|d| self.def(d).name.clone());
            names.collect::<Vec<_>>().join(" & ")
        };
        match sort {
            Sort::Any => String::new(),
            Sort::Quantity(dimension, point) => self.described(dimension, *point),
            Sort::Truth => "a truth value".into(),
            Sort::Text => "a text".into(),
            Sort::Word(words) => format!("one of {}", matterix_lang::declare::types::list(words)),
            Sort::Range(inner) => format!("a range of {}", self.sort_words(inner)),
            Sort::Tuple(items) => format!("{} values", items.len()),
            Sort::List(inner) => format!("a list of {}", self.sort_words(inner)),
            Sort::Thing(all, _) if all.is_empty() => "a thing".into(),
            Sort::Thing(all, Some(name)) => format!("`{name}`: {}", kinds(all)),
            Sort::Thing(all, None) => kinds(all),
            Sort::Frame => "a frame".into(),
            Sort::Color => "a colour".into(),
            Sort::Species => "a species".into(),
            Sort::Reaction => "a reaction".into(),
            Sort::Material => "a material".into(),
            Sort::Concentration => "a concentration".into(),
            Sort::Solution => "a solution".into(),
            Sort::Lab(_) => "an included lab".into(),
            Sort::Kind(_) => "a type".into(),
            Sort::Function(_) | Sort::Method => "a function".into(),
            Sort::Step => "a step".into(),
            Sort::Row(_) => "a row of a table".into(),
            Sort::Nothing => "`nothing`".into(),
            Sort::Unlimited => "`unlimited`".into(),
        }
    }
}

/// The most lines of a declaration that are shown.
const HEAD_LINES: usize = 12;
