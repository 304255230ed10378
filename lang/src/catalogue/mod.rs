//! Substances as texts declare them: names, structures, and every number with the source that is told beside it.
//!
//! A source is a tag in a comment at the end of the line, `// [crc]`, which the module's documentation explains; what stands after it is a
//! remark on this number. Numbers without a tag have the source that the documentation of the species tells.

use std::collections::BTreeMap;

use matterix_ir::{FileId, Span};

mod equilibria;
mod kin;
mod source;

pub use self::equilibria::{Constant, Kind, Part};
pub use self::source::Source;
use self::source::{explained, tagged, told};
use crate::ast::{Expr, ExprKind, Field, FieldValue, File, Item, ItemKind};
use crate::chem::{Formula, Structure};
use crate::{library, near, syntax};

/// A text with what it declares.
struct Text {
    /// `std::species`; a file has its path.
    module: String,
    text: String,
    tree: File,
    is_file: bool,
}

/// A property as stated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stated {
    /// `boiling_point`.
    pub property: String,
    /// As written: `56.1 degC`.
    pub value: String,
    /// Where a number has one.
    pub source: Option<Source>,
    /// Whether it holds a number, which should have a source.
    pub is_number: bool,
}

/// A substance with all that is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Substance {
    /// As declared.
    pub name: String,
    /// Its other names.
    pub aliases: Vec<String>,
    /// What it is called besides, in `synonyms`: words that no file can write for it, and that others may share.
    pub synonyms: Vec<String>,
    /// Its documentation.
    pub about: String,
    /// Its module, or file.
    pub module: String,
    /// What a file writes to have it: none of the library where it is there in every file, and none of a file's own.
    pub import: Option<String>,
    /// As written.
    pub formula: Option<String>,
    /// kg/mol.
    pub molar_mass: Option<f64>,
    /// Registry number.
    pub cas: Option<String>,
    /// Its structure, as written.
    pub smiles: Option<String>,
    /// Its properties, in order.
    pub stated: Vec<Stated>,
    /// What it splits into in water, as `dissolves` names it.
    pub ions: Vec<String>,
    /// The equilibria in which it or one of its ions takes part, by kind.
    pub equilibria: Vec<Part>,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found<'a> {
    /// By what: `name`, `CAS number`, `formula`, `structure`.
    pub by: &'static str,
    /// All that fit.
    pub substances: Vec<&'a Substance>,
}

/// The substances of the library, and of files.
pub struct Catalogue {
    all: Vec<Substance>,
}

/// Fields that are shown by themselves, or say what a species is without a number.
const IDENTITY: &[&str] = &["smiles", "formula", "cas"];
/// Fields in which digits are no measured numbers.
const WORDS: &[&str] = &["phase", "hazards", "synonyms", "dissolves", "reactive_groups", "by", "same_as"];

impl Catalogue {
    /// Reads the library, and files by their paths and texts.
    pub fn read(files: &[(String, String)]) -> Catalogue {
        let own = files.iter().map(|(path, text)| {
            let (tree, _) = syntax::parse(FileId(0), text);
            Text { module: path.clone(), text: text.clone(), tree, is_file: true }
        });
        let library = library::MODULES.iter().enumerate().map(|(index, module)| {
            let tree = library::tree(index);
            Text { module: module.name.to_string(), text: module.text.to_string(), tree, is_file: false }
        });
        // Files come first: what they declare hides the library's.
        let texts: Vec<Text> = own.chain(library).collect();
        let everywhere = prelude(&texts);
        let mut all: Vec<Substance> = texts.iter().flat_map(|text| of_text(text, &everywhere)).collect();
        equilibria::take_part(&texts, &mut all);
        Catalogue { all }
    }

    /// All of them.
    pub fn all(&self) -> &[Substance] {
        &self.all
    }

    /// What a word means: a name or alias, a CAS number, a name in other letters or as its documentation or synonyms have it, a formula, a
    /// structure; the first of these under which there is something, then the others.
    pub fn find(&self, word: &str) -> Vec<Found<'_>> {
        let formula = Formula::parse(word).ok();
        let structure = Structure::parse(word).ok();
        let by = |by, fits: &dyn Fn(&Substance) -> bool| Found {
            by,
            substances: self.all.iter().filter(|s| fits(s)).collect(),
        };
        // `CO` is no other writing of `Co`.
        let exact = self.all.iter().any(|s| s.names().any(|name| name == word));
        let mut found = vec![
            by("name", &|s| s.names().any(|name| name == word)),
            by("CAS number", &|s| s.cas.as_deref() == Some(word)),
            by("name", &|s| !exact && s.is_called(word)),
            by("formula", &|s| formula.is_some() && s.composition() == formula),
            by("formula without its water", &|s| formula.is_some() && s.without_water() == formula),
            by("structure", &|s| structure.as_ref().is_some_and(|asked| s.is(asked))),
        ];
        let mut told: Vec<&str> = Vec::new();
        for group in &mut found {
            group.substances.retain(|s| !told.contains(&s.name.as_str()));
            told.extend(group.substances.iter().map(|s| s.name.as_str()));
        }
        found.retain(|group| !group.substances.is_empty());
        found
    }

    /// Those that a word names in other letters, by their documentation or by a synonym.
    pub fn called(&self, word: &str) -> Vec<&Substance> {
        self.all.iter().filter(|s| s.is_called(word)).collect()
    }

    /// The names that are nearest to a word, at most three.
    pub fn near(&self, word: &str) -> Vec<String> {
        near::nearest(word, self.all.iter().flat_map(Substance::names))
    }
}

impl Substance {
    /// Its name and its other ones.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.name.as_str()).chain(self.aliases.iter().map(String::as_str))
    }

    /// All by which it may be asked for: its names, its title and its synonyms.
    fn words(&self) -> impl Iterator<Item = &str> {
        self.names().chain([self.title()]).chain(self.synonyms.iter().map(String::as_str))
    }

    /// Whether a word is a name of it in other letters. An ion is not called by the formula of a salt: `FeSO4` is no other writing of
    /// `FeSO4+`.
    fn is_called(&self, word: &str) -> bool {
        let plain = plain(word);
        let charge = |name: &str| Formula::parse(name).ok().map(|formula| formula.charge);
        let is_other = |name: &str| matches!((charge(name), charge(word)), (Some(a), Some(b)) if a != b);
        self.words().any(|name| self::plain(name) == plain && !is_other(name))
    }

    /// The first sentence of its documentation, without the stop: `Propanone`.
    pub fn title(&self) -> &str {
        let line = self.about.split(". ").next().unwrap_or_default();
        line.trim_end_matches('.')
    }

    /// Whether it is a solid that splits into ions as it dissolves.
    fn is_solid_salt(&self) -> bool {
        let is_solid = |stated: &Stated| stated.property == "phase" && stated.value.trim_matches('"') == "solid";
        !self.ions.is_empty() && self.stated.iter().any(is_solid)
    }

    fn composition(&self) -> Option<Formula> {
        Formula::parse(self.formula.as_deref()?).ok()
    }

    fn is(&self, asked: &Structure) -> bool {
        // Structures are compared only where the atoms are the same: that is cheap.
        let (Some(smiles), Some(own)) = (&self.smiles, self.composition()) else { return false };
        own == asked.formula && Structure::parse(smiles).is_ok_and(|own| asked.same_where_stated(&own))
    }
}

/// A name without capitals, blanks and signs, sulphur as sulfur.
fn plain(name: &str) -> String {
    let letters: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    letters.replace("sulph", "sulf")
}

/// The modules that every file sees.
fn prelude(texts: &[Text]) -> Vec<String> {
    let listed = texts.iter().filter(|text| text.module == "std::prelude");
    listed.flat_map(|text| library::imported(&text.tree)).collect()
}

fn of_text(text: &Text, everywhere: &[String]) -> Vec<Substance> {
    let sources = explained(&text.tree.docs);
    let (mut out, mut aliases): (Vec<Substance>, Vec<(String, String)>) = (Vec::new(), Vec::new());
    for item in &text.tree.items {
        let ItemKind::Species { name, fields } = &item.kind else { continue };
        match field(fields, "same_as") {
            Some(FieldValue::Expr(expr)) if let ExprKind::Name(of) = &*expr.kind => {
                aliases.push((of.text.clone(), name.text.clone()));
            }
            _ => out.push(substance(text, item, (&name.text, fields), &sources, everywhere)),
        }
    }
    for (of, alias) in aliases {
        if let Some(known) = out.iter_mut().find(|s| s.name == of) {
            known.aliases.push(alias);
        }
    }
    out
}

fn substance(
    text: &Text,
    item: &Item,
    (name, fields): (&str, &[Field]),
    sources: &BTreeMap<String, String>,
    everywhere: &[String],
) -> Substance {
    let written = |key| {
        field(fields, key).and_then(|value| match value {
            FieldValue::Expr(expr) => match &*expr.kind {
                ExprKind::Text(t) => Some(t.clone()),
                _ => None,
            },
            _ => None,
        })
    };
    let formula = written("formula");
    let molar_mass = formula.as_deref().and_then(|f| Formula::parse(f).ok()?.molar_mass().ok());
    let import = !text.is_file && !everywhere.contains(&text.module);
    let about = item.docs.join(" ");
    let stated = fields.iter().filter(|f| !IDENTITY.contains(&f.key.text.as_str()));
    Substance {
        name: name.to_string(),
        aliases: Vec::new(),
        synonyms: texts(field(fields, "synonyms")),
        module: text.module.clone(),
        import: import.then(|| format!("use {}", text.module)),
        formula,
        molar_mass,
        cas: written("cas"),
        smiles: written("smiles"),
        stated: stated.map(|f| one(text, f, &about, sources)).collect(),
        ions: ions(field(fields, "dissolves")),
        equilibria: Vec::new(),
        about,
    }
}

fn field<'a>(fields: &'a [Field], key: &str) -> Option<&'a FieldValue> {
    fields.iter().find(|f| f.key.text == key).map(|f| &f.value)
}

/// The texts of a list, `["table salt", "rock salt"]`.
fn texts(value: Option<&FieldValue>) -> Vec<String> {
    let Some(FieldValue::Expr(expr)) = value else { return Vec::new() };
    let ExprKind::List(items) = &*expr.kind else { return Vec::new() };
    let text = |item: &Expr| match &*item.kind {
        ExprKind::Text(text) => Some(text.clone()),
        _ => None,
    };
    items.iter().filter_map(text).collect()
}

/// The species of `dissolves`.
fn ions(value: Option<&FieldValue>) -> Vec<String> {
    let Some(FieldValue::Species(terms)) = value else { return Vec::new() };
    terms.iter().map(|term| term.species.text.clone()).collect()
}

fn one(text: &Text, field: &Field, about: &str, sources: &BTreeMap<String, String>) -> Stated {
    let property = field.key.text.clone();
    let whole = part(&text.text, field.span);
    let value = whole.split_once(':').map_or(whole, |(_, value)| value).trim().to_string();
    // Formulas in quotes have digits, too.
    let is_word = WORDS.contains(&property.as_str()) || value.starts_with('"');
    let is_number = !is_word && value.contains(|c: char| c.is_ascii_digit());
    let source = is_number
        .then(|| tagged(&text.text, field.span, sources).or_else(|| told(&property, about, sources)))
        .flatten();
    Stated { property, value, source, is_number }
}

fn part(text: &str, span: Span) -> &str {
    text.get(span.start as usize..span.end as usize).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Modules whose numbers are measured.
    const MEASURED: &[&str] = &["std::species", "std::substances"];

    #[test]
    fn every_number_of_the_library_has_its_source() {
        let catalogue = Catalogue::read(&[]);
        let of = |s: &&Substance| MEASURED.contains(&s.module.as_str());
        let numbers = || {
            catalogue
                .all()
                .iter()
                .filter(of)
                .flat_map(|s| s.stated.iter().map(move |v| (s, v)))
                .filter(|(_, v)| v.is_number)
        };
        let lacking: Vec<String> = numbers()
            .filter(|(_, v)| v.source.is_none())
            .map(|(s, v)| format!("{}::{} {}: {}", s.module, s.name, v.property, v.value))
            .collect();
        assert!(lacking.is_empty(), "{}", lacking.join("\n"));
        assert!(numbers().count() > 2500, "{}", numbers().count());
    }

    #[test]
    fn every_constant_of_an_equilibrium_has_its_source() {
        let module = library::MODULES.iter().find(|m| m.name == "std::equilibria").expect("it is there");
        let (tree, _) = syntax::parse(FileId(0), module.text);
        let sources = explained(&tree.docs);
        let mut seen = 0;
        for item in &tree.items {
            let ItemKind::Equilibrium { name, fields, .. } = &item.kind else { continue };
            // Where a constant is valid is no number of a source.
            for field in fields.iter().filter(|f| f.key.text != "valid") {
                assert!(tagged(module.text, field.span, &sources).is_some(), "{} {}", name.text, field.key.text);
                seen += 1;
            }
        }
        assert!(seen > 10, "{seen}");
    }

    #[test]
    fn a_number_without_a_tag_or_with_an_unknown_one_has_no_source() {
        let text = "mtx 1\n//! Some.\n//!\n//! - `[crc]` A book,\n//!   on two lines.\n\n/// Acid.\nspecies Ac {\n    formula: \"C2H4O2\"\n    \
            density: 1 g/mL\n    melting_point: 3 degC  // [abc]\n    boiling_point: 4 degC  // [crc] alone\n}\n";
        let catalogue = Catalogue::read(&[("own.mtx".to_string(), text.to_string())]);
        let found = catalogue.find("Ac");
        let [Found { substances, .. }, ..] = found.as_slice() else { panic!("{found:?}") };
        let sources: Vec<Option<&Source>> = substances[0].stated.iter().map(|v| v.source.as_ref()).collect();
        let book = Source {
            tag: Some("crc".to_string()),
            text: "A book, on two lines.".to_string(),
            remark: "alone".to_string(),
        };
        assert_eq!(sources, [None, None, Some(&book)]);
    }

    #[test]
    fn a_synonym_is_a_name_that_several_may_share() {
        let text = "mtx 1\n/// A.\nspecies AA { formula: \"H2O4S\", synonyms: [\"my acid\", \"oil\"] }\n/// B.\nspecies BB { formula: \
            \"HCl\", synonyms: [\"oil\"] }\n";
        let catalogue = Catalogue::read(&[("own.mtx".to_string(), text.to_string())]);
        let found = |word: &str| -> Vec<String> {
            let groups = catalogue.find(word);
            let first = groups.first().filter(|group| group.by == "name");
            first.map(|group| group.substances.iter().map(|s| s.name.clone()).collect()).unwrap_or_default()
        };
        assert_eq!(found("My Acid"), ["AA"]);
        assert_eq!(found("oil"), ["AA", "BB"]);
        assert_eq!(found("sulphuric acid"), ["H2SO4"]);
    }

    #[test]
    fn no_two_substances_of_the_library_share_a_number_a_name_or_a_structure() {
        let catalogue = Catalogue::read(&[]);
        let mut seen: BTreeMap<(&str, &str), &str> = BTreeMap::new();
        let mut structures: BTreeMap<String, Vec<(&str, Structure)>> = BTreeMap::new();
        for s in catalogue.all() {
            let number = s.cas.as_deref().map(|cas| ("number", cas));
            for key in s.names().map(|name| ("name", name)).chain(number) {
                assert_eq!(seen.insert(key, &s.name), None, "{key:?}");
            }
            assert!(s.cas.as_deref().is_none_or(check_digit_holds), "{} {:?}", s.name, s.cas);
            let Some(structure) = s.smiles.as_deref().and_then(|smiles| Structure::parse(smiles).ok()) else {
                continue;
            };
            let same = structures.entry(format!("{:?}", structure.formula)).or_default();
            let twin = same.iter().find(|(_, other)| *other == structure);
            assert!(twin.is_none(), "{} is {}", s.name, twin.map_or("", |(name, _)| name));
            same.push((&s.name, structure));
        }
        assert!(catalogue.all().len() >= 400, "{}", catalogue.all().len());
    }

    /// The last digit of a CAS number is the sum of the others, each times its place from the right, modulo 10.
    fn check_digit_holds(cas: &str) -> bool {
        let mut digits: Vec<u32> = cas.chars().filter_map(|c| c.to_digit(10)).collect();
        let Some(last) = digits.pop() else { return false };
        let sum: u32 = digits.iter().rev().zip(1..).map(|(digit, place)| digit * place).sum();
        sum % 10 == last && cas.split('-').map(str::len).skip(1).eq([2, 1])
    }
}
