//! What a tool answers: text to read and data, both of bounded size.

use rmcp::model::{CallToolResult, ContentBlock};
use serde::Serialize;
use serde_json::{Map, Value};

/// Bytes of text or data of an answer, where the caller does not say.
pub const BYTES: usize = 60_000;
/// The most a caller may ask for.
pub const MOST_BYTES: usize = 4 << 20;

/// What a tool answers.
pub struct Answer {
    /// To read, one piece after the other.
    pub texts: Vec<String>,
    /// The same as data.
    pub data: Value,
}

impl Answer {
    /// With one text.
    pub fn new(text: String, data: impl Serialize) -> Result<Self, String> {
        let data = serde_json::to_value(data).map_err(|e| format!("the answer cannot be written: {e}"))?;
        Ok(Answer { texts: vec![text], data })
    }

    /// As it is sent.
    pub fn result(self) -> CallToolResult {
        let mut result = CallToolResult::structured(self.data);
        result.content = self.texts.into_iter().map(ContentBlock::text).collect();
        result
    }
}

/// What is wrong with a call, in words.
pub fn refusal(why: String) -> CallToolResult {
    CallToolResult::error(vec![ContentBlock::text(why)])
}

/// A text of at most so many bytes, cut at the end of a line.
pub fn bounded(text: String, bytes: usize) -> String {
    if text.len() <= bytes {
        return text;
    }
    let head = beginning(&text, bytes);
    let head = head.rfind('\n').map_or(head, |line| &head[..=line]);
    format!("{head}... {} more bytes are not shown\n", text.len() - head.len())
}

/// The beginning of a text, of at most so many bytes.
pub fn beginning(text: &str, bytes: usize) -> &str {
    let mut end = bytes.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    &text[..end]
}

/// An object without its largest members, so that it takes at most so many bytes, and the names of those.
pub fn pruned(object: Map<String, Value>, bytes: usize) -> (Map<String, Value>, Vec<String>) {
    let sizes: Vec<(String, usize)> = object.iter().map(|(k, v)| (k.clone(), v.to_string().len() + k.len())).collect();
    let mut total: usize = sizes.iter().map(|s| s.1).sum();
    let mut by_size: Vec<&(String, usize)> = sizes.iter().collect();
    by_size.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    let mut left_out = Vec::new();
    for (name, size) in by_size {
        if total <= bytes {
            break;
        }
        total -= size;
        left_out.push(name.clone());
    }
    left_out.sort();
    let kept = object.into_iter().filter(|(name, _)| !left_out.contains(name)).collect();
    (kept, left_out)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_text_is_cut_at_the_end_of_a_line_or_of_a_character() {
        assert_eq!(bounded("short\n".to_string(), 10), "short\n");
        assert_eq!(bounded("one\ntwo\nthree\n".to_string(), 10), "one\ntwo\n... 6 more bytes are not shown\n");
        assert_eq!(bounded("µµµ".to_string(), 3), "µ... 4 more bytes are not shown\n");
    }

    #[test]
    fn of_an_object_the_largest_members_are_left_out() {
        let Value::Object(object) = json!({ "a": [1, 2, 3, 4, 5, 6, 7, 8], "b": 1, "c": "a text" }) else { return };
        let (kept, left_out) = pruned(object.clone(), 1000);
        assert_eq!((kept.len(), left_out.len()), (3, 0));
        let (kept, left_out) = pruned(object, 12);
        assert_eq!(
            (kept.keys().map(String::as_str).collect::<Vec<_>>(), left_out),
            (vec!["b", "c"], vec!["a".to_string()])
        );
    }
}
