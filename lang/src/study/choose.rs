//! Which study or fit of a file is meant.

use matterix_ir::{Diagnostic, FileId, Span, codes};

use crate::ast::{ItemKind, Name};
use crate::names::{DeclId, Names};
use crate::near;

/// The one that is asked for, or the only one.
pub fn choose(
    names: &Names<'_>,
    module: usize,
    file: FileId,
    wanted: Option<&str>,
    fits: bool,
) -> Result<DeclId, Box<Diagnostic>> {
    let what = if fits { "fit" } else { "study" };
    let all: Vec<(&Name, DeclId)> = names
        .declared_by(module)
        .filter_map(|id| match &names.decl(id).item.kind {
            ItemKind::Study { name, .. } if !fits => Some((name, id)),
            ItemKind::Fit { name, .. } if fits => Some((name, id)),
            _ => None,
        })
        .collect();
    let list: Vec<String> = all.iter().map(|(name, _)| format!("`{}`", name.text)).collect();
    let top = Span::new(file, 0, 0);
    match (wanted, all.as_slice()) {
        (None, [(_, id)]) => Ok(*id),
        (_, []) => {
            let headline = format!("this file has no {what}");
            let d = Diagnostic::error(codes::NO_WORKFLOW, top, headline, "nothing to run");
            Err(Box::new(d.help(format!("add `{what} NAME of WORKFLOW {{ ... }}`"))))
        }
        (Some(wanted), all) => match all.iter().find(|(name, _)| name.text == wanted) {
            Some((_, id)) => Ok(*id),
            None => {
                let near = near::nearest(wanted, all.iter().map(|(name, _)| &name.text));
                let headline = format!("this file has no {what} `{wanted}`");
                let mut d = Diagnostic::error(codes::NO_WORKFLOW, top, headline, "given with `--name`");
                d.help.extend(near::question(&near));
                if near.is_empty() {
                    d = d.help(format!("it has {}", list.join(", ")));
                }
                Err(Box::new(d))
            }
        },
        (None, [(first, _), rest @ ..]) => {
            let headline = format!("this file declares {} of these: choose one {what}", all.len());
            let mut d = Diagnostic::error(codes::NO_WORKFLOW, first.span, headline, "one of them");
            for (other, _) in rest {
                d = d.because(other.span, "another");
            }
            Err(Box::new(d.help(format!("choose with `--name`: {}", list.join(", ")))))
        }
    }
}
