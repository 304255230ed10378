//! How a text has changed since it was looked at: places of one in the other.

/// One stretch that was replaced, as between two states of a text that is being typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drift {
    /// Bytes before it, alike in both.
    start: usize,
    /// Where it ended.
    old_end: usize,
    /// Where it ends.
    new_end: usize,
}

impl Drift {
    /// The smallest stretch that tells two texts apart.
    pub fn between(old: &str, new: &str) -> Drift {
        let alike = |a: &mut dyn Iterator<Item = u8>, b: &mut dyn Iterator<Item = u8>| {
            a.zip(b).take_while(|(a, b)| a == b).count()
        };
        let mut start = alike(&mut old.bytes(), &mut new.bytes());
        while !old.is_char_boundary(start) || !new.is_char_boundary(start) {
            start -= 1;
        }
        let most = old.len().min(new.len()) - start;
        let mut tail = alike(&mut old.bytes().rev(), &mut new.bytes().rev()).min(most);
        while !old.is_char_boundary(old.len() - tail) || !new.is_char_boundary(new.len() - tail) {
            tail -= 1;
        }
        Drift { start, old_end: old.len() - tail, new_end: new.len() - tail }
    }

    /// Whether nothing has changed.
    pub fn is_none(&self) -> bool {
        self.start == self.old_end && self.start == self.new_end
    }

    /// Where a place of the old text is now; of what was replaced the end.
    pub fn forward(&self, old: usize) -> usize {
        match old {
            _ if old <= self.start => old,
            _ if old >= self.old_end => old - self.old_end + self.new_end,
            _ => self.new_end,
        }
    }

    /// Where a place of the new text was; of what has come the start.
    pub fn back(&self, new: usize) -> usize {
        match new {
            _ if new <= self.start => new,
            _ if new >= self.new_end => new - self.new_end + self.old_end,
            _ => self.start,
        }
    }

    /// A range of the old text in the new one; none where it was touched.
    pub fn range(&self, start: usize, end: usize) -> Option<(usize, usize)> {
        let apart = self.is_none() || end < self.start || start > self.old_end;
        apart.then(|| (self.forward(start), self.forward(end)))
    }
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
}
