//! What is sent: texts with the values of a moment in them, and values taken back out of such texts.

use matterix_ir::NodeId;
use matterix_ir::quantity::show_number;
use matterix_ir::wire::{Piece, Template};

/// The text with its values; `None` where one is not known.
pub fn filled(template: &Template, mut value: impl FnMut(NodeId) -> Option<f64>) -> Option<String> {
    let mut out = String::new();
    for piece in &template.pieces {
        match piece {
            Piece::Plain(text) => out.push_str(text),
            Piece::Number { value: node, unit, digits } => {
                let number = unit.of_si(value(*node).filter(|v| v.is_finite())?);
                out.push_str(&match digits {
                    Some(digits) => fixed(number, *digits),
                    None => show_number(number),
                });
            }
            Piece::Word(node, words) => out.push_str(words.get(value(*node)? as usize)?),
        }
    }
    Some(out)
}

/// A number with so many digits after the point; rounded to nothing it has no sign.
pub fn fixed(number: f64, digits: u8) -> String {
    let text = format!("{number:.*}", usize::from(digits));
    match text.strip_prefix('-') {
        Some(rest) if !rest.bytes().any(|b| b.is_ascii_digit() && b != b'0') => rest.to_owned(),
        _ => text,
    }
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
    let mut out = Vec::new();
    let mut rest = message.trim();
    for piece in &template.pieces {
        match piece {
            Piece::Plain(text) => rest = rest.strip_prefix(text.as_str())?,
            Piece::Number { value, unit, .. } => {
                let end =
                    rest.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | '-' | '+')).unwrap_or(rest.len());
                let number: f64 = rest[..end].parse().ok().filter(|n: &f64| n.is_finite())?;
                let digits = rest[..end].split_once('.').map_or(0, |(_, d)| d.len());
                let precision = 0.5 * 10f64.powi(-(digits.min(15) as i32)) * unit.factor.abs();
                out.push(Found { node: *value, value: unit.to_si(number), precision, alike: Vec::new() });
                rest = &rest[end..];
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
    rest.trim().is_empty().then_some(out)
}
