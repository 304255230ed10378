//! Positions in source text.

use std::fmt;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A source file, by its index in [`Sources`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FileId(pub u32);

/// A half-open range of bytes in one file. In formats for machines it is 12 bytes: a tree has tens of thousands of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

/// A span with its fields by name.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Span")]
struct Fields {
    file: FileId,
    start: u32,
    end: u32,
}

impl Serialize for Span {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Span { file, start, end } = *self;
        if to.is_human_readable() {
            return Fields { file, start, end }.serialize(to);
        }
        let mut bytes = [0; 12];
        for (place, number) in bytes.chunks_exact_mut(4).zip([file.0, start, end]) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        to.serialize_bytes(&bytes)
    }
}

impl<'de> Deserialize<'de> for Span {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Span, D::Error> {
        if from.is_human_readable() {
            let Fields { file, start, end } = Fields::deserialize(from)?;
            return Ok(Span { file, start, end });
        }
        from.deserialize_bytes(Bytes)
    }
}

/// Reads a span from its bytes.
struct Bytes;

impl Visitor<'_> for Bytes {
    type Value = Span;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the 12 bytes of a span")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Span, E> {
        let &[a, b, c, d, e, f, g, h, i, j, k, l] = bytes else {
            return Err(E::invalid_length(bytes.len(), &self));
        };
        let number = u32::from_le_bytes;
        Ok(Span { file: FileId(number([a, b, c, d])), start: number([e, f, g, h]), end: number([i, j, k, l]) })
    }
}

impl Span {
    /// The range `start..end` of `file`.
    pub fn new(file: FileId, start: usize, end: usize) -> Self {
        Span { file, start: start as u32, end: end as u32 }
    }

    /// The smallest range that covers both; `self` if they are in different files.
    pub fn to(self, other: Span) -> Span {
        if self.file != other.file {
            return self;
        }
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }

    /// Length in bytes.
    pub fn len(self) -> usize {
        (self.end - self.start) as usize
    }

    /// Whether the range covers no byte.
    pub fn is_empty(self) -> bool {
        self.end <= self.start
    }
}

/// One source file with its display name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Name as shown in diagnostics: a path as given by the user, or `std::heating`.
    pub name: String,
    /// Whole text.
    pub text: String,
}

/// All files of one compilation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sources {
    files: Vec<Source>,
}

impl Sources {
    /// Adds a file and returns its id.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        self.files.push(Source { name: name.into(), text: text.into() });
        FileId(self.files.len() as u32 - 1)
    }

    /// The file with this id, if there is one.
    pub fn get(&self, file: FileId) -> Option<&Source> {
        self.files.get(file.0 as usize)
    }

    /// The text under a span; empty where the span is not in a known file.
    pub fn slice(&self, span: Span) -> &str {
        self.get(span.file).and_then(|f| f.text.get(span.start as usize..span.end as usize)).unwrap_or("")
    }

    /// One-based line and column (in characters) of a span's start.
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let Some(source) = self.get(span.file) else { return (1, 1) };
        let mut end = (span.start as usize).min(source.text.len());
        while !source.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &source.text[..end];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        (line, column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN: Span = Span { file: FileId(3), start: 258, end: u32::MAX };

    /// A length in front, then file, start and end, the lowest byte of each first.
    const BYTES: [u8; 13] = [12, 3, 0, 0, 0, 2, 1, 0, 0, 255, 255, 255, 255];

    #[test]
    fn machines_get_12_bytes() {
        assert_eq!(postcard::to_stdvec(&SPAN), Ok(BYTES.to_vec()));
        assert_eq!(postcard::from_bytes(&BYTES), Ok(SPAN));
    }

    #[test]
    fn people_get_fields_by_name() {
        let text = r#"{"file":3,"start":258,"end":4294967295}"#;
        assert_eq!(serde_json::to_string(&SPAN).expect("it can be written"), text);
        assert_eq!(serde_json::from_str::<Span>(text).expect("it can be read"), SPAN);
    }

    #[test]
    fn another_number_of_bytes_is_no_span() {
        for wrong in [11, 13] {
            let bytes = postcard::to_stdvec(vec![0_u8; wrong].as_slice()).expect("it can be written");
            assert!(postcard::from_bytes::<Span>(&bytes).is_err(), "{wrong}");
        }
        assert!(postcard::from_bytes::<Span>(&BYTES[..12]).is_err());
    }
}
