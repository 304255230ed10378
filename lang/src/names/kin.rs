//! The substances that a name may mean which no species visible has: by formula and by what chemists call them, not by letters alone.

use std::collections::BTreeSet;

use matterix_ir::listing::joined;
use matterix_ir::{Diagnostic, Edit, Fix};

use super::Names;
use super::imports::{Import, fix};
use crate::ast::{Expr, ExprKind, FieldValue, ItemKind, Name};
use crate::catalogue::{Catalogue, Substance};
use crate::chem::{Element, Formula};
use crate::near;

/// So many are named at most.
const NAMED: usize = 3;

impl Names<'_> {
    /// A finding about a species that is not known, with those that have its formula or are called so; none where there are none.
    pub fn with_kin(&self, into: usize, name: &Name, d: Diagnostic) -> Result<Diagnostic, Box<Diagnostic>> {
        let formula = Formula::parse(&name.text).ok();
        let own: Vec<&str> = formula.iter().flat_map(|formula| self.own_species(into, formula)).collect();
        if !own.is_empty() {
            return Ok(near::proposed(d, &own.into_iter().map(str::to_string).collect::<Vec<_>>(), name.span));
        }
        let catalogue = Catalogue::library();
        let called = catalogue.called(&name.text);
        let weighed = formula.as_ref().filter(|_| called.is_empty()).map_or_else(Vec::new, |f| catalogue.weighed(f));
        let hydrates = formula.as_ref().map_or_else(Vec::new, |f| catalogue.hydrates(f));
        let hydrates: Vec<&Substance> =
            hydrates.into_iter().filter(|s| !called.iter().any(|known| known.name == s.name)).collect();
        let mut told = d;
        if called.is_empty() && weighed.is_empty() && hydrates.is_empty() {
            return match formula.and_then(|formula| catalogue.ions(&formula)) {
                Some(ions) => Ok(told.help(self.as_ions(into, ions))),
                None => Err(Box::new(told)),
            };
        }
        let [called_too, of_formula, with_water] = ["is also called that", "has this formula", "is a hydrate of it"];
        for (says, found) in [(called_too, &called), (of_formula, &weighed), (with_water, &hydrates)] {
            told.help.extend(self.said(into, found, says));
        }
        // Of a hydrate as much is weighed in as of no other: only a person knows what is in the bottle.
        let is_hydrate = called.is_empty() && weighed.is_empty();
        let best = [&called, &weighed, &hydrates].into_iter().find(|found| !found.is_empty());
        if let Some([one]) = best.map(Vec::as_slice) {
            told.fixes.push(Fix { asks: is_hydrate, ..self.renamed(into, name, one) });
        }
        Ok(told)
    }

    /// The species of the user's own files that have a formula, where the module sees them.
    fn own_species(&self, into: usize, formula: &Formula) -> Vec<&str> {
        let has = |id| {
            let decl = self.decl(id);
            let ItemKind::Species { fields, .. } = &decl.item.kind else { return false };
            let text = fields.iter().find(|f| f.key.text == "formula").map(|f| &f.value);
            let Some(FieldValue::Expr(Expr { kind, .. })) = text else { return false };
            let ExprKind::Text(text) = &**kind else { return false };
            !self.modules[decl.module].is_library() && Formula::parse(text).is_ok_and(|own| own == *formula)
        };
        self.visible(into).filter(|(_, id)| has(*id)).map(|(name, _)| name).collect()
    }

    /// How substances are written, and imported where they are not visible.
    fn said(&self, into: usize, found: &[&Substance], says: &str) -> Option<String> {
        let written = |s: &&Substance| match self.import_for(into, s) {
            Some(import) => format!("`{}` (`use {}`)", s.name, import.path),
            None => format!("`{}`", s.name),
        };
        let named: Vec<String> = found.iter().take(NAMED).map(written).collect();
        (!named.is_empty()).then(|| format!("{} {says}", joined(&named, "or")))
    }

    fn import_for(&self, into: usize, s: &Substance) -> Option<Import> {
        let is_visible = self.lookup(into, &s.name).is_some();
        (!is_visible).then(|| self.import_of(into, &s.name, |kind| matches!(kind, ItemKind::Species { .. }))).flatten()
    }

    /// The correction that writes a substance by its name, with its import.
    fn renamed(&self, into: usize, name: &Name, s: &Substance) -> Fix {
        let import = self.import_for(into, s).and_then(|import| import.missing);
        let mut edits = import.as_ref().map_or_else(Vec::new, |missing| fix(&[missing]).edits);
        edits.push(Edit { span: name.span, text: s.name.clone() });
        edits.sort_by_key(|edit| edit.span.start);
        let title = match &import {
            Some(_) => format!("replace with `{}` and import it", s.name),
            None => format!("replace with `{}`", s.name),
        };
        Fix { title, edits, sure: false, asks: false }
    }

    /// What holds the ions of a salt that the library has not.
    fn as_ions(&self, into: usize, ions: [(&Substance, i64); 2]) -> String {
        let each = ions.map(|(s, count)| format!("{count} mol of `{}`", s.name));
        let uses: BTreeSet<String> = ions
            .iter()
            .filter_map(|(s, _)| self.import_for(into, s))
            .map(|import| format!("`use {}`", import.path))
            .collect();
        let uses: Vec<String> = uses.into_iter().collect();
        let more = if uses.is_empty() { String::new() } else { format!("; add {}", uses.join(" and ")) };
        format!("the library has no such salt: write its ions, per mole {} and {}{more}", each[0], each[1])
    }
}

/// The names like that of a species, best first. Formulas of other elements are not alike, however few letters they differ by.
pub fn near_species<'n>(word: &str, names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let elements =
        |text: &str| Formula::parse(text).ok().map(|f| f.elements.into_keys().collect::<BTreeSet<Element>>());
    let own = elements(word);
    let is_alike = |name: &&str| match (&own, elements(name)) {
        (Some(own), Some(other)) => *own == other || misread(word) == misread(name),
        _ => true,
    };
    near::nearest(word, names.filter(is_alike))
}

/// The one substance of a module that has the formula which a name is, or is called so.
pub(super) fn in_module(name: &str, module: &str) -> Option<String> {
    let catalogue = Catalogue::library();
    let weighed = Formula::parse(name).map_or_else(|_| Vec::new(), |formula| catalogue.weighed(&formula));
    let mut found = catalogue.called(name).into_iter().chain(weighed).filter(|s| s.module == module);
    found.next().map(|s| s.name.clone()).filter(|first| found.all(|s| s.name == *first))
}

/// A species of a name of which no more is known.
pub(super) fn of_name(name: &Name) -> ItemKind {
    ItemKind::Species { name: name.clone(), fields: Vec::new() }
}

/// A formula with letters and digits that are mistaken for each other as one: `NaCI`, `H2S04`.
fn misread(word: &str) -> String {
    let one = |c: char| match c {
        'i' | 'l' | '1' => 'l',
        'o' | '0' => 'o',
        other => other,
    };
    word.to_lowercase().chars().map(one).collect()
}
