//! From the declarations to what must not meet.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use matterix_ir::{Diagnostic, Span, codes};

use super::{Consequence, Group, Incompatibility, Least, Party, Screen, in_order};
use crate::ast::{Expr, ExprKind, Field, FieldValue, ItemKind, Name};
use crate::chem::Pattern;
use crate::declare::SpeciesId;
use crate::declare::fields::{forms, unknown_fields};
use crate::declare::species::{SpeciesTable, field};
use crate::names::{DeclId, Names};
use crate::near;
use crate::units::{Dimension, Units};

const GROUP: &[&str] = &["title", "smarts", "unless", "members", "above", "source"];
const MATERIAL: &[&str] = &["title", "source", "friction"];
const PAIR: &[&str] = &["consequence", "above", "phase", "source"];

/// The value of a constant expression as a module reads it, SI, with its dimension: not a number where it has none, nothing where a mistake
/// was found in it.
pub type Constant<'r, 'a> = dyn FnMut(&'a Expr, usize) -> Option<(Dimension, f64)> + 'r;

/// What reading needs.
struct Reader<'r, 'a> {
    names: &'a Names<'a>,
    units: &'r Units,
    species: &'r SpeciesTable<'a>,
    found: &'r mut Vec<Diagnostic>,
    constant: &'r mut Constant<'r, 'a>,
}

impl Screen {
    /// Reads every group, material, pair and allowance.
    pub fn new<'a>(
        names: &'a Names<'a>,
        units: &Units,
        species: &SpeciesTable<'a>,
        constant: &mut Constant<'_, 'a>,
        found: &mut Vec<Diagnostic>,
    ) -> Screen {
        let mut screen = Screen::default();
        let mut reader = Reader { names, units, species, found, constant };
        for index in 0..names.decls.len() as u32 {
            let id = DeclId(index);
            match &names.decl(id).item.kind {
                ItemKind::ReactiveGroup { name, fields } => {
                    let group = reader.group(id, name, fields);
                    screen.by_decl.insert(id, screen.groups.len());
                    screen.groups.push(group);
                }
                ItemKind::Material { name, fields } => {
                    unknown_fields(fields, MATERIAL, "a material", reader.found);
                    forms(fields, &[], &["source"], reader.found);
                    screen.materials.insert(id, reader.title(fields, name));
                }
                _ => {}
            }
        }
        for (s, def) in species.iter() {
            let Some(f) = field(def.fields, "reactive_groups") else { continue };
            let groups = reader.stated(f, def.module, &screen.by_decl);
            screen.stated.insert(s, groups);
        }
        for (module, tree) in names.modules.iter().enumerate() {
            for item in &tree.tree.items {
                match &item.kind {
                    ItemKind::Incompatible { a, b, fields } => {
                        let span = a.span.to(b.span);
                        let parties = reader.parties(a, b, module, &screen.by_decl);
                        let pair = reader.pair(fields, span, module);
                        if let (Some((x, y)), Some(pair)) = (parties, pair) {
                            let parties = in_order(x, y);
                            screen.index.entry(parties).or_default().push(screen.pairs.len());
                            screen.pairs.push(Incompatibility { parties, ..pair });
                        }
                    }
                    ItemKind::Allow { a, b, .. } => {
                        screen.allowed.extend(reader.parties(a, b, module, &screen.by_decl));
                    }
                    _ => {}
                }
            }
        }
        screen.seats = species.iter().map(|_| OnceLock::new()).collect();
        screen
    }
}

impl<'a> Reader<'_, 'a> {
    fn group(&mut self, decl: DeclId, name: &Name, fields: &'a [Field]) -> Group {
        unknown_fields(fields, GROUP, "a reactive group", self.found);
        let module = self.names.decl(decl).module;
        if field(fields, "smarts").is_none() && field(fields, "members").is_none() {
            self.missing(name, "`smarts` or `members`", "it contains no species", "smarts: [\"...\"]");
        }
        Group {
            decl,
            title: self.title(fields, name),
            source: self.source(fields, name.span, &name.text),
            patterns: self.patterns(fields, "smarts"),
            exceptions: self.patterns(fields, "unless"),
            read: OnceLock::new(),
            members: self.members(fields, module),
            least: self.least(fields, module),
        }
    }

    fn pair(&mut self, fields: &'a [Field], span: Span, module: usize) -> Option<Incompatibility> {
        unknown_fields(fields, PAIR, "an incompatibility", self.found);
        let source = self.source(fields, span, "this pair");
        let Some(f) = field(fields, "consequence") else {
            let name = Name { text: "this pair".into(), span };
            self.missing(&name, "`consequence`", "it does not say what would happen", "consequence: [heat, fire]");
            return None;
        };
        let words = self.words(f);
        let mut consequences: Vec<Consequence> = words.into_iter().filter_map(|word| self.consequence(word)).collect();
        consequences.sort_unstable();
        let least = self.least(fields, module);
        let phase = field(fields, "phase").and_then(|f| self.words(f).first().map(|n| n.text.clone()));
        let nobody = Party::Group(0);
        (!consequences.is_empty()).then_some(Incompatibility {
            parties: (nobody, nobody),
            consequences,
            least,
            phase,
            source,
            span,
        })
    }

    fn consequence(&mut self, word: &Name) -> Option<Consequence> {
        let found = Consequence::named(&word.text);
        if found.is_none() {
            let near = near::nearest(&word.text, Consequence::names());
            let mut d = near::unknown(word, format!("unknown consequence `{}`", word.text), "not known");
            d.help.extend(near::question(&near));
            if let Some(best) = near.first() {
                d = d.guess(format!("replace with `{best}`"), word.span, best.clone());
            } else {
                let all: Vec<String> = Consequence::names().map(|n| format!("`{n}`")).collect();
                d = d.help(format!("use one of {}", all.join(", ")));
            }
            self.found.push(d);
        }
        found
    }

    fn parties(
        &mut self,
        a: &Name,
        b: &Name,
        module: usize,
        groups: &BTreeMap<DeclId, usize>,
    ) -> Option<(Party, Party)> {
        let (a, b) = (self.party(a, module, groups), self.party(b, module, groups));
        Some((a?, b?))
    }

    fn party(&mut self, name: &Name, module: usize, groups: &BTreeMap<DeclId, usize>) -> Option<Party> {
        let fits = |k: &ItemKind| {
            matches!(k, ItemKind::ReactiveGroup { .. } | ItemKind::Material { .. } | ItemKind::Species { .. })
        };
        let found = self.names.lookup(module, &name.text).and_then(|id| match &self.names.decl(id).item.kind {
            ItemKind::ReactiveGroup { .. } => groups.get(&id).map(|g| Party::Group(*g)),
            ItemKind::Material { .. } => Some(Party::Material(id)),
            ItemKind::Species { .. } => self.species.of_decl(id).map(Party::Species),
            _ => None,
        });
        if found.is_none() {
            self.found.push(self.names.unknown(module, name, "reactive group, species or material", fits));
        }
        found
    }

    fn stated(&mut self, f: &Field, module: usize, groups: &BTreeMap<DeclId, usize>) -> Vec<usize> {
        let mut out = Vec::new();
        for word in self.words(f) {
            let is_group = |k: &ItemKind| matches!(k, ItemKind::ReactiveGroup { .. });
            match self.names.lookup(module, &word.text).and_then(|id| groups.get(&id)) {
                Some(group) => out.push(*group),
                None => self.found.push(self.names.unknown(module, word, "reactive group", is_group)),
            }
        }
        out
    }

    fn members(&mut self, fields: &'a [Field], module: usize) -> Vec<(SpeciesId, Option<Least>)> {
        let mut out = Vec::new();
        let Some(f) = field(fields, "members") else { return out };
        let FieldValue::Fields(lines) = &f.value else {
            self.misfit(
                f.span,
                "`members` must be a list of species with minimum contents",
                "members: { HF: any, HCl: 0.01 mol/kg }",
            );
            return out;
        };
        for line in lines {
            let least = match &line.value {
                FieldValue::Expr(e) if matches!(&*e.kind, ExprKind::Name(n) if n.text == "any") => None,
                FieldValue::Expr(e) => match self.content(e, module) {
                    Some(least) => Some(least),
                    None => continue,
                },
                _ => continue,
            };
            match self.species.lookup(self.names, module, &line.key) {
                Ok(s) => out.push((s, least)),
                Err(d) => self.found.push(*d),
            }
        }
        out
    }

    fn least(&mut self, fields: &'a [Field], module: usize) -> Option<Least> {
        let f = field(fields, "above")?;
        match &f.value {
            FieldValue::Expr(e) => self.content(e, module),
            _ => {
                self.misfit(f.span, "`above` must be a minimum content", "above: 0.5 mol/kg");
                None
            }
        }
    }

    /// `0.5 mol/kg`, `8 %w/w`.
    fn content(&mut self, e: &'a Expr, module: usize) -> Option<Least> {
        let (dimension, si) = (self.constant)(e, module)?;
        if si.is_finite() && si >= 0.0 {
            if dimension == self.units.named("Amount").over(&self.units.named("Mass")) {
                return Some(Least::Amount(si));
            }
            if dimension == self.units.named("MassFraction") {
                return Some(Least::Share(si));
            }
        }
        self.found.push(
            Diagnostic::error(
                codes::TYPE_MISMATCH,
                e.span,
                "a minimum content must be in mol/kg or %w/w of the mixture",
                "another kind of quantity",
            )
            .help("write for example `0.5 mol/kg` or `8 %w/w`; for members also `any`"),
        );
        None
    }

    fn patterns(&mut self, fields: &[Field], key: &str) -> Vec<String> {
        let mut out = Vec::new();
        let Some(f) = field(fields, key) else { return out };
        for (text, span) in self.texts(f) {
            let module = self.names.modules.iter().find(|m| m.file == span.file);
            // The library's own are read when a species is first looked at.
            if module.is_none_or(|m| !m.is_library())
                && let Err(detail) = Pattern::parse(text)
            {
                let headline = format!("`{text}` is not a SMARTS pattern");
                self.found.push(Diagnostic::error(codes::FORMULA_INVALID, span, headline, detail));
                continue;
            }
            out.push(text.to_string());
        }
        out
    }

    fn title(&mut self, fields: &[Field], name: &Name) -> String {
        let given = field(fields, "title").and_then(|f| self.texts(f).into_iter().next());
        given.map_or_else(|| name.text.replace('_', " "), |t| t.0.to_string())
    }

    fn source(&mut self, fields: &[Field], span: Span, what: &str) -> String {
        match field(fields, "source").and_then(|f| self.texts(f).into_iter().next()) {
            Some((text, _)) => text.to_string(),
            None => {
                let name = Name { text: what.to_string(), span };
                self.missing(&name, "`source`", "it does not name its source", "source: \"...\"");
                String::new()
            }
        }
    }

    fn missing(&mut self, name: &Name, what: &str, label: &str, example: &str) {
        let headline = format!("`{}` has no {what}", name.text);
        self.found
            .push(Diagnostic::error(codes::MISSING_FIELD, name.span, headline, label).help(format!("add `{example}`")));
    }

    /// The names of a list `[a, b]`, or a name alone.
    fn words<'f>(&mut self, f: &'f Field) -> Vec<&'f Name> {
        let pick = |e: &'f Expr| match &*e.kind {
            ExprKind::Name(n) => Some(n),
            _ => None,
        };
        self.listed(f, pick, "names", "[heat, fire]")
    }

    /// The texts of a list `["a", "b"]`, or a text alone, with their places.
    fn texts<'f>(&mut self, f: &'f Field) -> Vec<(&'f str, Span)> {
        let pick = |e: &'f Expr| match &*e.kind {
            ExprKind::Text(t) => Some((t.as_str(), e.span)),
            _ => None,
        };
        self.listed(f, pick, "texts", "[\"...\"]")
    }

    fn listed<'f, T>(
        &mut self,
        f: &'f Field,
        pick: impl Fn(&'f Expr) -> Option<T>,
        what: &str,
        example: &str,
    ) -> Vec<T> {
        let items = match &f.value {
            FieldValue::Expr(e) => match &*e.kind {
                ExprKind::List(items) => items.as_slice(),
                _ => std::slice::from_ref(e),
            },
            _ => &[],
        };
        let out: Vec<T> = items.iter().filter_map(pick).collect();
        if out.len() < items.len() || items.is_empty() {
            let key = &f.key.text;
            self.misfit(f.span, &format!("`{key}` must be a list of {what}"), &format!("{key}: {example}"));
        }
        out
    }

    fn misfit(&mut self, span: Span, headline: &str, example: &str) {
        let d = Diagnostic::error(codes::TYPE_MISMATCH, span, headline, "not such a list");
        self.found.push(d.help(format!("write for example `{example}`")));
    }
}
