//! The few lines in which two texts differ.

use std::ops::Range;

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
    let (a, b): (Vec<&str>, Vec<&str>) = (old.split_inclusive('\n').collect(), new.split_inclusive('\n').collect());
    let head = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let tail = a[head..].iter().rev().zip(b[head..].iter().rev()).take_while(|(a, b)| a == b).count();
    let (middle_a, middle_b) = (&a[head..a.len() - tail], &b[head..b.len() - tail]);
    let mut at: usize = a[..head].iter().map(|line| line.len()).sum();
    let mut out: Vec<Replacement> = Vec::new();
    let mut add = |range: Range<usize>, text: &str| match out.last_mut() {
        Some(last) if last.range.end == range.start => {
            last.range.end = range.end;
            last.text.push_str(text);
        }
        _ => out.push(Replacement { range, text: text.to_string() }),
    };
    if middle_a.len().saturating_mul(middle_b.len()) > MOST {
        let length: usize = middle_a.iter().map(|line| line.len()).sum();
        add(at..at + length, &middle_b.concat());
        return out;
    }
    let common = common(middle_a, middle_b);
    let (mut i, mut j) = (0, 0);
    while i < middle_a.len() || j < middle_b.len() {
        let (left, right) = (middle_a.get(i), middle_b.get(j));
        match (left, right) {
            (Some(left), Some(right)) if left == right => {
                at += left.len();
                i += 1;
                j += 1;
            }
            (Some(left), _) if right.is_none() || common[i + 1][j] >= common[i][j + 1] => {
                add(at..at + left.len(), "");
                at += left.len();
                i += 1;
            }
            (_, right) => {
                add(at..at, right.copied().unwrap_or_default());
                j += 1;
            }
        }
    }
    out
}

/// How many lines the rests of two texts have in common at most.
fn common(a: &[&str], b: &[&str]) -> Vec<Vec<u32>> {
    let mut table = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            table[i][j] = if a[i] == b[j] { table[i + 1][j + 1] + 1 } else { table[i + 1][j].max(table[i][j + 1]) };
        }
    }
    table
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
