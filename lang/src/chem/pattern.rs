//! Patterns of structures (SMARTS): whether a molecule has a group of atoms.

use chematic::smarts::{MatchConfig, QueryMolecule, has_match_perceived, parse_smarts};

use super::structure::{MAX_LENGTH, Structure, guarded};

/// A pattern of atoms and bonds.
#[derive(Clone, Debug)]
pub struct Pattern {
    query: QueryMolecule,
}

impl Pattern {
    /// Reads a SMARTS text; the error is the reader's, in its words.
    pub fn parse(text: &str) -> Result<Pattern, String> {
        if text.is_empty() {
            return Err("it is empty".into());
        }
        if text.len() > MAX_LENGTH || !text.chars().all(|c| c.is_ascii_graphic()) {
            return Err("too long, or not plain characters without blanks".into());
        }
        match guarded(|| parse_smarts(text)) {
            Some(Ok(query)) if !query.atoms.is_empty() => Ok(Pattern { query }),
            Some(Err(error)) => Err(error.to_string()),
            _ => Err("unsupported".into()),
        }
    }

    /// Whether the structure has it; absent where that could not be decided within bounds.
    pub fn is_in(&self, structure: &Structure) -> Option<bool> {
        guarded(|| has_match_perceived(&self.query, &structure.molecule, &MatchConfig::default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn has(pattern: &str, smiles: &str) -> bool {
        let structure = Structure::parse(smiles).expect(smiles);
        Pattern::parse(pattern).expect(pattern).is_in(&structure).expect("decided")
    }

    #[test]
    fn functional_groups_are_found() {
        for (pattern, smiles, expected) in [
            ("[#6][CX3](=O)[#6]", "CC(C)=O", true),
            ("[#6][CX3](=O)[#6]", "CCO", false),
            ("[CX4][OX2H]", "CCO", true),
            ("[CX4][OX2H]", "Oc1ccccc1", false),
            ("c[OX2H]", "Oc1ccccc1", true),
            ("c[OX2H]", "OC1=CC=CC=C1", true),
            ("[CX3](=O)[OX2H1]", "CC(=O)O", true),
            ("[CX3](=O)[OX2H1]", "CC(=O)OCC", false),
            ("[CX3;H1](=O)[#6]", "CC=O", true),
            ("[CX3;H1](=O)[#6]", "CC(C)=O", false),
            ("[NX3;H2,H1;!$(NC=O);!$(N-[!#6;!#1])]", "CCN", true),
            ("[NX3;H2,H1;!$(NC=O);!$(N-[!#6;!#1])]", "CC(N)=O", false),
            ("[#6][F,Cl,Br,I]", "ClC(Cl)Cl", true),
            ("[C-]#N", "[C-]#N", true),
            ("[OX2H][OX2H]", "OO", true),
        ] {
            assert_eq!(has(pattern, smiles), expected, "{pattern} in {smiles}");
        }
    }

    #[test]
    fn what_is_no_pattern_is_an_error() {
        for text in ["", "[", "C(", "C C", &"C".repeat(MAX_LENGTH + 1)] {
            assert!(Pattern::parse(text).is_err(), "{text}");
        }
    }
}
