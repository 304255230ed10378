//! The species table: composition, charge and molar mass of everything declared.

use std::collections::BTreeMap;

use matterix_ir::{Diagnostic, Span, codes};

use super::SpeciesId;
use super::properties::Properties;
use crate::ast::{Expr, ExprKind, Field, FieldValue, ItemKind, Name, Term};
use crate::chem::formula::{Formula, FormulaErrorKind};
use crate::chem::structure::{Structure, StructureErrorKind};
use crate::names::{DeclId, Names};

/// A declared species.
#[derive(Clone, Debug)]
pub struct SpeciesDef<'a> {
    /// Its declaration.
    pub decl: DeclId,
    /// As declared.
    pub name: String,
    /// Its module.
    pub module: usize,
    /// Composition and charge; absent for an undefined structure.
    pub formula: Option<Formula>,
    /// Whether it is what `dissolves` is about.
    pub is_water: bool,
    /// Whether it is the electron of half-cells, of which there is never any.
    pub is_electron: bool,
    /// Whether it is a gas: its name ends with `(g)`. No mixture holds any of it.
    pub is_gas: bool,
    /// Its structure, where one is declared.
    pub structure: Option<Structure>,
    /// kg/mol; 1 for a species counted by mass.
    pub molar_mass: f64,
    /// Counted by mass.
    pub by_mass: bool,
    /// Its properties.
    pub fields: &'a [Field],
    /// What it splits into in water, with counts.
    pub dissolves: Vec<(SpeciesId, f64)>,
    /// The liquid beside water that it is dissolved in, if it is not in water.
    pub liquid: Option<SpeciesId>,
    /// Where its name stands.
    pub span: Span,
}

impl SpeciesDef<'_> {
    /// Elementary charges; none where its composition is not known.
    pub fn charge(&self) -> i32 {
        self.formula.as_ref().map_or(0, |formula| formula.charge)
    }

    /// Whether it can be dissolved in water as it stands: no gas, no solid, nothing that splits or is in another liquid.
    pub fn is_aqueous(&self) -> bool {
        let is_elsewhere = self.is_water || self.is_electron || self.is_gas || self.liquid.is_some();
        !is_elsewhere && self.dissolves.is_empty() && !self.name.ends_with("(s)")
    }

    /// The phase it states: `solid`, `liquid`, `gas`.
    pub fn phase(&self) -> Option<&str> {
        match &field(self.fields, "phase")?.value {
            FieldValue::Expr(e) => match &*e.kind {
                ExprKind::Text(t) => Some(t),
                ExprKind::Name(n) => Some(&n.text),
                _ => None,
            },
            _ => None,
        }
    }
}

/// All species, and which one a declaration means (aliases share one).
#[derive(Debug, Default)]
pub struct SpeciesTable<'a> {
    all: Vec<SpeciesDef<'a>>,
    by_decl: BTreeMap<DeclId, SpeciesId>,
    /// Those that split in water, in order.
    salts: Vec<SpeciesId>,
}

/// Fields of a species that say what it is; all others are properties.
const FIELDS: &[&str] = &["smiles", "formula", "same_as", "dissolves", "by", "reactive_groups"];

/// The property of a species that says which liquid beside water holds it.
const DISSOLVED_IN: &str = "dissolved_in";

/// The species of the left and of the right side of an equation, with their counts.
pub type Sides = (Vec<(SpeciesId, f64)>, Vec<(SpeciesId, f64)>);

impl<'a> SpeciesTable<'a> {
    /// Reads every `species` item.
    pub fn new(names: &'a Names<'a>, properties: &Properties<'a>, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let known: Vec<&str> = FIELDS.iter().chain(properties.keys()).copied().collect();
        let mut table = SpeciesTable::default();
        let mut aliases = Vec::new();
        for (index, decl) in names.decls.iter().enumerate() {
            let id = DeclId(index as u32);
            let ItemKind::Species { name, fields } = &decl.item.kind else { continue };
            if let Some(FieldValue::Expr(Expr { kind, .. })) = field(fields, "same_as").map(|f| &f.value)
                && let ExprKind::Name(other) = &**kind
            {
                aliases.push((id, decl.module, other));
                if let Some(f) = fields.iter().find(|f| f.key.text != "same_as") {
                    let headline = format!(
                        "`{}` is another name of `{}` and cannot have its own `{}`",
                        name.text, other.text, f.key.text
                    );
                    let d = Diagnostic::error(codes::MISPLACED, f.span, headline, "has no effect");
                    diagnostics.push(d.help(format!("give it for `{}`, or remove `same_as`", other.text)));
                }
                continue;
            }
            let def = species(id, decl.module, name, fields, &known, diagnostics);
            table.by_decl.insert(id, SpeciesId(table.all.len() as u32));
            table.all.push(def);
        }
        for (id, module, other) in aliases {
            match names.lookup(module, &other.text).and_then(|d| table.by_decl.get(&d).copied()) {
                Some(target) => {
                    table.by_decl.insert(id, target);
                }
                None => diagnostics.push(names.unknown(module, other, "species", is_species)),
            }
        }
        for index in 0..table.all.len() {
            let fields = table.all[index].fields;
            let Some(f) = field(fields, "dissolves") else { continue };
            let FieldValue::Species(terms) = &f.value else { continue };
            let module = table.all[index].module;
            let ions = table.terms(names, module, terms, diagnostics);
            check_dissociation(&table, index, &ions, f.span, diagnostics);
            if !ions.is_empty() {
                table.salts.push(SpeciesId(index as u32));
            }
            table.all[index].dissolves = ions;
        }
        for index in 0..table.all.len() {
            table.all[index].liquid = table.liquid_of(index, names, diagnostics);
        }
        table
    }

    /// The liquid that a species says it is dissolved in; what cannot be is reported.
    fn liquid_of(&self, index: usize, names: &Names<'_>, diagnostics: &mut Vec<Diagnostic>) -> Option<SpeciesId> {
        let def = &self.all[index];
        let given = field(def.fields, DISSOLVED_IN)?;
        let FieldValue::Expr(Expr { kind, span, .. }) = &given.value else { return None };
        let ExprKind::Name(name) = &**kind else { return None };
        let found = self.lookup(names, def.module, name).map_err(|d| diagnostics.push(*d)).ok()?;
        let liquid = self.get(found);
        let is_liquid = found.0 as usize != index && field(liquid.fields, DISSOLVED_IN).is_none();
        let wrong = match () {
            () if liquid.is_water => "a species in water needs no `dissolved_in`",
            () if !is_liquid || liquid.charge() != 0 || liquid.is_gas => "not a liquid",
            () if def.charge() != 0 || !def.dissolves.is_empty() => "ions stay in water",
            () => return Some(found),
        };
        let headline = format!("`{}` cannot be dissolved in `{}`", def.name, liquid.name);
        let d = Diagnostic::error(codes::EQUILIBRIUM_FORM, *span, headline, wrong);
        diagnostics.push(d.help(
            "name the liquid that does not mix with water: `species I2_org { formula: \"I2\", dissolved_in: CHCl3 }`",
        ));
        None
    }

    /// Species of equation terms with their counts; unknown ones are reported and left out.
    pub fn terms(
        &self,
        names: &Names<'_>,
        module: usize,
        terms: &[Term],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Vec<(SpeciesId, f64)> {
        let mut out = Vec::new();
        for term in terms {
            match self.lookup(names, module, &term.species) {
                Ok(id) => out.push((id, term.coefficient)),
                Err(d) => diagnostics.push(*d),
            }
        }
        out
    }

    /// The species of both sides of an equation; none where one is unknown, which is reported.
    pub fn sides(
        &self,
        names: &Names<'_>,
        module: usize,
        (left, right): (&[Term], &[Term]),
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<Sides> {
        let known = [left, right].map(|side| self.terms(names, module, side, diagnostics));
        let [reactants, products] = known;
        (reactants.len() == left.len() && products.len() == right.len()).then_some((reactants, products))
    }

    /// The species a name means in a module.
    pub fn lookup(&self, names: &Names<'_>, module: usize, name: &Name) -> Result<SpeciesId, Box<Diagnostic>> {
        names
            .lookup(module, &name.text)
            .and_then(|d| self.by_decl.get(&d).copied())
            .ok_or_else(|| Box::new(names.unknown(module, name, "species", is_species)))
    }

    /// The species a declaration means.
    pub fn of_decl(&self, decl: DeclId) -> Option<SpeciesId> {
        self.by_decl.get(&decl).copied()
    }

    /// One species.
    pub fn get(&self, id: SpeciesId) -> &SpeciesDef<'a> {
        &self.all[id.0 as usize]
    }

    /// Those that split in water.
    pub fn salts(&self) -> impl Iterator<Item = SpeciesId> + '_ {
        self.salts.iter().copied()
    }

    /// All species.
    pub fn iter(&self) -> impl Iterator<Item = (SpeciesId, &SpeciesDef<'a>)> {
        self.all.iter().enumerate().map(|(i, s)| (SpeciesId(i as u32), s))
    }
}

fn is_species(kind: &ItemKind) -> bool {
    matches!(kind, ItemKind::Species { .. })
}

/// The field with this key.
pub fn field<'a>(fields: &'a [Field], key: &str) -> Option<&'a Field> {
    fields.iter().find(|f| f.key.text == key)
}

fn text<'a>(fields: &'a [Field], key: &str) -> Option<(&'a str, Span)> {
    match &field(fields, key)?.value {
        FieldValue::Expr(e) => match &*e.kind {
            ExprKind::Text(t) => Some((t, e.span)),
            _ => None,
        },
        _ => None,
    }
}

fn species<'a>(
    decl: DeclId,
    module: usize,
    name: &Name,
    fields: &'a [Field],
    known: &[&str],
    diagnostics: &mut Vec<Diagnostic>,
) -> SpeciesDef<'a> {
    unknown_properties(fields, known, diagnostics);
    check_forms(fields, diagnostics);
    let by_mass = field(fields, "by").is_some();
    let formula = text(fields, "formula").and_then(|(t, span)| read_formula(t, span, diagnostics));
    let structure = text(fields, "smiles").and_then(|(t, span)| match Structure::parse(t) {
        Ok(s) => Some(s),
        Err(e) => {
            diagnostics.push(
                Diagnostic::error(
                    codes::FORMULA_INVALID,
                    span,
                    format!("`{t}` is not a SMILES structure"),
                    structure_error(&e.kind),
                )
                .help("a SMILES string writes atoms and bonds: ethanol is `CCO`"),
            );
            None
        }
    });
    if let (Some(f), Some(s)) = (&formula, structure.as_ref().map(|s| &s.formula))
        && f != s
    {
        let span = text(fields, "formula").map_or(name.span, |t| t.1);
        diagnostics.push(Diagnostic::error(
            codes::FORMULA_INVALID,
            span,
            format!("the formula of `{}` is {f}, but its structure is {s}", name.text),
            "does not agree with `smiles`",
        ));
    }
    let declared = field(fields, "formula").is_some() || field(fields, "smiles").is_some();
    if !declared && !by_mass {
        diagnostics.push(
            Diagnostic::error(
                codes::MISSING_FIELD,
                name.span,
                format!("`{}` has neither `smiles` nor `formula`", name.text),
                "its composition is unknown",
            )
            .help("add `formula: \"...\"`, or `by: mass` for an undefined structure"),
        );
    }
    if let Some(f) = structure.as_ref().map(|s| &s.formula).or(formula.as_ref()) {
        let stated = crate::chem::SpeciesName::split(&name.text).charge;
        if stated != 0 && stated != f.charge {
            diagnostics.push(
                Diagnostic::error(
                    codes::FORMULA_INVALID,
                    name.span,
                    format!("`{}` is declared with a charge of {}", name.text, f.charge),
                    format!("the name says {stated:+}"),
                )
                .help("write the charge in the formula too: `formula: \"SO4^2-\"`"),
            );
        }
    }
    let formula = structure.as_ref().map(|s| s.formula.clone()).or(formula);
    let molar_mass = match &formula {
        Some(f) => f.molar_mass().unwrap_or_else(|e| {
            diagnostics.push(Diagnostic::error(
                codes::FORMULA_INVALID,
                name.span,
                format!("{} has no standard atomic weight", e.0.symbol()),
                "its molar mass is unknown",
            ));
            f64::NAN
        }),
        None => 1.0,
    };
    let is_water = formula.as_ref().is_some_and(|formula| formula.to_string() == "H2O");
    let is_electron = formula.as_ref().is_some_and(Formula::is_electron);
    SpeciesDef {
        decl,
        name: name.text.clone(),
        module,
        formula,
        is_water,
        is_electron,
        is_gas: name.text.ends_with("(g)"),
        structure,
        molar_mass,
        by_mass,
        fields,
        dissolves: Vec::new(),
        liquid: None,
        span: name.span,
    }
}

fn read_formula(t: &str, span: Span, diagnostics: &mut Vec<Diagnostic>) -> Option<Formula> {
    match Formula::parse(t) {
        Ok(f) => Some(f),
        Err(e) => {
            let (what, help) = match &e.kind {
                FormulaErrorKind::UnknownElement(s) => (format!("no element has the symbol `{s}`"), None),
                other => (formula_error(other), Some("write atoms and counts: `C2H6O`, `Ca(OH)2`, `SO4^2-`")),
            };
            // One byte past the opening quote; escapes do not occur in formulas.
            let at = span.start as usize + 1 + e.offset;
            let exact = Span::new(span.file, at, at + e.len);
            let mut d = Diagnostic::error(codes::FORMULA_INVALID, exact, format!("`{t}` is not a formula"), what);
            d.help.extend(help.map(String::from));
            diagnostics.push(d);
            None
        }
    }
}

fn formula_error(kind: &FormulaErrorKind) -> String {
    match kind {
        FormulaErrorKind::Empty => "no atoms".into(),
        FormulaErrorKind::UnknownElement(s) => format!("no element has the symbol `{s}`"),
        FormulaErrorKind::UnexpectedCharacter(c) => format!("`{c}` is not allowed here"),
        FormulaErrorKind::Unclosed(c) => format!("`{c}` is not closed"),
        FormulaErrorKind::Unopened(c) => format!("`{c}` has no opening bracket"),
        FormulaErrorKind::BadCount => "a count must be a whole number from 1 to a million".into(),
        FormulaErrorKind::TooDeep => "too many brackets inside each other".into(),
    }
}

fn structure_error(kind: &StructureErrorKind) -> String {
    match kind {
        StructureErrorKind::Empty => "it is empty".into(),
        StructureErrorKind::UnexpectedCharacter => "a character that is not allowed here".into(),
        StructureErrorKind::UnexpectedEnd => "it ends inside an atom or branch".into(),
        StructureErrorKind::UnknownElement(s) => format!("no element has the symbol `{s}`"),
        StructureErrorKind::OpenRing(n) => format!("ring bond {n} is not closed"),
        StructureErrorKind::ConflictingRing(n) => format!("the two ends of ring bond {n} do not match"),
        StructureErrorKind::Parentheses => "parentheses do not match".into(),
        StructureErrorKind::BracketAtom(a) => format!("the atom `[{a}]` cannot be read"),
        StructureErrorKind::Valence(e) => format!("{e} has too many bonds"),
        StructureErrorKind::NotAromatic => "a lower-case ring that cannot be aromatic".into(),
        StructureErrorKind::Wildcard => "`*` is not an element".into(),
        StructureErrorKind::TooLarge => "too long, or nested too deeply".into(),
        StructureErrorKind::Unsupported => "unsupported".into(),
    }
}

/// Reports properties that no capability `Species` declares.
fn unknown_properties(fields: &[Field], known: &[&str], diagnostics: &mut Vec<Diagnostic>) {
    let before = diagnostics.len();
    super::fields::unknown_fields(fields, known, "a species", diagnostics);
    for d in diagnostics.iter_mut().skip(before).filter(|d| d.code == codes::UNKNOWN_FIELD) {
        d.help.push("to add your own property, declare its type: `capability Species { param NAME: TYPE }`".into());
    }
}

/// What says what a species is has one form each.
fn check_forms(fields: &[Field], diagnostics: &mut Vec<Diagnostic>) {
    for f in fields {
        let kind = match &f.value {
            FieldValue::Expr(e) => Some(&*e.kind),
            _ => None,
        };
        let (fits, form) = match f.key.text.as_str() {
            "formula" | "smiles" => (matches!(kind, Some(ExprKind::Text(_) | ExprKind::Error)), "a text in quotes"),
            "by" => (matches!(kind, Some(ExprKind::Name(n)) if n.text == "mass"), "`mass`"),
            "same_as" | DISSOLVED_IN => {
                (matches!(kind, Some(ExprKind::Name(_) | ExprKind::Error)), "the name of a species")
            }
            "dissolves" => (matches!(f.value, FieldValue::Species(_)), "a sum of ions, such as `Na+ + Cl-`"),
            _ => continue,
        };
        if !fits {
            let headline = format!("`{}` must be {form}", f.key.text);
            diagnostics.push(Diagnostic::error(codes::TYPE_MISMATCH, f.span, headline, "another value"));
        }
    }
}

fn check_dissociation(
    table: &SpeciesTable<'_>,
    index: usize,
    ions: &[(SpeciesId, f64)],
    span: Span,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let salt = &table.all[index];
    let Some(formula) = &salt.formula else { return };
    let mut charge = 0.0;
    let mut counts: BTreeMap<_, f64> = BTreeMap::new();
    for (ion, n) in ions {
        let Some(f) = &table.get(*ion).formula else { return };
        charge += n * f64::from(f.charge);
        for (element, count) in &f.elements {
            *counts.entry(*element).or_default() += n * count.to_f64();
        }
    }
    let same = counts.len() == formula.elements.len()
        && formula.elements.iter().all(|(e, c)| counts.get(e).is_some_and(|n| (n - c.to_f64()).abs() < 1e-9));
    if !same || (charge - f64::from(formula.charge)).abs() > 1e-9 {
        diagnostics.push(Diagnostic::error(
            codes::UNBALANCED,
            span,
            format!("`{}` ({formula}) cannot dissociate into these ions", salt.name),
            "atoms or charge differ",
        ));
    }
}
