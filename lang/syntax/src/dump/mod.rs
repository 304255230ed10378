//! The tree as text, without spans: for golden files, and to compare two trees.

mod exprs;
mod items;
mod steps;

use crate::ast::{File, Name};

/// The tree of a file as indented s-expressions, without spans.
pub fn dump(file: &File) -> String {
    let mut root = node("file").with(file.version.map(|v| leaf(format!("mtx {v}")))).with(items::docs(&file.docs));
    root.parts.extend(file.items.iter().map(items::item));
    let mut text = String::new();
    root.print(0, &mut text);
    text.push('\n');
    text
}

/// `(head part part)`; without parts, `head`.
struct Sexp {
    head: String,
    parts: Vec<Sexp>,
}

/// The longest node that stays on one line.
const LINE: usize = 100;

impl Sexp {
    fn with(mut self, parts: impl IntoIterator<Item = Sexp>) -> Sexp {
        self.parts.extend(parts);
        self
    }

    /// The length on one line, as far as it matters.
    fn width(&self) -> usize {
        let mut width = self.head.chars().count() + 2;
        for part in &self.parts {
            if width > LINE {
                break;
            }
            width += part.width() + 1;
        }
        width
    }

    fn print(&self, indent: usize, text: &mut String) {
        if self.parts.is_empty() {
            text.push_str(&self.head);
            return;
        }
        text.push('(');
        text.push_str(&self.head);
        let flat = indent * 2 + self.width() <= LINE;
        for part in &self.parts {
            if flat {
                text.push(' ');
            } else {
                text.push('\n');
                text.push_str(&"  ".repeat(indent + 1));
            }
            part.print(indent + 1, text);
        }
        text.push(')');
    }
}

/// A node that gets its parts by [`Sexp::with`].
fn node(head: impl Into<String>) -> Sexp {
    Sexp { head: head.into(), parts: Vec::new() }
}

fn leaf(text: impl Into<String>) -> Sexp {
    node(text)
}

fn name(name: &Name) -> Sexp {
    leaf(&name.text)
}

fn names(all: &[Name]) -> Vec<Sexp> {
    all.iter().map(name).collect()
}

fn quoted(text: &str) -> Sexp {
    leaf(format!("{text:?}"))
}
