//! What a database says of interactions: its block PITZER.

use super::database::{TERMS, leading_numbers};
use super::lines::Line;
use crate::Mistake;

/// Options whose lines have two or three species and the terms of a number, and how the language calls that number.
const NUMBERS: &[(&str, usize, &str)] = &[
    ("b0", 2, "b0"),
    ("b1", 2, "b1"),
    ("b2", 2, "b2"),
    ("c0", 2, "c0"),
    ("theta", 2, "theta"),
    ("lambda", 2, "lambda"),
    ("lamda", 2, "lambda"),
    ("zeta", 3, "zeta"),
    ("psi", 3, "psi"),
];

/// Two or three species with their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Interaction {
    /// As the database writes them, in the order of their names.
    pub species: Vec<String>,
    /// The line of its first number.
    pub line: usize,
    /// Numbers as the language calls them, each with its terms.
    pub numbers: Vec<(&'static str, Vec<f64>)>,
    /// How fast numbers fade, where it is not as usual.
    pub reach: Vec<f64>,
}

/// The block as it is read.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// What is under way.
    option: Option<Under>,
    /// What was found.
    pub found: Vec<Interaction>,
    /// Options that are not imported, with their lines.
    pub unread: Vec<(usize, String)>,
}

#[derive(Clone, Copy, Debug)]
enum Under {
    Number(usize, &'static str),
    Alphas,
    Unread,
}

impl Block {
    /// Takes in a line of the block.
    pub fn line(&mut self, line: Line<'_>) -> Result<(), Mistake> {
        if let Some((name, rest)) = line.option() {
            self.option = Some(match NUMBERS.iter().find(|(option, ..)| *option == name) {
                Some((_, count, number)) => Under::Number(*count, number),
                None if name == "alphas" => Under::Alphas,
                // Both say how the library does it too.
                None if name == "use_etheta" && !rest.trim().to_ascii_lowercase().starts_with('f') => Under::Unread,
                None if name == "macinnes" && rest.trim().to_ascii_lowercase().starts_with('f') => Under::Unread,
                None => {
                    self.unread.push((line.number, format!("-{name}")));
                    Under::Unread
                }
            });
            return Ok(());
        }
        let words: Vec<&str> = line.text.split_whitespace().collect();
        let lacks = || Mistake { line: line.number, why: format!("`{}` lacks a species or a number", line.text) };
        let terms = |count: usize| leading_numbers(words[count..].iter().copied());
        match self.option {
            Some(Under::Number(count, number)) => {
                if words.len() <= count {
                    return Err(lacks());
                }
                let mut terms = terms(count);
                if terms.is_empty() {
                    return Err(lacks());
                }
                terms.truncate(TERMS);
                while terms.len() > 1 && terms.last() == Some(&0.0) {
                    terms.pop();
                }
                let numbers = &mut self.between(&words[..count], line.number).numbers;
                // What is said again counts as it is said last.
                numbers.retain(|(known, _)| *known != number);
                numbers.push((number, terms));
                Ok(())
            }
            Some(Under::Alphas) => {
                let reach = if words.len() < 4 { Vec::new() } else { terms(2) };
                if reach.len() != 2 {
                    return Err(lacks());
                }
                self.between(&words[..2], line.number).reach = reach;
                Ok(())
            }
            Some(Under::Unread) => Ok(()),
            None => Err(Mistake { line: line.number, why: "a number comes before the first option".into() }),
        }
    }

    fn between(&mut self, species: &[&str], line: usize) -> &mut Interaction {
        let mut species: Vec<String> = species.iter().map(|s| (*s).to_owned()).collect();
        species.sort();
        let at = match self.found.iter().position(|known| known.species == species) {
            Some(at) => at,
            None => {
                self.found.push(Interaction { species, line, numbers: Vec::new(), reach: Vec::new() });
                self.found.len() - 1
            }
        };
        &mut self.found[at]
    }
}
