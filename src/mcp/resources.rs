//! Pages a client can read: the language, the grammar, the forms of answers, the codes, the modules of the library.

use matterix_ir::codes;
use rmcp::model::{ReadResourceResult, Resource, ResourceContents, ResourceTemplate};

use super::tools::module_text;
use crate::command::explanation;

/// A page that is always there.
struct Page {
    uri: &'static str,
    title: &'static str,
    about: &'static str,
    mime: &'static str,
    text: &'static str,
}

const MARKDOWN: &str = "text/markdown";
const PLAIN: &str = "text/plain";

/// The pages, the most useful first.
const PAGES: &[Page] = &[
    Page {
        uri: "mtx://guide",
        title: "All on one page",
        about: "Grammar, units, verbs, assets, idioms and frequent mistakes on one page, for programs that write .mtx",
        mime: MARKDOWN,
        text: include_str!("../../docs/for-programs.md"),
    },
    Page {
        uri: "mtx://language",
        title: "The language",
        about: "The reference of .mtx with examples: read this before writing a protocol",
        mime: MARKDOWN,
        text: include_str!("../../docs/language.md"),
    },
    Page {
        uri: "mtx://library",
        title: "The standard library",
        about: "The contents of each module of the standard library, in tables",
        mime: MARKDOWN,
        text: include_str!("../../docs/library.md"),
    },
    Page {
        uri: "mtx://grammar",
        title: "The grammar",
        about: "The published grammar of .mtx, as a parsing expression grammar",
        mime: PLAIN,
        text: include_str!("../../grammar/mtx.pest"),
    },
    Page {
        uri: "mtx://checks",
        title: "The checks",
        about: "The checks before a run, by family",
        mime: MARKDOWN,
        text: include_str!("../../docs/checks.md"),
    },
    Page {
        uri: "mtx://findings",
        title: "Findings as JSON",
        about: "The format of the findings in the answers of check, fix and run",
        mime: MARKDOWN,
        text: include_str!("../../docs/diagnostics-json.md"),
    },
    Page {
        uri: "mtx://findings/schema",
        title: "Findings as a JSON Schema",
        about: "The same as a JSON Schema; here each fix has an `id` too",
        mime: "application/schema+json",
        text: include_str!("../../docs/findings.schema.json"),
    },
    Page {
        uri: "mtx://contents",
        title: "The known state at every statement",
        about: "The format of the answers of contents, and its guarantees",
        mime: MARKDOWN,
        text: include_str!("../../docs/contents.md"),
    },
    Page {
        uri: "mtx://report",
        title: "The report of a run",
        about: "The members of the report in the answers of run",
        mime: MARKDOWN,
        text: include_str!("../../docs/report.md"),
    },
    Page {
        uri: "mtx://schedule",
        title: "Schedules",
        about: "The format of the schedule in the answers of plan",
        mime: MARKDOWN,
        text: include_str!("../../docs/schedule.md"),
    },
];

/// Where the list of codes is, and below it the page of each.
const CODES: &str = "mtx://codes";
/// Below it are the modules of the library: `mtx://library/std::heating`.
const MODULES: &str = "mtx://library/";

/// All that is listed.
pub fn all() -> Vec<Resource> {
    let pages = PAGES.iter().map(|page| {
        Resource::new(page.uri, page.uri.trim_start_matches("mtx://"))
            .with_title(page.title)
            .with_description(page.about)
            .with_mime_type(page.mime)
            .with_size(page.text.len() as u64)
    });
    let codes = Resource::new(CODES, "codes")
        .with_title("The codes of findings")
        .with_description("All codes by family, one line for each")
        .with_mime_type(PLAIN);
    pages.chain([codes]).collect()
}

/// Pages that go by a name.
pub fn templates() -> Vec<ResourceTemplate> {
    vec![
        ResourceTemplate::new(format!("{CODES}/{{code}}"), "code")
            .with_title("A code")
            .with_description("The meaning of a code such as `unit-mismatch`, with an example and its fixed version")
            .with_mime_type(MARKDOWN),
        ResourceTemplate::new(format!("{MODULES}{{module}}"), "module")
            .with_title("A module of the standard library")
            .with_description("The text of a module such as `std::heating`")
            .with_mime_type(PLAIN),
    ]
}

/// What is under an address, if there is something.
pub fn read(uri: &str) -> Option<ReadResourceResult> {
    let (text, mime) = page(uri)?;
    Some(ReadResourceResult::new(vec![ResourceContents::text(text, uri).with_mime_type(mime)]))
}

fn page(uri: &str) -> Option<(String, &'static str)> {
    if let Some(page) = PAGES.iter().find(|page| page.uri == uri) {
        return Some((page.text.to_string(), page.mime));
    }
    if uri == CODES {
        return Some((explanation(None).ok()?, PLAIN));
    }
    if let Some(code) = uri.strip_prefix(CODES).and_then(|rest| rest.strip_prefix('/')) {
        return Some((codes::find(code)?.page.to_string(), MARKDOWN));
    }
    // Clients that expand templates write colons with percent signs.
    let module = uri.strip_prefix(MODULES)?.replace("%3A", ":").replace("%3a", ":");
    Some((module_text(&module)?.to_string(), PLAIN))
}
