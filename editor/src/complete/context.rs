//! Where in a text a cursor stands, found without the grammar: the text may not be whole.

/// A token before the cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Token<'t> {
    pub(crate) start: usize,
    pub(crate) text: &'t str,
}

impl Token<'_> {
    pub(crate) fn end(&self) -> usize {
        self.start + self.text.len()
    }

    pub(crate) fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_alphabetic() || c == '_')
    }

    pub(crate) fn is_number(&self) -> bool {
        self.text.starts_with(|c: char| c.is_ascii_digit())
    }
}

/// What encloses the cursor.
#[derive(Clone, Debug)]
pub(crate) struct Open<'t> {
    /// `{`, `(` or `[`; `"` where it is the brace of a text in quotes.
    pub(crate) bracket: char,
    /// Where.
    pub(crate) at: usize,
    /// What stands before it in its statement.
    pub(crate) head: Vec<Token<'t>>,
}

/// Where a cursor stands.
#[derive(Clone, Debug)]
pub(crate) struct Context<'t> {
    /// In a comment or in a text in quotes, where nothing is completed.
    pub(crate) quiet: bool,
    /// What is open, outermost first.
    pub(crate) open: Vec<Open<'t>>,
    /// The tokens of the statement before the word at the cursor; what is in closed brackets, too.
    pub(crate) before: Vec<Token<'t>>,
    /// Where the word at the cursor begins, and how much of it stands before the cursor.
    pub(crate) word: (usize, &'t str),
    /// Whether a blank or a bracket stands before the word.
    pub(crate) apart: bool,
    /// The statement whose block has ended just before, in the same line.
    pub(crate) ended: Option<Vec<Token<'t>>>,
    /// Named steps of the item around the cursor that begin before it.
    pub(crate) steps: Vec<&'t str>,
}

/// Prepositions: with one of them a statement goes on.
pub(crate) const LABELS: &[&str] =
    &["to", "from", "into", "onto", "on", "in", "with", "by", "at", "using", "through", "as"];

/// Words with which a statement goes on in the next line.
const GOES_ON: &[&str] = &["and", "or", "timeout", "else", "while", "holding", "pitch", "because", "when", "for", "is"];

/// A call without the name that its result gets: `heat plate to goal` of `let warm <- heat plate to goal`.
pub(crate) fn unnamed<'a, 't>(tokens: &'a [Token<'t>]) -> &'a [Token<'t>] {
    &tokens[tokens.iter().position(|t| t.text == "<-").map_or(0, |at| at + 1)..]
}

/// Looks at a text up to a cursor.
pub(crate) fn context(text: &str, cursor: usize) -> Context<'_> {
    let mut cursor = cursor.min(text.len());
    while !text.is_char_boundary(cursor) {
        cursor -= 1;
    }
    let mut quiet = false;
    let mut open: Vec<Open<'_>> = Vec::new();
    // The statement in each of the brackets that are open, and outside.
    let mut statements: Vec<Vec<Token<'_>>> = vec![Vec::new()];
    let bytes = text.as_bytes();
    let mut at = 0;
    let mut line_break = false;
    let mut ended: Option<(usize, Vec<Token<'_>>)> = None;
    let mut steps: Vec<&str> = Vec::new();
    while at < cursor {
        let c = text[at..].chars().next().unwrap_or(' ');
        let depth = open.len();
        match c {
            '\n' => {
                line_break = true;
                at += 1;
            }
            _ if c.is_whitespace() => at += c.len_utf8(),
            '/' if bytes.get(at + 1) == Some(&b'/') => {
                let end = text[at..].find('\n').map_or(text.len(), |i| at + i);
                quiet = end >= cursor;
                at = end;
            }
            _ => {
                let end = token_end(text, at);
                let token = Token { start: at, text: &text[at..end] };
                let inside_braces = open.last().is_none_or(|o| o.bracket == '{');
                if line_break && inside_braces {
                    // A loop, where it is not a condition that waits for its time.
                    let begins = token.text == "for" && statements[depth].first().is_none_or(|t| t.text != "hold");
                    let goes_on = LABELS.contains(&token.text)
                        || GOES_ON.contains(&token.text) && !begins
                        || continues(statements[depth].last());
                    if !goes_on && !matches!(c, ')' | ']' | '}' | '*' | '+' | '-' | '/' | '=' | '<' | '>') {
                        statements[depth].clear();
                    }
                }
                line_break = false;
                match c {
                    '"' => {
                        let closed = end - at >= 2 && text[at..end].ends_with('"');
                        if end >= cursor && !(closed && end == cursor) {
                            quiet = !in_braces(&text[at + 1..cursor]);
                            if !quiet {
                                // A value in a text is an expression of its own.
                                let from = at + 1 + text[at + 1..cursor].rfind('{').unwrap_or(0);
                                open.push(Open { bracket: '"', at: from, head: Vec::new() });
                                statements.push(Vec::new());
                                at = from + 1;
                                continue;
                            }
                        }
                        statements[depth].push(token);
                    }
                    '{' | '(' | '[' => {
                        let head = statements[depth].clone();
                        if open.is_empty() {
                            steps.clear();
                        }
                        if let [step, name, ..] = head.as_slice()
                            && step.text == "step"
                        {
                            steps.push(name.text);
                        }
                        statements[depth].push(token);
                        open.push(Open { bracket: c, at, head });
                        statements.push(Vec::new());
                    }
                    '}' | ')' | ']' => {
                        let closed = open.pop().and_then(|_| statements.pop()).unwrap_or_default();
                        let depth = open.len();
                        if c != '}' {
                            statements[depth].extend(closed);
                        }
                        statements[depth].push(token);
                        if c == '}' && open.last().is_none_or(|o| o.bracket == '{') && !followed(text, end) {
                            ended = Some((end, std::mem::take(&mut statements[depth])));
                        }
                    }
                    ';' => statements[depth].clear(),
                    // Outside of all braces a comma goes on with a list: `asset Mug: Container, Graspable`.
                    ',' if depth > 0 && inside_braces && fields(&statements[depth]) => statements[depth].clear(),
                    _ => statements[depth].push(token),
                }
                at = end;
            }
        }
    }
    let mut before = statements.pop().unwrap_or_default();
    let mut word = (cursor, "");
    if let Some(last) = before.last().copied()
        && last.end() >= cursor
        && (last.is_word() || last.text.starts_with('%'))
    {
        before.pop();
        word = (last.start, &text[last.start..cursor]);
    } else if line_break && !continues(before.last()) && open.last().is_none_or(|o| o.bracket == '{') {
        before.clear();
    }
    let at_once = |end: usize| text[end..word.0].chars().all(|c| c == ' ' || c == '\t');
    let ended = ended.filter(|(end, _)| *end <= word.0 && at_once(*end)).map(|(_, statement)| statement);
    let apart = text[..word.0].chars().next_back().is_none_or(|c| c.is_whitespace() || "([{,".contains(c));
    Context { quiet, open, before, word, apart, ended, steps }
}

/// Whether a statement goes on in the next line after this token.
fn continues(last: Option<&Token<'_>>) -> bool {
    last.is_some_and(|t| {
        matches!(
            t.text,
            "," | "="
                | "<-"
                | "->"
                | "+"
                | "-"
                | "*"
                | "/"
                | "("
                | "["
                | ":"
                | "|"
                | "=="
                | "<="
                | ">="
                | "<"
                | ">"
                | ".."
        ) || LABELS.contains(&t.text)
            || matches!(t.text, "and" | "or" | "not" | "of")
    })
}

/// Whether what follows goes on with a statement that has ended a block.
fn followed(text: &str, from: usize) -> bool {
    let rest = text[from..].trim_start_matches([' ', '\t', '\r']);
    let next = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or("");
    LABELS.contains(&next)
        || GOES_ON.contains(&next)
        || next == "finally"
        || next == "labelled"
        || rest.starts_with(')')
}

/// Whether a comma ends a field: the tokens before it are `key: value`.
fn fields(statement: &[Token<'_>]) -> bool {
    statement.get(1).is_some_and(|t| t.text == ":" || t.text == "=") || statement.iter().any(|t| t.text == ":")
}

/// Whether the end of the inside of a text in quotes stands in braces.
fn in_braces(inside: &str) -> bool {
    let open = inside.rfind('{');
    open.is_some_and(|o| inside[o..].find('}').is_none() && !inside[..o].ends_with('{'))
}

fn token_end(text: &str, at: usize) -> usize {
    let bytes = text.as_bytes();
    let rest = &text[at..];
    let Some(c) = rest.chars().next() else { return text.len() };
    let run = |fits: &dyn Fn(char) -> bool| rest.find(|c| !fits(c)).map_or(text.len(), |i| at + i);
    if c == '"' {
        let mut end = at + 1;
        while end < bytes.len() && bytes[end] != b'"' && bytes[end] != b'\n' {
            end += if bytes[end] == b'\\' && end + 1 < bytes.len() && bytes[end + 1] != b'\n' { 2 } else { 1 };
        }
        end = (end + usize::from(bytes.get(end) == Some(&b'"'))).min(text.len());
        while !text.is_char_boundary(end) {
            end += 1;
        }
        return end;
    }
    if c.is_ascii_digit() {
        let mut end = at;
        while end < bytes.len() {
            let b = bytes[end];
            let point = b == b'.' && bytes.get(end + 1).is_some_and(u8::is_ascii_digit);
            let sign = matches!(b, b'+' | b'-') && matches!(bytes[end - 1], b'e' | b'E');
            if !(b.is_ascii_digit()
                || point
                || (sign && end > at)
                || (matches!(b, b'e' | b'E')
                    && bytes.get(end + 1).is_some_and(|n| n.is_ascii_digit() || matches!(n, b'+' | b'-'))))
            {
                break;
            }
            end += 1;
        }
        return end.max(at + 1);
    }
    if c.is_alphabetic() || c == '_' || c == '°' {
        return run(&|c| c.is_alphanumeric() || c == '_' || c == '°').max(at + c.len_utf8());
    }
    if c == '%' {
        return at + 1 + rest[1..].find(|c: char| !(c.is_ascii_alphabetic() || c == '/')).unwrap_or(rest.len() - 1);
    }
    for two in ["::", "<-", "->", "==", "!=", "<=", ">=", "..", "+-", "+=", "-="] {
        if rest.starts_with(two) {
            return at + 2;
        }
    }
    at + c.len_utf8()
}

/// The words of a statement that lead to an item or block, before its bracket.
impl<'t> Context<'t> {
    /// The innermost braces that are open.
    pub(crate) fn block(&self) -> Option<&Open<'t>> {
        self.open.iter().rev().find(|o| o.bracket == '{')
    }

    /// Whether the cursor stands in the braces of a text in quotes.
    pub(crate) fn in_text(&self) -> bool {
        self.open.iter().rev().take_while(|o| o.bracket != '{').any(|o| o.bracket == '"')
    }

    /// The word that begins the item around the cursor.
    pub(crate) fn item(&self) -> &'t str {
        let first = self.open.first().map(|o| &o.head);
        let head = first.unwrap_or(&self.before);
        let words = head.iter().map(|t| t.text);
        words.into_iter().find(|w| *w != "extern").unwrap_or("")
    }

    /// Whether it is said here what something holds: behind `holding`, or in its braces.
    pub(crate) fn is_holding(&self) -> bool {
        let is = |t: Option<&Token<'_>>| t.is_some_and(|t| t.text == "holding");
        self.before.iter().any(|t| t.text == "holding") || self.block().is_some_and(|open| is(open.head.last()))
    }

    /// Whether the words before the cursor end with the `at` behind what something holds.
    pub(crate) fn is_start(&self) -> bool {
        let held = self.before.iter().position(|t| t.text == "holding");
        let filled = held.is_none() && self.is_holding() && self.before.iter().any(|t| t.text == ":");
        let at = self.before.iter().rposition(|t| t.text == "at");
        at.is_some_and(|at| filled || held.is_some_and(|held| held < at))
    }

    /// The last token before the word at the cursor.
    pub(crate) fn last(&self) -> Option<&'t str> {
        self.before.last().map(|t| t.text)
    }
}

/// Where the last simple value of a statement begins: a name with members, places and arguments.
pub(crate) fn primary<'a, 't>(tokens: &'a [Token<'t>]) -> &'a [Token<'t>] {
    let mut at = tokens.len();
    loop {
        // Brackets that close go back to where they opened.
        let mut depth = 0;
        while at > 0 {
            match tokens[at - 1].text {
                ")" | "]" => depth += 1,
                "(" | "[" => depth -= 1,
                _ if depth == 0 => break,
                _ => {}
            }
            at -= 1;
            if depth < 0 {
                return &tokens[at + 1..];
            }
        }
        if at == 0 || !tokens[at - 1].is_word() {
            return &tokens[at..];
        }
        at -= 1;
        if at == 0 || tokens[at - 1].text != "." {
            return &tokens[at..];
        }
        at -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_is_found_in_its_statement() {
        let text = "workflow a in b {\n    heat plate to 40 degC\n    place cup on pl";
        let found = context(text, text.len());
        let words: Vec<&str> = found.before.iter().map(|t| t.text).collect();
        assert_eq!((words.as_slice(), found.word.1), (&["place", "cup", "on"][..], "pl"));
        assert_eq!(found.item(), "workflow");
    }

    #[test]
    fn a_cursor_may_stand_anywhere() {
        let text = "mtx 1\nlab b { a = C { x: \"µ{v\" } °%w/w 1e\n é\"\\";
        for at in 0..=text.len() {
            context(text, at);
        }
    }

    #[test]
    fn what_stands_before_a_dot_is_one_value() {
        let text = "expect a + plate.row(1).pairs[0].";
        let found = context(text, text.len());
        let value: String = primary(&found.before[..found.before.len() - 1]).iter().map(|t| t.text).collect();
        assert_eq!(value, "plate.row(1).pairs[0]");
    }
}
