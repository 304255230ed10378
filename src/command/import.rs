//! `matterixc import`.

use std::collections::BTreeMap;
use std::path::Path;

use matterix_import::{Imported, LeftOut, Mistake, opentrons, phreeqc};

use crate::args::{Foreign, ImportArgs};
use crate::terminal::{self, print_error};
use crate::{Exit, files};

/// So many names of what is left out for one reason are listed.
const MOST_NAMES: usize = 12;

/// Writes a file of another program as a module; what is left out goes to standard error. Nothing is written where the file cannot be read.
pub fn import(args: &ImportArgs) -> Exit {
    super::or_complain(attempt(args))
}

fn attempt(args: &ImportArgs) -> Result<Exit, String> {
    let bytes = files::read(&args.file)?;
    let title = args.file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    // Remarks of databases come in many encodings; their names and numbers are ASCII.
    let text = String::from_utf8_lossy(&bytes);
    let imported = match args.kind {
        Foreign::Phreeqc => {
            let wanted = phreeqc::Wanted {
                elements: args.elements.iter().map(|e| e.trim().to_owned()).collect(),
                phases: args.phases.iter().map(|p| p.trim().to_owned()).collect(),
            };
            phreeqc::import(&text, &title, &wanted)
        }
        Foreign::Opentrons => opentrons::import(&text, &title),
    };
    let Imported { text, left_out, files: beside } = match imported {
        Ok(imported) => imported,
        Err(mistake) => {
            print_error(&complaint(&args.file, &mistake));
            return Ok(Exit::Findings);
        }
    };
    match &args.out {
        Some(path) => {
            files::write(path, &text)?;
            for (name, text) in &beside {
                files::write(&path.with_file_name(name), text)?;
            }
        }
        None => {
            terminal::pour(text.as_bytes());
            let names: Vec<&str> = beside.iter().map(|(name, _)| name.as_str()).collect();
            if !names.is_empty() {
                let said = format!("with `--out FILE` these definitions are written beside it: {}\n", names.join(", "));
                terminal::print(terminal::Stream::Err, &said);
            }
        }
    }
    let place = match args.kind {
        Foreign::Phreeqc => "line",
        Foreign::Opentrons => "command",
    };
    for line in summary(&left_out, place) {
        terminal::print(terminal::Stream::Err, &format!("{line}\n"));
    }
    Ok(Exit::Fine)
}

fn complaint(file: &Path, mistake: &Mistake) -> String {
    match mistake.line {
        0 => format!("{}: {}", file.display(), mistake.why),
        line => format!("{}:{line}: {}", file.display(), mistake.why),
    }
}

/// What is left out, a line for each reason.
fn summary(left_out: &[LeftOut], place: &str) -> Vec<String> {
    let mut by_reason: BTreeMap<&str, Vec<&LeftOut>> = BTreeMap::new();
    for left in left_out {
        by_reason.entry(&left.why).or_default().push(left);
    }
    let line = |(why, all): (&&str, &Vec<&LeftOut>)| {
        let names: Vec<String> =
            all.iter().take(MOST_NAMES).map(|l| format!("{} ({place} {})", l.name, l.line)).collect();
        let more = all.len().saturating_sub(MOST_NAMES);
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("not imported because {why}: {}{rest}", names.join(", "))
    };
    by_reason.iter().map(line).collect()
}
