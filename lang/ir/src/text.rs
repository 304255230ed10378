//! Texts with values in them, put together when the step runs.

use serde::{Deserialize, Serialize};

use crate::quantity::{show_endless, show_number};
use crate::{NodeId, Unit};

/// A text of a note, a question or a failure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Text {
    /// In order.
    pub parts: Vec<TextPart>,
}

/// Words for where something is so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// What is so there: not 0 if it is.
    pub node: NodeId,
    /// The words.
    pub text: Text,
}

/// A piece of a [`Text`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TextPart {
    /// As written.
    Plain(String),
    /// A quantity.
    Quantity {
        /// SI.
        value: NodeId,
        /// As shown.
        unit: Unit,
        /// Digits after the point; six significant ones at most where absent.
        digits: Option<u8>,
    },
    /// `true` or `false`.
    Bool(NodeId),
    /// The name of an instance, or `nothing`.
    Instance(NodeId),
    /// One of these words, by its index.
    Word(NodeId, Vec<String>),
}

impl Text {
    /// The nodes whose values it shows.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> {
        self.parts.iter().filter_map(|part| match part {
            TextPart::Plain(_) => None,
            TextPart::Quantity { value: node, .. }
            | TextPart::Bool(node)
            | TextPart::Instance(node)
            | TextPart::Word(node, _) => Some(*node),
        })
    }

    /// The text with its values: `value` gives that of a node, or nothing where it cannot be known (shown as `?`),
    /// `instance` the name of one by its number in the graph.
    pub fn show<E>(
        &self,
        mut value: impl FnMut(NodeId) -> Result<Option<f64>, E>,
        instance: impl Fn(f64) -> String,
    ) -> Result<String, E> {
        self.filled(|part, node| {
            let Some(v) = value(node)? else { return Ok("?".to_owned()) };
            Ok(match part {
                TextPart::Quantity { unit, digits, .. } => quantity(unit, v, *digits),
                TextPart::Bool(_) => if v == 0.0 { "false" } else { "true" }.to_owned(),
                TextPart::Word(_, words) => words.get(v as usize).cloned().unwrap_or_else(|| "?".to_owned()),
                _ => instance(v),
            })
        })
    }

    /// The text with what `show` makes of its values, each a part and its node.
    pub fn filled<E>(&self, mut show: impl FnMut(&TextPart, NodeId) -> Result<String, E>) -> Result<String, E> {
        let mut out = String::new();
        for part in &self.parts {
            match part {
                TextPart::Plain(text) => out.push_str(text),
                TextPart::Quantity { value: node, .. }
                | TextPart::Bool(node)
                | TextPart::Instance(node)
                | TextPart::Word(node, _) => out.push_str(&show(part, *node)?),
            }
        }
        Ok(out)
    }
}

/// A value in a unit, with so many digits after the point.
fn quantity(unit: &Unit, si: f64, digits: Option<u8>) -> String {
    if let Some(endless) = show_endless(si) {
        return endless.to_owned();
    }
    let value = unit.of_si(si);
    let number = match digits {
        // Rounded to nothing, a small negative number is no longer negative.
        Some(digits) => match format!("{value:.*}", usize::from(digits)) {
            text if text.starts_with('-') && !text.bytes().any(|b| b.is_ascii_digit() && b != b'0') => {
                text[1..].to_owned()
            }
            text => text,
        },
        None => show_number(value),
    };
    if unit.symbol.is_empty() { number } else { format!("{number} {}", unit.symbol) }
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Text { parts: vec![TextPart::Plain(text.to_owned())] }
    }
}
