//! Structures from SMILES, and the only door to the crate that reads them.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::RwLock;

use chematic::core::{AtomIdx, Molecule, implicit_hcount};
use chematic::smiles::{self, SmilesError};

use super::elements::Element;
use super::formula::Formula;
use super::rational::Rational;

/// Most bytes of a SMILES text; longer ones are refused before the crate sees them.
pub const MAX_LENGTH: usize = 2_000;
/// Most atoms of a molecule, written hydrogens included.
const MAX_ATOMS: usize = 400;

/// So many texts are kept with what they say.
const MOST_KEPT: usize = 4096;

/// Structures by their texts: those of the library are asked for again in every check that an editor has made.
static KEPT: RwLock<BTreeMap<String, Structure>> = RwLock::new(BTreeMap::new());

/// A molecule or ion, or several (`[K+].[I-]`).
#[derive(Clone)]
pub struct Structure {
    /// The same text for every way to write the structure.
    pub canonical: String,
    /// Atoms, implicit hydrogens included, and the net charge.
    pub formula: Formula,
    pub(crate) molecule: Molecule,
}

/// Why a text is not a structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructureError {
    /// What.
    pub kind: StructureErrorKind,
    /// Byte in the text given; absent where the whole text is meant.
    pub offset: Option<usize>,
}

/// The kinds of mistakes in a SMILES text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StructureErrorKind {
    /// Nothing is written.
    Empty,
    /// A character that has no place here.
    UnexpectedCharacter,
    /// The text ends inside an atom or branch.
    UnexpectedEnd,
    /// A symbol in brackets that no element has.
    UnknownElement(String),
    /// A ring bond that is opened and not closed, by its number.
    OpenRing(u32),
    /// The two ends of a ring bond differ in bond order, by its number.
    ConflictingRing(u32),
    /// Parentheses that do not pair.
    Parentheses,
    /// An atom in brackets that cannot be read.
    BracketAtom(String),
    /// More bonds than the element has.
    Valence(&'static str),
    /// A lower-case (aromatic) ring to which no double bonds can be given.
    NotAromatic,
    /// `*`, which stands for no element.
    Wildcard,
    /// Too long or nested too deeply.
    TooLarge,
    /// Not understood for another reason.
    Unsupported,
}

impl Structure {
    /// Reads a SMILES text.
    pub fn parse(text: &str) -> Result<Structure, StructureError> {
        if text.len() > MAX_LENGTH {
            return Err(whole(StructureErrorKind::TooLarge));
        }
        // Spaces would begin a name or an extension, which is no part of a structure.
        if let Some((offset, _)) = text.char_indices().find(|(_, c)| !c.is_ascii_graphic()) {
            return Err(StructureError { kind: StructureErrorKind::UnexpectedCharacter, offset: Some(offset) });
        }
        if let Some(known) = KEPT.read().ok().and_then(|kept| kept.get(text).cloned()) {
            return Ok(known);
        }
        let read = guarded(|| {
            let molecule = smiles::parse(text).map_err(|e| reworded(e, text))?;
            Structure::made(molecule)
        });
        let read = read.unwrap_or(Err(whole(StructureErrorKind::Unsupported)));
        if let (Ok(structure), Ok(mut kept)) = (&read, KEPT.write()) {
            if kept.len() >= MOST_KEPT {
                kept.clear();
            }
            kept.insert(text.to_string(), structure.clone());
        }
        read
    }

    /// The structure of a molecule that was read or that a template made.
    pub(crate) fn made(molecule: Molecule) -> Result<Structure, StructureError> {
        if molecule.atom_count() > MAX_ATOMS {
            return Err(whole(StructureErrorKind::TooLarge));
        }
        let formula = formula_of(&molecule)?;
        if chematic::core::kekulize(&molecule).is_err() {
            return Err(whole(StructureErrorKind::NotAromatic));
        }
        if let Some(fault) = chematic::core::validate_valence(&molecule).first() {
            return Err(whole(StructureErrorKind::Valence(molecule.atom(fault.atom).element.symbol())));
        }
        Ok(Structure { canonical: canonical(&molecule), formula, molecule })
    }

    /// Whether both are the same, stereochemistry apart where one of them states none.
    pub fn same_where_stated(&self, other: &Structure) -> bool {
        let flat = |s: &Structure| s.without_stereo().unwrap_or_else(|| s.canonical.clone());
        self == other
            || (self.formula == other.formula && {
                let (a, b) = (flat(self), flat(other));
                a == b && (a == self.canonical || b == other.canonical)
            })
    }

    /// Canonical SMILES of the same atoms and bonds without stereochemistry.
    fn without_stereo(&self) -> Option<String> {
        let text = self.canonical.replace(['@', '/', '\\'], "");
        Some(Structure::parse(&text).ok()?.canonical)
    }
}

impl std::fmt::Debug for Structure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Structure({}, {})", self.canonical, self.formula)
    }
}

impl PartialEq for Structure {
    /// The same structure, however it was written.
    fn eq(&self, other: &Structure) -> bool {
        self.canonical == other.canonical
    }
}

/// Runs code of the structure crate; `None` where it panics. The crate is young and takes text that a user types, and a
/// compiler must answer any text with a message.
pub(crate) fn guarded<T>(run: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(run)).ok()
}

fn canonical(molecule: &Molecule) -> String {
    smiles::rdkit_canonical_smiles(molecule).unwrap_or_else(|_| smiles::canonical_smiles(molecule))
}

fn formula_of(molecule: &Molecule) -> Result<Formula, StructureError> {
    let mut formula = Formula::default();
    let too_large = || whole(StructureErrorKind::TooLarge);
    for index in (0..molecule.atom_count() as u32).map(AtomIdx) {
        let atom = molecule.atom(index);
        if atom.wildcard {
            return Err(whole(StructureErrorKind::Wildcard));
        }
        let element = Element::from_number(atom.element.atomic_number())
            .ok_or_else(|| whole(StructureErrorKind::UnknownElement(atom.element.symbol().into())))?
            .with_mass_number(atom.isotope.unwrap_or(0));
        formula.charge += i32::from(atom.charge);
        formula.add(element, Rational::ONE).ok_or_else(too_large)?;
        let hydrogens = i64::from(implicit_hcount(molecule, index));
        formula.add(Element::H, Rational::whole(hydrogens)).ok_or_else(too_large)?;
    }
    Ok(formula)
}

fn whole(kind: StructureErrorKind) -> StructureError {
    StructureError { kind, offset: None }
}

fn reworded(error: SmilesError, text: &str) -> StructureError {
    use StructureErrorKind as Kind;
    let (kind, pos) = match error {
        SmilesError::EmptyInput => (Kind::Empty, None),
        SmilesError::UnexpectedEnd { pos } => (Kind::UnexpectedEnd, Some(pos)),
        SmilesError::UnknownElement { symbol, pos } => (Kind::UnknownElement(symbol), Some(pos)),
        SmilesError::UnmatchedRingClosure { ring_num, pos } => (Kind::OpenRing(ring_num.into()), Some(pos)),
        SmilesError::UnmatchedExtendedRingClosure { ring_num, pos } => (Kind::OpenRing(ring_num), Some(pos)),
        SmilesError::ConflictingRingBond { ring_num, pos } => (Kind::ConflictingRing(ring_num.into()), Some(pos)),
        SmilesError::ConflictingExtendedRingBond { ring_num, pos } => (Kind::ConflictingRing(ring_num), Some(pos)),
        SmilesError::MismatchedParentheses { pos } => (Kind::Parentheses, Some(pos)),
        SmilesError::InvalidBracketAtom { detail, pos } => match symbol_at(text, pos) {
            Some(symbol) if detail.contains("symbol") => (Kind::UnknownElement(symbol), Some(pos)),
            _ => (Kind::BracketAtom(detail), Some(pos)),
        },
        SmilesError::UnexpectedCharacter { pos } if text[pos.min(text.len())..].starts_with(')') => {
            (Kind::Parentheses, Some(pos))
        }
        SmilesError::UnexpectedCharacter { pos } => (Kind::UnexpectedCharacter, Some(pos)),
        SmilesError::NestingTooDeep { pos } => (Kind::TooLarge, Some(pos)),
        SmilesError::ResourceLimit { .. } => (Kind::TooLarge, None),
        SmilesError::UnsupportedChiralityClass { class, pos } => (Kind::BracketAtom(class), Some(pos)),
        SmilesError::InvalidValence { element, .. } => (Kind::Valence(element), None),
    };
    StructureError { kind, offset: pos.map(|p| p.min(text.len())) }
}

/// What looks like an element's symbol at a place.
fn symbol_at(text: &str, pos: usize) -> Option<String> {
    let rest = text.get(pos..)?;
    let letters: String = rest.chars().take_while(char::is_ascii_alphabetic).take(2).collect();
    (!letters.is_empty()).then_some(letters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn formula(text: &str) -> String {
        Structure::parse(text).expect(text).formula.to_string()
    }

    fn mistake(text: &str) -> (StructureErrorKind, Option<usize>) {
        let error = Structure::parse(text).expect_err(text);
        (error.kind, error.offset)
    }

    #[test]
    fn implicit_hydrogens_are_counted() {
        for (text, expected) in [
            ("O", "H2O"),
            ("CCO", "C2H6O"),
            ("I", "HI"),
            ("[H]I", "HI"),
            ("[H][H]", "H2"),
            ("[H+]", "H+"),
            ("[K+].[I-]", "IK"),
            ("[Ca+2]", "Ca^2+"),
            ("c1ccccc1", "C6H6"),
            ("CC(=O)Oc1ccccc1C(=O)O", "C9H8O4"),
            ("OC[C@@H](O)[C@H]1OC(=O)C(O)=C1O", "C6H8O6"),
            ("[O-]S(=O)(=O)[O-]", "O4S^2-"),
            ("OS(=O)(=O)O", "H2O4S"),
            ("CS(C)=O", "C2H6OS"),
            ("[2H]O[2H]", "[2H]2O"),
            ("[13CH4]", "[13C]H4"),
            ("[N+](=O)([O-])O", "HNO3"),
            ("OP(=O)(O)O", "H3O4P"),
            ("c1cc[nH]c1", "C4H5N"),
        ] {
            assert_eq!(formula(text), expected, "{text}");
        }
    }

    #[test]
    fn the_way_of_writing_does_not_matter() {
        for (a, b) in [
            ("CCO", "OCC"),
            ("c1ccccc1", "C1=CC=CC=C1"),
            ("[H]I", "I"),
            ("CC(=O)Oc1ccccc1C(=O)O", "OC(=O)C1=CC=CC=C1OC(C)=O"),
            ("C/C=C/C", "C\\C=C\\C"),
            ("[H]O[H]", "O"),
        ] {
            assert_eq!(Structure::parse(a).expect(a), Structure::parse(b).expect(b));
        }
        for (a, b) in [("C/C=C/C", "C/C=C\\C"), ("N[C@@H](C)C(=O)O", "N[C@H](C)C(=O)O"), ("CCO", "COC")] {
            assert_ne!(Structure::parse(a).expect(a), Structure::parse(b).expect(b));
        }
    }

    #[test]
    fn mistakes_are_located() {
        use StructureErrorKind::*;
        assert_eq!(mistake(""), (Empty, None));
        assert_eq!(mistake("CC O"), (UnexpectedCharacter, Some(2)));
        assert_eq!(mistake("CCµ"), (UnexpectedCharacter, Some(2)));
        assert_eq!(mistake("C1CC").0, OpenRing(1));
        assert_eq!(mistake("C*"), (Wildcard, None));
        assert_eq!(mistake("C(C)(C)(C)(C)C").0, Valence("C"));
        assert_eq!(mistake("c1cccc1").0, NotAromatic);
        assert_eq!(mistake("CC)"), (Parentheses, Some(2)));
        assert_eq!(mistake("CC(C").0, Parentheses);
        assert_eq!(mistake("C[Xx]"), (UnknownElement("Xx".into()), Some(2)));
        assert_eq!(mistake(&"C".repeat(MAX_LENGTH + 1)), (TooLarge, None));
    }

    #[test]
    fn stereochemistry_counts_where_both_state_it() {
        let same = |a: &str, b: &str| Structure::parse(a).expect(a).same_where_stated(&Structure::parse(b).expect(b));
        assert!(same("N[C@@H](C)C(=O)O", "NC(C)C(=O)O"));
        assert!(same("CC=CC", "C/C=C/C"));
        assert!(!same("N[C@@H](C)C(=O)O", "N[C@H](C)C(=O)O"));
        assert!(!same("C/C=C/C", "C/C=C\\C"));
        assert!(!same("CCO", "COC"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn garbage_is_an_error_inside_the_text(text in "\\PC{0,40}") {
            if let Err(StructureError { offset: Some(offset), .. }) = Structure::parse(&text) {
                prop_assert!(offset <= text.len());
            }
        }

        #[test]
        fn smiles_like_garbage_neither_panics_nor_hangs(text in "[CNOSPFIBrclnosph0-9()\\[\\]=#@+.:/%*-]{1,30}") {
            let read = guarded(|| smiles::parse(&text).ok().map(|m| canonical(&m)));
            prop_assert!(read.is_some(), "the crate panics on {text}");
            let _ = Structure::parse(&text);
        }

        #[test]
        fn canonical_text_reads_back(text in "[CNO]{1,4}(\\([CNOFI]{1,3}\\))?[CNO]{0,3}(=O)?") {
            if let Ok(structure) = Structure::parse(&text) {
                prop_assert_eq!(&Structure::parse(&structure.canonical).expect(&structure.canonical), &structure);
            }
        }
    }
}
