//! `matterixc labware`.

use matterix_ir::listing::joined;
use matterix_lang::labware::library::{self, Missing};
use matterix_lang::labware::{Listed, Shape, listed};
use serde_json::{Value, json};

use crate::Exit;
use crate::args::{LabwareArgs, LabwareFormat};
use crate::terminal::{Stream, print, print_error};

/// Columns of names; longer ones push the rest of their line to the right.
const NAMES: usize = 52;

/// Lists the definitions of labware in the library, or prints one.
pub fn labware(args: &LabwareArgs) -> Exit {
    super::or_complain(attempt(args))
}

fn attempt(args: &LabwareArgs) -> Result<Exit, String> {
    if args.format == LabwareFormat::Definition {
        return definition(&args.words.join(" "));
    }
    let found = listed(&args.words)?;
    if found.is_empty() {
        return Ok(missing(&args.words.join(" ")));
    }
    let text = match (args.format, found.as_slice()) {
        (LabwareFormat::Json, _) => {
            let objects: Vec<Value> = found.iter().map(object).collect();
            serde_json::to_string_pretty(&objects).map_err(|e| format!("cannot write the answer: {e}"))? + "\n"
        }
        (_, [one]) => page(one),
        _ => found
            .iter()
            .map(|one| format!("{:NAMES$}  {}, {}\n", one.name, one.short.capability, places(one)))
            .collect(),
    };
    print(Stream::Out, &text);
    Ok(Exit::Fine)
}

/// The definition itself, for a file of one's own that begins with it.
fn definition(name: &str) -> Result<Exit, String> {
    let Ok(entry) = library::find(name) else { return Ok(missing(name)) };
    let value: Value = serde_json::from_str(&entry.text()?).map_err(|e| format!("`{name}` cannot be read: {e}"))?;
    let text = serde_json::to_string_pretty(&value).map_err(|e| format!("cannot write `{name}`: {e}"))?;
    print(Stream::Out, &(text + "\n"));
    Ok(Exit::Fine)
}

fn missing(name: &str) -> Exit {
    print_error(&format!("the library has no labware `{name}`"));
    let help = match library::find(name) {
        Err(Missing::Name(near)) if !near.is_empty() => {
            let near: Vec<String> = near.iter().map(|name| format!("`{name}`")).collect();
            format!("did you mean {}?", joined(&near, "or"))
        }
        Err(Missing::Version(versions)) => {
            let versions: Vec<String> = versions.iter().map(u32::to_string).collect();
            format!("it has version {}", joined(&versions, "and"))
        }
        _ => "give words of a name: `matterixc labware nest 96`; without words it lists all".to_owned(),
    };
    print(Stream::Err, &format!("help: {help}\n"));
    Exit::Findings
}

fn page(one: &Listed) -> String {
    let versions: Vec<String> = one.versions.iter().map(u32::to_string).collect();
    let inside = match one.short.shape {
        Shape::Sections => "by sections",
        Shape::Bottom => "by its bottom and its volume: an estimate",
        Shape::Straight => "straight, as wide as its opening",
    };
    let mut out = format!("{}\n", one.name);
    let mut line = |name: &str, value: &str| out += &format!("  {name:10}{value}\n");
    if !one.short.title.is_empty() {
        line("title", &one.short.title);
    }
    line("kind", one.short.capability);
    line("places", &places(one));
    if one.short.holds_liquid() {
        line("inside", inside);
    }
    line("versions", &joined(&versions, "and"));
    line("to use it", &format!("asset NAME from labware \"{}\"", one.asked));
    out
}

/// `96 of 360 uL`.
fn places(one: &Listed) -> String {
    let volume = |ul: f64| if ul < 1000.0 { format!("{ul} uL") } else { format!("{} mL", ul / 1000.0) };
    let parts: Vec<String> = one.short.places.iter().map(|(count, ul)| format!("{count} of {}", volume(*ul))).collect();
    if parts.is_empty() { "no places".to_owned() } else { joined(&parts, "and") }
}

fn object(one: &Listed) -> Value {
    let places: Vec<Value> =
        one.short.places.iter().map(|(count, ul)| json!({ "count": count, "volume": ul })).collect();
    json!({
        "name": one.name, "version": one.version, "versions": one.versions, "title": one.short.title,
        "kind": one.short.capability, "places": places, "sections": one.short.shape == Shape::Sections,
    })
}
