//! Pieces of Markdown.

/// Text in the form of code; what would end a cell of a table is kept out of its way.
pub fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("`{}`", text.replace('|', "\\|")) }
}

/// Several of them.
pub fn codes<'a>(texts: impl IntoIterator<Item = &'a str>) -> String {
    texts.into_iter().map(code).collect::<Vec<_>>().join(", ")
}

/// Words with a `*` that is one, outside of what stands as code.
pub fn prose(text: &str) -> String {
    let piece =
        |(index, piece): (usize, &str)| if index % 2 == 0 { piece.replace('*', "\\*") } else { piece.to_string() };
    text.split('`').enumerate().map(piece).collect::<Vec<_>>().join("`")
}

/// Lines of documentation as one line; a blank line is passed over.
pub fn line(docs: &[String]) -> String {
    prose(&docs.iter().map(|l| l.trim()).filter(|l| !l.is_empty()).collect::<Vec<_>>().join(" "))
}

/// Lines of documentation in a cell of a table.
pub fn cell(docs: &[String]) -> String {
    line(docs).replace('|', "\\|")
}

/// Lines of documentation as they stand, a blank line after them.
pub fn paragraphs(docs: &[String]) -> String {
    if docs.iter().all(|l| l.trim().is_empty()) {
        String::new()
    } else {
        format!("{}\n\n", prose(docs.join("\n").trim()))
    }
}

/// A table with these heads; nothing where it has no rows. Columns in which no row has anything are left out, but for the first.
pub fn table(heads: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let filled = |column: usize| column == 0 || rows.iter().any(|r| r.get(column).is_some_and(|c| !c.is_empty()));
    let columns: Vec<usize> = (0..heads.len()).filter(|c| filled(*c)).collect();
    let row = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let mut out = row(columns.iter().map(|c| heads[*c]).collect());
    out += &row(columns.iter().map(|_| "---").collect());
    for cells in rows {
        out += &row(columns.iter().map(|c| cells.get(*c).map_or("", String::as_str)).collect());
    }
    out + "\n"
}

/// A line up to a comment that does not stand in a text.
pub fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    let mut last = ' ';
    for (at, c) in line.char_indices() {
        match c {
            '"' if last != '\\' => quoted = !quoted,
            '/' if last == '/' && !quoted => return &line[..at - 1],
            _ => {}
        }
        last = c;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_end_a_line_and_texts_do_not() {
        assert_eq!(without_comment("a: 3 g  // [crc]"), "a: 3 g  ");
        assert_eq!(without_comment(r#"sends "http://x" // y"#), r#"sends "http://x" "#);
        assert_eq!(without_comment(r#""a \" // b""#), r#""a \" // b""#);
    }

    #[test]
    fn tables_leave_out_what_no_row_has() {
        let rows = [vec!["a".to_string(), String::new(), "b".to_string()]];
        assert_eq!(table(&["x", "y", "z"], &rows), "| x | z |\n| --- | --- |\n| a | b |\n\n");
        assert_eq!(table(&["x"], &[]), "");
    }
}
