//! One self-contained file of a document: markup, style, program and data, with nothing to load from elsewhere.

use crate::document::Document;

const MARKUP: &str = include_str!("../assets/page.html");
const STYLE: &str = include_str!("../assets/page.css");
const PROGRAM: &str = include_str!("../assets/page.js");

/// The page as HTML.
pub fn page(document: &Document) -> Result<String, serde_json::Error> {
    // Inside a script element only `<` could end it.
    let data = serde_json::to_string(document)?.replace('<', "\\u003c");
    let mut out = String::with_capacity(MARKUP.len() + STYLE.len() + PROGRAM.len() + data.len());
    let mut rest = MARKUP;
    for (mark, text) in [("<!--style-->", STYLE), ("<!--document-->", &data), ("<!--program-->", PROGRAM)] {
        // The markup is a part of this program and has every mark once; a test sees to it.
        let Some((before, after)) = rest.split_once(mark) else { continue };
        out.push_str(before);
        out.push_str(text);
        rest = after;
    }
    out.push_str(rest);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_in_it_and_nothing_is_loaded() {
        let lab = "a</script><b>".to_owned();
        let page = page(&Document { lab, ..Document::default() }).expect("a document is JSON");
        assert!(page.contains("a\\u003c/script>\\u003cb>"));
        assert!(!page.contains("<!--"), "a mark was not replaced");
        for loads in ["src=\"http", "href=\"http", "src='http", "@import", "url(http"] {
            assert!(!page.contains(loads), "{loads}");
        }
        assert_eq!(page.matches("</script>").count(), 2);
    }
}
