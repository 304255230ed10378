//! How a text has changed since it was looked at: places of one in the other.

use std::ops::Range;

use crate::edits::stretches;

/// What was replaced between two states of a text, stretch by stretch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drift {
    stretches: Vec<Stretch>,
}

/// Bytes that others have taken the place of.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stretch {
    old: Range<usize>,
    new: Range<usize>,
}

impl Drift {
    /// Small stretches that tell two texts apart: of the lines that differ, from the first letter that does to the last.
    pub fn between(old: &str, new: &str) -> Drift {
        let small = |(from, to)| Stretch::of(old, from, new, to);
        Drift { stretches: stretches(old, new).into_iter().filter_map(small).collect() }
    }

    /// Whether nothing has changed.
    pub fn is_none(&self) -> bool {
        self.stretches.is_empty()
    }

    /// Where a place of the old text is now; of what was replaced the end.
    pub fn forward(&self, old: usize) -> usize {
        match self.stretches.iter().rfind(|stretch| stretch.old.start < old) {
            None => old,
            Some(stretch) if old >= stretch.old.end => old - stretch.old.end + stretch.new.end,
            Some(stretch) => stretch.new.end,
        }
    }

    /// Where a place of the new text was; of what has come the start.
    pub fn back(&self, new: usize) -> usize {
        match self.stretches.iter().rfind(|stretch| stretch.new.start < new) {
            None => new,
            Some(stretch) if new >= stretch.new.end => new - stretch.new.end + stretch.old.end,
            Some(stretch) => stretch.old.start,
        }
    }

    /// A range of the old text in the new one; none where it was touched.
    pub fn range(&self, start: usize, end: usize) -> Option<(usize, usize)> {
        let apart = self.stretches.iter().all(|stretch| end < stretch.old.start || start > stretch.old.end);
        apart.then(|| (self.forward(start), self.forward(end)))
    }
}

impl Stretch {
    /// The smallest stretch that tells a part of one text from a part of another; none where they are alike.
    fn of(old: &str, from: Range<usize>, new: &str, to: Range<usize>) -> Option<Stretch> {
        let alike = |a: &mut dyn Iterator<Item = u8>, b: &mut dyn Iterator<Item = u8>| {
            a.zip(b).take_while(|(a, b)| a == b).count()
        };
        let (a, b) = (slice(old, &from), slice(new, &to));
        let mut head = alike(&mut a.bytes(), &mut b.bytes());
        while !a.is_char_boundary(head) || !b.is_char_boundary(head) {
            head -= 1;
        }
        let most = a.len().min(b.len()) - head;
        let mut tail = alike(&mut a.bytes().rev(), &mut b.bytes().rev()).min(most);
        while !a.is_char_boundary(a.len() - tail) || !b.is_char_boundary(b.len() - tail) {
            tail -= 1;
        }
        let stretch = Stretch { old: from.start + head..from.end - tail, new: to.start + head..to.end - tail };
        (!stretch.old.is_empty() || !stretch.new.is_empty()).then_some(stretch)
    }
}

fn slice<'t>(text: &'t str, range: &Range<usize>) -> &'t str {
    text.get(range.clone()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_move_with_what_was_typed() {
        let drift = Drift::between("heat plate to 8 degC", "heat plate to 80 degC");
        assert_eq!((drift.forward(5), drift.forward(16), drift.back(17)), (5, 17, 16));
        assert!(drift.range(0, 10).is_some() && drift.range(10, 20).is_none());
        let drift = Drift::between("1 µL", "1 mL");
        assert_eq!(drift.forward(4), 3);
        assert!(Drift::between("°", "°").is_none());
        assert_eq!(Drift::between("aa", "aaa").forward(1), 1);
    }

    #[test]
    fn what_stands_between_two_changes_is_found() {
        let old = "use a\nlab x {\n    cup\n}\nworkflow w in x {\n    wait 5 s\n}\n";
        let new = "use a // 😀\nlab x {\n    cup\n}\nworkflow w in x {\n    wait 5 s\n}\n// end é\n";
        let drift = Drift::between(old, new);
        for (at, _) in old.char_indices().filter(|(at, c)| *at > 5 && !c.is_whitespace()) {
            assert_eq!(new[drift.forward(at)..].chars().next(), old[at..].chars().next(), "{at}");
            assert_eq!(drift.back(drift.forward(at)), at);
        }
        assert_eq!(
            drift.range(old.find("cup").unwrap(), old.find("}").unwrap()).map(|r| &new[r.0..r.1]),
            Some("cup\n")
        );
    }

    #[test]
    fn places_of_any_two_texts_stay_in_them() {
        let texts = ["", "a", "a\nb\nc\n", "c\na\nµ\n\nb", "x\na\nb\nb\nc", "\n\n\n", "µ\nµ\na\nb\nc\n"];
        for (old, new) in texts.iter().flat_map(|old| texts.iter().map(move |new| (*old, *new))) {
            let drift = Drift::between(old, new);
            let forward: Vec<usize> = (0..=old.len()).map(|at| drift.forward(at)).collect();
            let back: Vec<usize> = (0..=new.len()).map(|at| drift.back(at)).collect();
            assert!(forward.is_sorted() && back.is_sorted(), "{old:?} {new:?}");
            assert!(forward.iter().all(|at| *at <= new.len()) && back.iter().all(|at| *at <= old.len()));
            assert_eq!(drift.is_none(), old == new);
        }
    }
}
