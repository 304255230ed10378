//! Where numbers come from: tags in comments behind them, `// [crc]`, and what the documentation of a module says of these.

use std::collections::BTreeMap;

use matterix_ir::Span;

/// Where a number comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// `crc`; none where the documentation of the species tells it.
    pub tag: Option<String>,
    /// In full, as the module or the species tells it.
    pub text: String,
    /// What is said of this number: `within 4 %`, `alone`.
    pub remark: String,
}

/// The source in the comment at the end of the line on which something ends: what stands behind its tag is a remark.
pub(super) fn tagged(text: &str, span: Span, sources: &BTreeMap<String, String>) -> Option<Source> {
    first_of(comment(text, span)?, sources)
}

/// All the sources in that comment: two of `// [wat][mnt] alone`, with the remark on the last one.
pub(super) fn tags(text: &str, span: Span, sources: &BTreeMap<String, String>) -> Vec<Source> {
    let mut out: Vec<Source> = Vec::new();
    let mut rest = comment(text, span).map(str::to_string);
    while let Some(source) = rest.take().and_then(|rest| first_of(&rest, sources)) {
        rest = source.remark.starts_with('[').then(|| source.remark.clone());
        let remark = if rest.is_some() { String::new() } else { source.remark };
        out.push(Source { remark, ..source });
    }
    out
}

fn comment(text: &str, span: Span) -> Option<&str> {
    let line = text.get(span.end as usize..)?.lines().next()?;
    line.split_once("//").map(|(_, comment)| comment.trim())
}

fn first_of(comment: &str, sources: &BTreeMap<String, String>) -> Option<Source> {
    let (tag, remark) = comment.strip_prefix('[')?.split_once(']')?;
    let full = sources.get(tag)?.clone();
    Some(Source { tag: Some(tag.to_string()), text: full, remark: remark.trim().to_string() })
}

/// The source of a number that the documentation of its species tells: after the name of the property, after `Source:`, or as a tag.
pub(super) fn told(property: &str, about: &str, sources: &BTreeMap<String, String>) -> Option<Source> {
    let mut words = property.replace('_', " ");
    words.get_mut(..1)?.make_ascii_uppercase();
    let after = |start: &str| about.split_once(&format!("{start}: ")).map(|(_, rest)| rest.to_string());
    let tag = || {
        let (tag, _) = about.split_once('[')?.1.split_once(']')?;
        Some((tag.to_string(), sources.get(tag)?.clone()))
    };
    match after(&words).or_else(|| after("Source")) {
        Some(text) => Some(Source { tag: None, text, remark: String::new() }),
        None => tag().map(|(tag, text)| Source { tag: Some(tag), text, remark: String::new() }),
    }
}

/// What the documentation of a module says of tags: ``- `[crc]` CRC Handbook``, with the lines indented below.
pub(super) fn explained(docs: &[String]) -> BTreeMap<String, String> {
    let mut out: BTreeMap<String, String> = BTreeMap::new();
    let mut last: Option<String> = None;
    for line in docs {
        let begun = line.strip_prefix("- `[").and_then(|rest| rest.split_once("]`"));
        match (begun, &last) {
            (Some((tag, text)), _) => {
                out.insert(tag.to_string(), text.trim().to_string());
                last = Some(tag.to_string());
            }
            (None, Some(tag)) if line.starts_with("  ") => {
                if let Some(text) = out.get_mut(tag) {
                    text.push(' ');
                    text.push_str(line.trim());
                }
            }
            _ => last = None,
        }
    }
    out
}
