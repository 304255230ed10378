//! Bytes of a file to text.

/// A file that is not UTF-8 text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotText {
    /// Offset of the first byte that is no text.
    pub offset: usize,
    /// One-based number of its line.
    pub line: usize,
    /// What to tell the user: lower case, no full stop.
    pub message: String,
}

/// The text of a file, which must be UTF-8.
pub fn decode(bytes: &[u8]) -> Result<String, NotText> {
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return Ok(text.to_owned()),
        Err(error) => error,
    };
    let offset = error.valid_up_to();
    let line = bytes[..offset].iter().filter(|byte| **byte == b'\n').count() + 1;
    let message = match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "the file is encoded in UTF-16; save it as UTF-8".to_owned(),
        _ => format!(
            "the file is not UTF-8 text: byte {:#04x} at offset {offset}; save it as UTF-8",
            bytes.get(offset).unwrap_or(&0)
        ),
    };
    Err(NotText { offset, line, message })
}
