//! The few lines in which two texts differ.

use std::ops::Range;

use similar::{Algorithm, DiffTag, capture_diff_slices};

/// A stretch of the old text and what stands for it in the new one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replacement {
    /// Bytes of the old text.
    pub range: Range<usize>,
    /// The new text.
    pub text: String,
}

/// Pairs of lines beyond which two stretches are not compared line by line.
const MOST: usize = 4 << 20;

/// Whole lines to be replaced so that the old text becomes the new one, in order.
pub fn replacements(old: &str, new: &str) -> Vec<Replacement> {
    let text = |range: Range<usize>| new.get(range).unwrap_or_default().to_string();
    stretches(old, new).into_iter().map(|(range, by)| Replacement { range, text: text(by) }).collect()
}

/// Where whole lines differ: bytes of the old text, and those of the new one that stand for them, in order.
pub(crate) fn stretches(old: &str, new: &str) -> Vec<(Range<usize>, Range<usize>)> {
    let (a, b): (Vec<&str>, Vec<&str>) = (old.split_inclusive('\n').collect(), new.split_inclusive('\n').collect());
    let head = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let tail = a[head..].iter().rev().zip(b[head..].iter().rev()).take_while(|(a, b)| a == b).count();
    let (from, to) = (head..a.len() - tail, head..b.len() - tail);
    let (starts, starts_new) = (starts(&a), starts(&b));
    let bytes = |from: Range<usize>, to: Range<usize>| {
        (starts[from.start]..starts[from.end], starts_new[to.start]..starts_new[to.end])
    };
    if from.len().saturating_mul(to.len()) > MOST {
        return vec![bytes(from, to)];
    }
    let all = capture_diff_slices(Algorithm::Myers, &a[from], &b[to]);
    let differ = all.into_iter().filter(|op| op.tag() != DiffTag::Equal);
    let behind = |lines: Range<usize>| lines.start + head..lines.end + head;
    differ.map(|op| bytes(behind(op.old_range()), behind(op.new_range()))).collect()
}

/// Where each line begins, and where the last one ends.
fn starts(lines: &[&str]) -> Vec<usize> {
    let ends = lines.iter().scan(0, |at, line| {
        *at += line.len();
        Some(*at)
    });
    std::iter::once(0).chain(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(old: &str, new: &str) -> (String, usize) {
        let all = replacements(old, new);
        let mut text = old.to_string();
        for r in all.iter().rev() {
            text.replace_range(r.range.clone(), &r.text);
        }
        (text, all.len())
    }

    #[test]
    fn replacements_give_the_new_text() {
        for (old, new, count) in [
            ("a\nb\nc\n", "a\nB\nc\n", 1),
            ("a\nb\nc\n", "a\nc\n", 1),
            ("", "a\n", 1),
            ("a\nb", "a\nb", 0),
            ("a\n1\nb\n2\nc", "a\nx\nb\ny\nc\n", 2),
        ] {
            assert_eq!(applied(old, new), (new.to_string(), count), "{old:?}");
        }
    }
}
