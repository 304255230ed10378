//! Things of which the same is known are named together: wells by the rectangle they fill.

use std::collections::BTreeMap;

/// So many names are listed where no rectangle holds them.
const MOST_NAMES: usize = 4;

/// Groups rows by what they say, in the order of the first of each; the names of each group as one text.
pub(super) fn together(rows: Vec<(String, String)>) -> Vec<(String, String)> {
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    for (name, said) in rows {
        match places.get(&said) {
            Some(i) => groups[*i].1.push(name),
            None => {
                places.insert(said.clone(), groups.len());
                groups.push((said, vec![name]));
            }
        }
    }
    groups.into_iter().map(|(said, names)| (self::names(&names), said)).collect()
}

/// A place of a grid: `plate[`, row, column, `].contents`.
struct Place<'n> {
    before: &'n str,
    row: u32,
    column: u32,
    after: &'n str,
}

fn place(name: &str) -> Option<Place<'_>> {
    let open = name.rfind('[')?;
    let close = open + name[open..].find(']')?;
    let inside = &name[open + 1..close];
    let digits = inside.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = inside.split_at(digits);
    let row = letters.bytes().try_fold(0u32, |n, b| {
        let letter = b.is_ascii_uppercase().then(|| u32::from(b - b'A') + 1)?;
        n.checked_mul(26)?.checked_add(letter)
    })?;
    let column = number.parse().ok()?;
    (!letters.is_empty()).then_some(Place { before: &name[..=open], row, column, after: &name[close..] })
}

/// Names as one text.
fn names(all: &[String]) -> String {
    let mut out: Vec<String> = Vec::new();
    let mut grids: BTreeMap<(&str, &str), Vec<Place<'_>>> = BTreeMap::new();
    let mut order: Vec<(&str, &str)> = Vec::new();
    for name in all {
        match place(name) {
            Some(p) => {
                let key = (p.before, p.after);
                if !grids.contains_key(&key) {
                    order.push(key);
                }
                grids.entry(key).or_default().push(p);
            }
            None => out.push(name.clone()),
        }
    }
    for (before, after) in order {
        let places = &grids[&(before, after)];
        out.extend(rectangles(places).into_iter().map(|inside| format!("{before}{inside}{after}")));
    }
    if out.len() > MOST_NAMES {
        let rest = out.len() - (MOST_NAMES - 1);
        out.truncate(MOST_NAMES - 1);
        out.push(format!("{rest} more"));
    }
    out.join(", ")
}

/// Places as rectangles, each as large as it goes: along a column first, then over columns that are filled alike.
fn rectangles(places: &[Place<'_>]) -> Vec<String> {
    let mut columns: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for p in places {
        columns.entry(p.column).or_default().push(p.row);
    }
    // Runs of rows by column, then runs of columns with the same rows.
    let mut open: Vec<(u32, u32, u32, u32)> = Vec::new();
    for (column, mut rows) in columns {
        rows.sort_unstable();
        rows.dedup();
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for row in rows {
            match runs.last_mut() {
                Some((_, last)) if *last + 1 == row => *last = row,
                _ => runs.push((row, row)),
            }
        }
        for (top, bottom) in runs {
            let same = |o: &&mut (u32, u32, u32, u32)| (o.0, o.1) == (top, bottom) && o.3 + 1 == column;
            match open.iter_mut().find(same) {
                Some(o) => o.3 = column,
                None => open.push((top, bottom, column, column)),
            }
        }
    }
    let name = |row: u32, column: u32| format!("{}{column}", letters(row));
    open.into_iter()
        .map(|(top, bottom, left, right)| match (top, left) == (bottom, right) {
            true => name(top, left),
            false => format!("{} .. {}", name(top, left), name(bottom, right)),
        })
        .collect()
}

fn letters(mut row: u32) -> String {
    let mut out = Vec::new();
    while row > 0 {
        out.push(char::from(b'A' + ((row - 1) % 26) as u8));
        row = (row - 1) / 26;
    }
    out.iter().rev().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(all: &[&str]) -> String {
        names(&all.iter().map(|n| n.to_string()).collect::<Vec<_>>())
    }

    #[test]
    fn wells_are_named_by_the_rectangles_they_fill() {
        assert_eq!(
            named(&["p[A1].contents", "p[B1].contents", "p[A2].contents", "p[B2].contents"]),
            "p[A1 .. B2].contents"
        );
        assert_eq!(named(&["p[A1]", "p[C1]", "rack[AB3]", "beaker"]), "beaker, p[A1], p[C1], rack[AB3]");
        assert_eq!(named(&["p[H1]", "p[H2]", "p[H3]"]), "p[H1 .. H3]");
    }

    #[test]
    fn too_many_names_are_counted() {
        assert_eq!(named(&["a", "b", "c", "d", "e"]), "a, b, c, 2 more");
    }
}
