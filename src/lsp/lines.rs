//! Lines and columns of a text as the protocol counts them: from 0, columns in units of an encoding.

use lsp_types::{Position, PositionEncodingKind, Range};

/// What columns count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes.
    Utf8,
    /// Units of 16 bits: what a client expects that says nothing.
    #[default]
    Utf16,
    /// Characters.
    Utf32,
}

impl Encoding {
    /// The first of the encodings a client offers that is known, bytes before all others.
    pub fn agreed(offered: &[PositionEncodingKind]) -> Encoding {
        let offers = |kind| offered.contains(&kind);
        match () {
            () if offers(PositionEncodingKind::UTF8) => Encoding::Utf8,
            () if offers(PositionEncodingKind::UTF16) => Encoding::Utf16,
            () if offers(PositionEncodingKind::UTF32) => Encoding::Utf32,
            () => Encoding::Utf16,
        }
    }

    /// Its name in the protocol.
    pub fn kind(self) -> PositionEncodingKind {
        match self {
            Encoding::Utf8 => PositionEncodingKind::UTF8,
            Encoding::Utf16 => PositionEncodingKind::UTF16,
            Encoding::Utf32 => PositionEncodingKind::UTF32,
        }
    }

    /// Units of a character.
    fn units(self, c: char) -> usize {
        match self {
            Encoding::Utf8 => c.len_utf8(),
            Encoding::Utf16 => c.len_utf16(),
            Encoding::Utf32 => 1,
        }
    }

    /// Units of a text.
    pub fn length(self, text: &str) -> usize {
        match self {
            Encoding::Utf8 => text.len(),
            _ => text.chars().map(|c| self.units(c)).sum(),
        }
    }
}

/// Where the lines of a text begin. A line ends with `\n`, `\r\n` or `\r`.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    starts: Vec<usize>,
    encoding: Encoding,
}

impl Lines {
    /// The lines of a text.
    pub fn of(text: &str, encoding: Encoding) -> Lines {
        let bytes = text.as_bytes();
        let ends = (0..bytes.len()).filter(|i| match bytes[*i] {
            b'\n' => true,
            b'\r' => bytes.get(i + 1) != Some(&b'\n'),
            _ => false,
        });
        Lines { starts: std::iter::once(0).chain(ends.map(|end| end + 1)).collect(), encoding }
    }

    /// How columns are counted.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// The bytes of a line, without its end; of a line behind the last one the end of the text.
    fn line(&self, text: &str, line: usize) -> (usize, usize) {
        let Some(&start) = self.starts.get(line) else { return (text.len(), text.len()) };
        let end = self.starts.get(line + 1).copied().unwrap_or(text.len());
        let within = text.get(start..end).unwrap_or_default();
        (start, start + within.trim_end_matches(['\r', '\n']).len())
    }

    /// The byte at a position; behind the end of a line its end, inside a character its start.
    pub fn offset(&self, text: &str, position: Position) -> usize {
        let (start, end) = self.line(text, position.line as usize);
        let mut units = 0;
        for (at, c) in text.get(start..end).unwrap_or_default().char_indices() {
            units += self.encoding.units(c);
            if units > position.character as usize {
                return start + at;
            }
        }
        end
    }

    /// The position of a byte.
    pub fn position(&self, text: &str, offset: usize) -> Position {
        let mut offset = offset.min(text.len());
        while !text.is_char_boundary(offset) {
            offset -= 1;
        }
        let line = self.starts.partition_point(|start| *start <= offset).saturating_sub(1);
        let start = self.starts.get(line).copied().unwrap_or(0);
        let before = text.get(start..offset).unwrap_or_default();
        Position::new(line as u32, self.encoding.length(before) as u32)
    }

    /// The range between two bytes.
    pub fn range(&self, text: &str, start: usize, end: usize) -> Range {
        Range::new(self.position(text, start), self.position(text, end))
    }

    /// The bytes of a range, in order.
    pub fn bytes(&self, text: &str, range: Range) -> (usize, usize) {
        let (a, b) = (self.offset(text, range.start), self.offset(text, range.end));
        (a.min(b), a.max(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a µL\r\n°C 🧪x\n\rend";

    #[test]
    fn positions_of_all_encodings_come_back() {
        for encoding in [Encoding::Utf8, Encoding::Utf16, Encoding::Utf32] {
            let lines = Lines::of(TEXT, encoding);
            for (at, c) in TEXT.char_indices().filter(|(_, c)| *c != '\n' && *c != '\r') {
                let position = lines.position(TEXT, at);
                assert_eq!(lines.offset(TEXT, position), at, "{c:?} {encoding:?}");
            }
            assert_eq!(lines.offset(TEXT, Position::new(0, 99)), "a µL".len());
            assert_eq!(lines.offset(TEXT, Position::new(99, 0)), TEXT.len());
            assert_eq!(lines.position(TEXT, TEXT.len()), Position::new(3, 3));
        }
    }

    #[test]
    fn columns_count_units_of_their_encoding() {
        let x = TEXT.find('x').unwrap_or_default();
        let column = |encoding| Lines::of(TEXT, encoding).position(TEXT, x).character;
        assert_eq!([Encoding::Utf8, Encoding::Utf16, Encoding::Utf32].map(column), [8, 5, 4]);
        let inside = Lines::of(TEXT, Encoding::Utf16).offset(TEXT, Position::new(1, 4));
        assert_eq!(inside, TEXT.find('🧪').unwrap_or_default(), "inside of a pair");
    }
}
