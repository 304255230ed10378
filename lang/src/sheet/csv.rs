//! Comma-separated text as records whose cells know where they stand: a finding about a plan points to its cell. (The reader of fits,
//! `csv`, gives the place of a row only.)

use std::ops::Range;

/// A cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// What it holds, without quotes and the blanks around.
    pub(super) text: String,
    /// Where that stands; the place itself where it is empty.
    pub(super) at: Range<usize>,
}

/// A row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Record {
    /// The line in which it begins, counted from 1.
    pub(super) line: u32,
    pub(super) at: Range<usize>,
    pub(super) cells: Vec<Cell>,
}

/// A place that cannot be read, and why.
pub(super) type Broken = (Range<usize>, &'static str);

/// The rows of a text. Empty ones and lines that begin with `#` are left out.
pub(super) fn records(text: &str) -> Result<Vec<Record>, Broken> {
    let mut reader = Reader { text, at: if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 }, line: 1 };
    let mut out = Vec::new();
    while reader.at < text.len() {
        let record = reader.record()?;
        out.extend(record.filter(|record| record.cells.iter().any(|cell| !cell.text.is_empty())));
    }
    Ok(out)
}

struct Reader<'t> {
    text: &'t str,
    at: usize,
    line: u32,
}

impl Reader<'_> {
    fn next(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    /// The rest of a line, without its end.
    fn line_end(&self) -> usize {
        self.text[self.at..].find(['\n', '\r']).map_or(self.text.len(), |length| self.at + length)
    }

    /// Passes a line end, whichever kind it is.
    fn pass_line_end(&mut self) {
        let rest = &self.text[self.at..];
        let length = if rest.starts_with("\r\n") { 2 } else { usize::from(rest.starts_with(['\n', '\r'])) };
        self.at += length;
        self.line += u32::from(length > 0);
    }

    fn record(&mut self) -> Result<Option<Record>, Broken> {
        let (start, line) = (self.at, self.line);
        if self.next() == Some('#') {
            self.at = self.line_end();
            self.pass_line_end();
            return Ok(None);
        }
        let mut cells = vec![self.cell()?];
        while self.next() == Some(',') {
            self.at += 1;
            cells.push(self.cell()?);
        }
        let at = start..self.at;
        self.pass_line_end();
        Ok(Some(Record { line, at, cells }))
    }

    fn cell(&mut self) -> Result<Cell, Broken> {
        let end = self.text[self.at..].find([',', '\n', '\r']).map_or(self.text.len(), |length| self.at + length);
        let plain = &self.text[self.at..end];
        let start = self.at + plain.len() - plain.trim_start().len();
        if !self.text[start..].starts_with('"') || start >= end {
            self.at = end;
            let at =
                if plain.trim().is_empty() { self.at - plain.len()..end } else { start..start + plain.trim().len() };
            return Ok(Cell { text: plain.trim().to_owned(), at });
        }
        let mut text = String::new();
        let mut at = start + 1;
        loop {
            let Some(length) = self.text[at..].find('"') else {
                return Err((start..self.line_end().max(start + 1), "this quote is not closed"));
            };
            text.push_str(&self.text[at..at + length]);
            at += length + 1;
            if !self.text[at..].starts_with('"') {
                break;
            }
            text.push('"');
            at += 1;
        }
        self.line += self.text[start..at].matches('\n').count() as u32;
        let cell = Cell { text: text.trim().to_owned(), at: start..at };
        self.at = at;
        let blank = self.text[at..self.line_end()].split(',').next().unwrap_or_default();
        if !blank.trim().is_empty() {
            return Err((start..at + blank.len(), "something stands after the closing quote"));
        }
        self.at += blank.len();
        Ok(cell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &str) -> Vec<Vec<String>> {
        let records = records(text).expect("it can be read");
        records.into_iter().map(|record| record.cells.into_iter().map(|cell| cell.text).collect()).collect()
    }

    #[test]
    fn cells_know_where_they_stand() {
        let text = "\u{feff}well, \"volume, uL\" ,note\r\n# a remark\r\n\r\n A1 ,20,\"say \"\"so\"\"\"\r\n,,\r\nB1,,x";
        let records = records(text).expect("it can be read");
        assert_eq!(
            texts(text),
            [vec!["well", "volume, uL", "note"], vec!["A1", "20", "say \"so\""], vec!["B1", "", "x"]]
        );
        assert_eq!(records.iter().map(|r| r.line).collect::<Vec<_>>(), [1, 4, 6]);
        let shown: Vec<&str> = records.iter().flat_map(|r| &r.cells).map(|c| &text[c.at.clone()]).collect();
        assert_eq!(shown, ["well", "\"volume, uL\"", "note", "A1", "20", "\"say \"\"so\"\"\"", "B1", "", "x"]);
    }

    #[test]
    fn line_ends_of_all_kinds_end_rows() {
        for end in ["\n", "\r\n", "\r"] {
            assert_eq!(texts(&["a,b", "1,2", "3,4"].join(end)), [["a", "b"], ["1", "2"], ["3", "4"]]);
        }
        assert_eq!(texts("a\n\"two\nlines\"\nc"), [["a"], ["two\nlines"], ["c"]]);
        assert_eq!(records("a\n\"two\nlines\"\nc").map(|all| all[2].line), Ok(4));
    }

    #[test]
    fn what_cannot_be_read_has_a_place() {
        assert_eq!(records("a,\"b\nc"), Err((2..4, "this quote is not closed")));
        assert_eq!(records("a,\"b\"c,d"), Err((2..6, "something stands after the closing quote")));
        assert_eq!(records(""), Ok(Vec::new()));
        for text in ["\"", ",\"", "\u{feff}", "\"\"\"", "é,\u{a0}x", "#", "\r", "\"a\"é"] {
            let _ = records(text);
        }
    }
}
