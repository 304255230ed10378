//! What is sent: texts with the values of a moment in them, and values taken back out of such texts.

use matterix_ir::NodeId;
pub use matterix_ir::form::fixed;
use matterix_ir::wire::{Piece, Template};

/// The text with its values; in words why there is none, where one is not known or does not fit its form.
pub fn filled(template: &Template, mut value: impl FnMut(NodeId) -> Option<f64>) -> Result<String, String> {
    let mut out = String::new();
    for piece in &template.pieces {
        match piece {
            Piece::Plain(text) => out.push_str(text),
            Piece::Number { value: node, unit, form } => {
                let known = value(*node).filter(|v| v.is_finite());
                let known = known.ok_or_else(|| format!("a number of `{}` is unknown", written(template)))?;
                let sent = form
                    .put(unit, known)
                    .map_err(|why| format!("{} cannot be sent in `{}`: {why}", unit.show(known), written(template)))?;
                out.push_str(&sent);
            }
            Piece::Word(node, words) => {
                let word = value(*node).and_then(|index| words.get(index as usize));
                out.push_str(word.ok_or_else(|| format!("a word of `{}` is unknown", written(template)))?);
            }
        }
    }
    Ok(out)
}

/// The template as it was written, for messages.
pub fn written(template: &Template) -> String {
    let piece = |piece: &Piece| match piece {
        Piece::Plain(text) => text.clone(),
        Piece::Number { unit, .. } => format!("{{{}}}", unit.symbol),
        Piece::Word(_, words) => format!("{{{}}}", words.join(" | ")),
    };
    template.pieces.iter().map(piece).collect()
}

/// A value that stands in a message, as it stands there.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Which value it is.
    pub node: NodeId,
    /// SI; the index of a word.
    pub value: f64,
    /// Half of the last digit, SI.
    pub precision: f64,
    /// Other values that are written alike.
    pub alike: Vec<f64>,
}

impl Found {
    /// Whether a value is written like this.
    pub fn fits(&self, value: f64) -> bool {
        (value - self.value).abs() <= self.precision * (1.0 + 1e-9) + 1e-12 * self.value.abs()
            || self.alike.contains(&value)
    }
}

/// The values of a message of this form; nothing where it has another.
pub fn found(template: &Template, message: &str) -> Option<Vec<Found>> {
    found_in(template, message, false)
}

/// The same; where it is `exact`, blanks around a message belong to it.
pub fn found_in(template: &Template, message: &str, exact: bool) -> Option<Vec<Found>> {
    let mut out = Vec::new();
    let mut rest = if exact { message } else { message.trim() };
    for piece in &template.pieces {
        match piece {
            Piece::Plain(text) => rest = rest.strip_prefix(text.as_str())?,
            Piece::Number { value, unit, form } => {
                let read = form.read(rest)?;
                let precision = read.half * unit.factor.abs();
                out.push(Found { node: *value, value: unit.to_si(read.number), precision, alike: Vec::new() });
                rest = &rest[read.length..];
            }
            Piece::Word(node, words) => {
                let longest = words.iter().enumerate().filter(|(_, w)| rest.starts_with(w.as_str()));
                let (index, word) = longest.min_by_key(|(i, w)| (std::cmp::Reverse(w.len()), *i))?;
                let same = words.iter().enumerate().skip(index + 1).filter(|(_, w)| *w == word);
                let alike = same.map(|(i, _)| i as f64).collect();
                out.push(Found { node: *node, value: index as f64, precision: 0.0, alike });
                rest = &rest[word.len()..];
            }
        }
    }
    (if exact { rest.is_empty() } else { rest.trim().is_empty() }).then_some(out)
}
