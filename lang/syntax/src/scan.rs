//! Lines, brackets and texts of a file, found without the grammar.

/// The words that start an item.
pub(super) const ITEM_WORDS: &[&str] = &[
    "use",
    "dimension",
    "unit",
    "species",
    "solution",
    "reaction",
    "equilibrium",
    "interaction",
    "reactive_group",
    "material",
    "incompatible",
    "allow",
    "hazard",
    "caution",
    "capability",
    "asset",
    "process",
    "event",
    "relation",
    "extern",
    "fn",
    "const",
    "table",
    "framing",
    "driver",
    "lab",
    "skill",
    "workflow",
    "study",
    "fit",
    "test",
];

/// The words that start a step; other steps start with a verb.
pub const STEP_WORDS: &[&str] = &[
    "let", "wait", "step", "if", "repeat", "for", "within", "hold", "keep", "try", "retry", "claim", "sequence",
    "parallel", "start", "await", "fail", "expect", "record", "note", "ask", "return",
];

/// A bracket outside of texts and comments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bracket {
    /// One of `(){}[]`.
    pub(super) byte: u8,
    /// Its offset.
    pub(super) at: usize,
    /// The index of its line.
    pub(super) line: usize,
}

/// A line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Offset of its first byte.
    pub(super) start: usize,
    /// Offset of its first byte that is no blank.
    pub(super) first: usize,
    /// Offset after its last byte that is neither blank nor comment; `first` where there is none.
    pub(super) end: usize,
}

impl Line {
    /// Blanks at its start.
    pub(super) fn indent(&self) -> usize {
        self.first - self.start
    }

    /// Whether it holds nothing but blanks and comments.
    pub(super) fn is_blank(&self) -> bool {
        self.end == self.first
    }

    /// Its text without blanks and comment.
    pub(super) fn code<'t>(&self, text: &'t str) -> &'t str {
        text.get(self.first..self.end).unwrap_or_default()
    }

    /// Whether an item starts at its left edge.
    pub(super) fn starts_item(&self, text: &str) -> bool {
        self.indent() == 0 && ITEM_WORDS.contains(&first_word(self.code(text)))
    }
}

/// A text without its closing quote.
#[derive(Clone, Copy, Debug)]
pub(super) struct OpenText {
    /// Offset of the opening quote.
    pub(super) at: usize,
    /// Where it is taken to end.
    pub(super) end: usize,
    /// Round or square brackets left open before it on its line.
    pub(super) inside: Option<u8>,
}

/// What stands where.
#[derive(Debug, Default)]
pub(super) struct Scan {
    pub(super) lines: Vec<Line>,
    pub(super) brackets: Vec<Bracket>,
    pub(super) open_texts: Vec<OpenText>,
}

/// The word at the start of a text.
pub(super) fn first_word(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(text.len());
    &text[..end]
}

/// Looks at a whole file, in one pass.
pub(super) fn scan(text: &str) -> Scan {
    let mut scan = Scan::default();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        scan_line(text, start, line.len(), &mut scan);
        start += line.len();
    }
    scan
}

fn scan_line(text: &str, start: usize, len: usize, scan: &mut Scan) {
    let bytes = text.as_bytes();
    let stop = start + len;
    let mut at = start;
    if start == 0 && text.starts_with('\u{feff}') {
        at += '\u{feff}'.len_utf8();
    }
    let left = at;
    while at < stop && bytes[at].is_ascii_whitespace() {
        at += 1;
    }
    let line = scan.lines.len();
    let first = at;
    let mut end = first;
    let own = scan.brackets.len();
    while at < stop {
        match bytes[at] {
            b'/' if bytes.get(at + 1) == Some(&b'/') => break,
            b'"' => {
                at = match text_end(&bytes[..stop], at) {
                    Some(end) => end,
                    None => {
                        let open = open_text(text, at, stop, &scan.brackets[own..]);
                        scan.open_texts.push(open);
                        open.end
                    }
                };
                end = at;
                continue;
            }
            byte @ (b'(' | b')' | b'[' | b']' | b'{' | b'}') => {
                scan.brackets.push(Bracket { byte, at, line });
                end = at + 1;
            }
            byte if !byte.is_ascii_whitespace() => end = at + 1,
            _ => {}
        }
        at += 1;
    }
    scan.lines.push(Line { start: left, first, end });
}

/// The offset after the quote that closes the text opened at `at`.
fn text_end(line: &[u8], at: usize) -> Option<usize> {
    let mut at = at + 1;
    while at < line.len() {
        match line[at] {
            b'\\' => at += 2,
            b'"' => return Some(at + 1),
            b'\n' => return None,
            _ => at += 1,
        }
    }
    None
}

/// Where a text without a closing quote is taken to end: before what closes the brackets of its line, or a comment.
fn open_text(text: &str, at: usize, stop: usize, before: &[Bracket]) -> OpenText {
    let mut open: Vec<u8> = Vec::new();
    for bracket in before {
        match closer(bracket.byte) {
            Some(closer) => open.push(closer),
            None => drop(open.pop()),
        }
    }
    let body = text.get(at + 1..stop).unwrap_or_default();
    let body = body.split(" //").next().unwrap_or(body).trim_end();
    let kept = body.trim_end_matches([')', ']', '}', ',', ';', ' ', '\t']);
    let mut end = at + 1 + kept.len();
    // Only closers that close something of this line are outside.
    let mut tail = body.get(kept.len()..).unwrap_or_default();
    let closers = |tail: &str| tail.bytes().filter(|b| matches!(b, b')' | b']' | b'}')).collect::<Vec<_>>();
    while !closers(tail).is_empty() && !open.ends_with(&closers(tail).into_iter().rev().collect::<Vec<_>>()) {
        tail = tail.get(1..).unwrap_or_default();
        end += 1;
    }
    let closed = closers(tail).len();
    let inside = open[..open.len() - closed].last().copied().filter(|b| closed == 0 && *b != b'}');
    OpenText { at, end, inside }
}

/// What closes an opening bracket.
pub(super) fn closer(opener: u8) -> Option<u8> {
    match opener {
        b'(' => Some(b')'),
        b'[' => Some(b']'),
        b'{' => Some(b'}'),
        _ => None,
    }
}

/// The deepest nesting of brackets, of which at least as many close as open.
pub(super) fn depth(scan: &Scan) -> (usize, usize) {
    let (mut depth, mut deepest, mut at) = (0usize, 0, 0);
    for bracket in &scan.brackets {
        if closer(bracket.byte).is_some() {
            depth += 1;
            if depth > deepest {
                deepest = depth;
                at = bracket.at;
            }
        } else {
            depth = depth.saturating_sub(1);
        }
    }
    (deepest, at)
}

/// The ends of lines that lack a value, if the next line is not meant to go on with them: it stands no further right.
pub(super) fn dangling(text: &str, scan: &Scan) -> Vec<(usize, &'static str)> {
    let mut open: Vec<u8> = Vec::new();
    let mut brackets = scan.brackets.iter().peekable();
    let mut ends = Vec::new();
    let mut above: Option<(&Line, &'static str)> = None;
    for (number, line) in scan.lines.iter().enumerate().filter(|(_, line)| !line.is_blank()) {
        if let Some((above, word)) = above.take()
            && line.indent() <= above.indent()
        {
            ends.push((above.end, word));
        }
        while let Some(bracket) = brackets.next_if(|b| b.line <= number) {
            match closer(bracket.byte) {
                Some(_) => open.push(bracket.byte),
                None => drop(open.pop()),
            }
        }
        if open.last().is_none_or(|byte| *byte == b'{') {
            above = wants_value(line.code(text)).map(|word| (line, word));
        }
    }
    ends.extend(above.map(|(line, word)| (line.end, word)));
    ends
}

/// The operator or preposition at the end of a line.
fn wants_value(code: &str) -> Option<&'static str> {
    const SIGNS: [&str; 15] = ["==", "!=", "<=", ">=", "+=", "-=", "+-", "..", "=", "+", "-", "*", "/", "<", "^"];
    const WORDS: [&str; 16] = [
        "and", "or", "is", "in", "of", "to", "from", "into", "onto", "on", "with", "by", "at", "using", "through",
        "not",
    ];
    if let Some(sign) = SIGNS.into_iter().find(|sign| code.ends_with(sign)) {
        let head = &code[..code.len() - sign.len()];
        // A charge stands tight: `K+`.
        let tight = head.ends_with(|c: char| !c.is_ascii_whitespace());
        let tight = tight && matches!(sign, "+" | "-") || head.ends_with(['*', '/']);
        return (!head.is_empty() && !tight).then_some(sign);
    }
    let word = code.rsplit(|c: char| c.is_ascii_whitespace()).next()?;
    WORDS.into_iter().find(|w| *w == word && w.len() < code.len())
}
