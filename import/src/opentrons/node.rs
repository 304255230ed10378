//! Steps, and loops that take the place of steps which repeat.
//!
//! A step is a text with gaps for places. Two that differ in nothing but what stands in the gaps are steps of one loop.

use std::collections::BTreeSet;

/// Where a gap is in a text.
const GAP: char = '\u{1}';

/// So many steps make up one turn of a loop at most.
const LONGEST: usize = 80;

/// A loop over places takes so many turns at least; shorter ones are easier to read as they stand.
const FEWEST: usize = 3;

/// So deep loops stand in loops at most.
const DEEPEST: usize = 4;

/// What stands in a gap: a place, or a column of places.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    /// What it is a place of.
    pub(super) of: String,
    pub(super) at: At,
}

/// Which place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum At {
    /// `A1`.
    Well(String),
    /// `column(1)`, of so many.
    Column(usize, usize),
    /// `[A1, C1, E1]`: what several channels reach that is no column.
    Wells(Vec<String>),
    /// `row(1)`: what a row of channels reaches.
    Row(usize),
    /// All of them, and whether those are tips.
    All(bool),
}

impl Place {
    fn is_single(&self) -> bool {
        matches!(self.at, At::Well(_))
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let of = &self.of;
        match &self.at {
            At::Well(well) => write!(f, "{of}[{well}]"),
            At::Column(number, _) => write!(f, "{of}.column({number})"),
            At::Row(number) => write!(f, "{of}.row({number})"),
            At::All(true) => write!(f, "{of}.tips"),
            At::All(false) => write!(f, "{of}.wells"),
            At::Wells(wells) => {
                let all: Vec<String> = wells.iter().map(|well| format!("{of}[{well}]")).collect();
                write!(f, "[{}]", all.join(", "))
            }
        }
    }
}

/// A step, or a loop of steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    text: String,
    places: Vec<Place>,
    depth: usize,
}

impl Node {
    /// A step without places.
    pub(super) fn plain(text: impl Into<String>) -> Node {
        Node { text: text.into(), places: Vec::new(), depth: 0 }
    }

    /// A step about one place: what stands before and behind it.
    pub(super) fn about(before: &str, place: Place, behind: &str) -> Node {
        Node { text: format!("{before}{GAP}{behind}"), places: vec![place], depth: 0 }
    }

    /// As it is written.
    pub(super) fn written(&self) -> String {
        let mut places = self.places.iter();
        let mut out = String::new();
        for c in self.text.chars() {
            match c {
                GAP => out.extend(places.next().map(ToString::to_string)),
                c => out.push(c),
            }
        }
        out
    }
}

/// Steps with loops where they repeat.
pub(super) fn folded(mut steps: Vec<Node>) -> Vec<Node> {
    for _ in 0..DEEPEST {
        // What is repeated as it is, such as the strokes of a mixing, becomes one step before loops over places are looked for.
        let same = fold(&steps, &repeated);
        let over = fold(&same, &looped);
        if over.len() == steps.len() {
            return over;
        }
        steps = over;
    }
    steps
}

/// What turns of so many steps each become: nothing where no loop says them.
type Fold<'f> = &'f dyn Fn(&[Node], usize) -> Option<(usize, Node)>;

fn fold(steps: &[Node], by: Fold<'_>) -> Vec<Node> {
    let mut out = Vec::with_capacity(steps.len());
    let mut at = 0;
    while at < steps.len() {
        let rest = &steps[at..];
        // That which takes the place of the most; of those the shortest.
        let found = (1..=LONGEST.min(rest.len() / 2)).filter_map(|long| by(rest, long));
        match found.min_by_key(|(taken, _)| std::cmp::Reverse(*taken)) {
            Some((taken, node)) => {
                out.push(node);
                at += taken;
            }
            None => {
                out.push(rest[0].clone());
                at += 1;
            }
        }
    }
    out
}

/// How many turns of so many steps are alike but for places.
fn turns(steps: &[Node], long: usize, alike: impl Fn(&Node, &Node) -> bool) -> usize {
    let first = &steps[..long];
    let is_turn = |turn: &&[Node]| turn.len() == long && first.iter().zip(turn.iter()).all(|(a, b)| alike(a, b));
    steps.chunks(long).take_while(is_turn).count()
}

/// Turns that are the same.
fn repeated(steps: &[Node], long: usize) -> Option<(usize, Node)> {
    let times = turns(steps, long, |a, b| a == b);
    if times < 2 {
        return None;
    }
    let body = &steps[..long];
    let header = format!("repeat {times} times");
    Some((times * long, block(&header, body, |node| (node.text.clone(), node.places.clone()))))
}

/// Turns that are the same but for what one or two things go through.
fn looped(steps: &[Node], long: usize) -> Option<(usize, Node)> {
    // What more turns have in common is no more than what fewer have.
    let (mut few, mut many) = (FEWEST, turns(steps, long, |a, b| a.text == b.text && a.depth < DEEPEST));
    let mut found = None;
    while few <= many {
        let times = few.midpoint(many + 1);
        match over(steps, long, times) {
            Some(node) => {
                found = Some((times * long, node));
                few = times + 1;
            }
            None => many = times - 1,
        }
    }
    found
}

/// A loop over what varies.
fn over(steps: &[Node], long: usize, times: usize) -> Option<Node> {
    let body = &steps[..long];
    let places = |turn: usize| steps[turn * long..(turn + 1) * long].iter().flat_map(|node| node.places.iter());
    let count = places(0).count();
    let all: Vec<Vec<&Place>> = (0..times).map(|turn| places(turn).collect()).collect();
    let column = |gap: usize| -> Vec<&Place> { all.iter().map(|turn| turn[gap]).collect() };
    let varies = |gap: &usize| all.iter().any(|turn| turn[*gap] != all[0][*gap]);
    let mut ways: Vec<Vec<&Place>> = Vec::new();
    let mut way_of = vec![None; count];
    for gap in (0..count).filter(varies) {
        let way = column(gap);
        let known = ways.iter().position(|known| *known == way);
        way_of[gap] = Some(known.unwrap_or_else(|| {
            ways.push(way);
            ways.len() - 1
        }));
    }
    // Wells and columns of wells are no places of one list.
    if ways.iter().any(|way| way.iter().any(|place| place.is_single() != way[0].is_single())) {
        return None;
    }
    let taken: String = body.iter().map(|node| node.text.as_str()).collect();
    let name = |words: &[&str]| -> String {
        let numbered = (2..).map(|n| format!("{}_{n}", words[0]));
        let all = words.iter().map(|w| (*w).to_owned()).chain(numbered);
        all.into_iter().find(|name| !taken.contains(name.as_str())).unwrap_or_default()
    };
    let columns = |way: &[&Place]| way.iter().all(|place| matches!(place.at, At::Column(..)));
    let (header, names) = match ways.as_slice() {
        [way] => {
            let name = if columns(way) { name(&["column"]) } else { name(&["well"]) };
            (format!("for {name} in {}", list(way)), vec![name])
        }
        [one, two] => {
            let name = name(&["way"]);
            let header = format!("for {name} in paired({}, {})", list(one), list(two));
            (header, vec![format!("{name}.first"), format!("{name}.second")])
        }
        _ => return None,
    };
    let mut gap = 0;
    Some(block(&header, body, |node| {
        let (mut text, mut left) = (String::new(), Vec::new());
        for c in node.text.chars() {
            match c {
                GAP => {
                    match way_of[gap] {
                        Some(way) => text.push_str(&names[way]),
                        None => {
                            text.push(GAP);
                            left.push(all[0][gap].clone());
                        }
                    }
                    gap += 1;
                }
                c => text.push(c),
            }
        }
        (text, left)
    }))
}

fn block(header: &str, body: &[Node], mut say: impl FnMut(&Node) -> (String, Vec<Place>)) -> Node {
    let (mut text, mut places) = (format!("{header} {{\n"), Vec::new());
    for node in body {
        let (line, left) = say(node);
        text.push_str(&line);
        text.push('\n');
        places.extend(left);
    }
    text.push('}');
    let depth = 1 + body.iter().map(|node| node.depth).max().unwrap_or(0);
    Node { text, places, depth }
}

/// Places one after the other, as a range where they are one.
fn list(way: &[&Place]) -> String {
    let of: BTreeSet<&str> = way.iter().map(|place| place.of.as_str()).collect();
    let is_next =
        |(turn, place): (usize, &&Place)| matches!(place.at, At::Column(n, all) if n == turn + 1 && all == way.len());
    if of.len() == 1 && way.iter().enumerate().all(is_next) {
        return format!("{}.columns", way[0].of);
    }
    let wells: Option<Vec<&str>> = way
        .iter()
        .map(|place| match &place.at {
            At::Well(well) => Some(well.as_str()),
            _ => None,
        })
        .collect();
    if let (1, Some(wells)) = (of.len(), wells)
        && is_range(&wells)
    {
        return format!("{}[{} .. {}]", way[0].of, wells[0], wells[wells.len() - 1]);
    }
    let all: Vec<String> = way.iter().map(ToString::to_string).collect();
    format!("[{}]", all.join(", "))
}

/// Whether wells are those of a rectangle in the order of a range: down each column, then the next column.
fn is_range(wells: &[&str]) -> bool {
    let Some(cells) = wells.iter().map(|well| cell(well)).collect::<Option<Vec<_>>>() else { return false };
    let (Some(first), Some(last)) = (cells.first(), cells.last()) else { return false };
    let columns = first.1..=last.1;
    let expected: Vec<(u32, u32)> =
        columns.flat_map(|column| (first.0..=last.0).map(move |row| (row, column))).collect();
    cells.len() > 1 && cells == expected
}

/// Row and column of a well.
pub(super) fn cell(well: &str) -> Option<(u32, u32)> {
    let digits = well.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = well.split_at(digits);
    let row =
        letters.bytes().try_fold(0_u32, |row, b| b.is_ascii_uppercase().then(|| row * 26 + u32::from(b - b'A') + 1));
    Some((row.filter(|row| *row > 0)?, number.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(verb: &str, of: &str, well: &str) -> Node {
        Node::about(&format!("{verb} "), Place { of: of.into(), at: At::Well(well.into()) }, "")
    }

    fn text(steps: Vec<Node>) -> String {
        folded(steps).iter().map(|n| n.written() + "\n").collect()
    }

    #[test]
    fn what_repeats_becomes_a_loop() {
        let wells = ["A1", "B1", "C1", "D1"];
        let steps = wells.iter().flat_map(|w| {
            let mix = [about("take", "plate", w), about("give", "plate", w)];
            [Node::plain("pick"), about("take", "stock", "A1"), about("put", "plate", w)]
                .into_iter()
                .chain(mix.clone())
                .chain(mix)
        });
        let expected = "for well in plate[A1 .. D1] {\npick\ntake stock[A1]\nput well\nrepeat 2 times {\ntake well\ngive well\n}\n}\n";
        assert_eq!(text(steps.collect()), expected);
    }

    #[test]
    fn two_things_go_in_pairs() {
        let pairs = [("A1", "A2"), ("B1", "C2"), ("C1", "E2")];
        let steps = pairs.iter().flat_map(|(from, to)| [about("take", "a", from), about("give", "b", to)]);
        let expected = "for way in paired(a[A1 .. C1], [b[A2], b[C2], b[E2]]) {\ntake way.first\ngive way.second\n}\n";
        assert_eq!(text(steps.collect()), expected);
    }

    #[test]
    fn wells_and_columns_are_not_of_one_loop() {
        let column = |n: usize| {
            let wells = At::Wells(vec![format!("A{n}"), format!("B{n}")]);
            Node::about("take ", Place { of: "a".into(), at: wells }, "")
        };
        let steps = (1..4).map(column).chain((4..7).map(|n| about("take", "a", &format!("A{n}"))));
        let expected = "for well in [[a[A1], a[B1]], [a[A2], a[B2]], [a[A3], a[B3]]] {\ntake well\n}\nfor well in a[A4 .. A6] {\ntake well\n}\n";
        assert_eq!(text(steps.collect()), expected);
    }

    #[test]
    fn what_does_not_repeat_stays() {
        let steps = vec![about("take", "a", "A1"), Node::plain("wait"), about("give", "a", "A2")];
        assert_eq!(text(steps), "take a[A1]\nwait\ngive a[A2]\n");
    }
}
