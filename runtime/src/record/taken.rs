//! What `record` statements took.

use std::collections::BTreeMap;

/// A value taken by a `record` statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedValue<'a> {
    /// s.
    pub time: f64,
    /// Name of the record.
    pub name: &'a str,
    /// SI; several for a tuple.
    pub values: &'a [f64],
}

/// Values in order of occurrence. A long run takes very many: one costs 16 bytes, and 8 more for each of its numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Taken {
    indices: BTreeMap<String, u32>,
    names: Vec<String>,
    marks: Vec<Mark>,
    /// Those of each mark after those of the one before.
    numbers: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Mark {
    time: f64,
    /// Index into the names.
    name: u32,
    /// Where its numbers begin; they end where those of the next begin.
    from: u32,
}

/// The values of one record, in order of occurrence.
#[derive(Clone, Debug)]
pub struct Record<'a> {
    taken: &'a Taken,
    marks: Vec<u32>,
}

impl Taken {
    /// Takes one more, no earlier than the last.
    pub fn push(&mut self, time: f64, name: &str, values: &[f64]) {
        let next = self.names.len() as u32;
        let index = self.indices.get(name).copied().unwrap_or_else(|| {
            self.indices.insert(name.to_owned(), next);
            self.names.push(name.to_owned());
            next
        });
        self.marks.push(Mark { time, name: index, from: self.numbers.len() as u32 });
        self.numbers.extend_from_slice(values);
    }

    /// Whether nothing was taken.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// All of them, in order of occurrence.
    pub fn iter(&self) -> impl Iterator<Item = RecordedValue<'_>> {
        (0..self.marks.len()).filter_map(|i| self.get(i))
    }

    /// Each record by its name.
    pub fn by_name(&self) -> BTreeMap<&str, Record<'_>> {
        let mut lists = vec![Vec::new(); self.names.len()];
        for (index, mark) in (0..).zip(&self.marks) {
            if let Some(list) = lists.get_mut(mark.name as usize) {
                list.push(index);
            }
        }
        let records = lists.into_iter().map(|marks| Record { taken: self, marks });
        self.names.iter().map(String::as_str).zip(records).collect()
    }

    fn get(&self, index: usize) -> Option<RecordedValue<'_>> {
        let mark = self.marks.get(index)?;
        let end = self.marks.get(index + 1).map_or(self.numbers.len(), |next| next.from as usize);
        let values = self.numbers.get(mark.from as usize..end)?;
        Some(RecordedValue { time: mark.time, name: self.names.get(mark.name as usize)?, values })
    }
}

impl<'a> Record<'a> {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.marks.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// The values, in order of occurrence.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = RecordedValue<'a>> + Clone + '_ {
        self.marks.iter().filter_map(|index| self.taken.get(*index as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_given_back_in_order_and_by_name() {
        let mut taken = Taken::default();
        let given: [(f64, &str, &[f64]); 4] =
            [(0.0, "b", &[1.0]), (0.0, "a", &[2.0, 3.0]), (5.0, "b", &[4.0]), (6.0, "none", &[])];
        for (time, name, values) in given {
            taken.push(time, name, values);
        }
        assert!(taken.iter().map(|v| (v.time, v.name, v.values)).eq(given));
        let by_name = taken.by_name();
        assert_eq!(by_name.keys().copied().collect::<Vec<_>>(), ["a", "b", "none"]);
        assert!(by_name["b"].iter().map(|v| v.time).eq([0.0, 5.0]));
        assert_eq!(by_name["b"].iter().next_back().map(|v| v.values), Some(&[4.0][..]));
        assert!(by_name["none"].len() == 1 && !by_name["none"].is_empty());
    }
}
