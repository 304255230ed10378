//! What files say of a failure, a hazard or an end that they name themselves.

use matterix_ir::{FileId, Span};
use matterix_lang::names::verb_text;
use matterix_syntax::ast::{Clause, ClauseKind, File, Item, ItemKind, MemberKind, Name, Refusal, Sig};

/// A place that gives the name.
struct Given {
    /// What it stands in: ``command `squeeze` of `Press` ``.
    within: String,
    span: Span,
    /// How a finding of it is shown, and what a run makes of it.
    shown: &'static str,
}

const FAILURE: &str = "`check` reports it as `need-unmet`; in a run it is a failure, which `on NAME { }` handles.";
const LATER: &str = "It can happen only in a run; `on NAME { }` handles it.";
const END: &str = "`check` reports it as `unfinished`; a run that ends like this counts as failed.";
const HAZARD: &str = "`check` reports it as `hazard`; in a run it is a failure, which `on NAME { }` handles. `allow NAME \"why\"` accepts it.";
const CAUTION: &str =
    "`check` and `run` report it as a warning with the code `hazard`. `allow NAME \"why\"` accepts it.";

/// What a text says of a name, in Markdown; nothing where it does not give it.
pub fn named(name: &str, file: &str, text: &str) -> Option<String> {
    let name = name.replace('-', "_");
    let (tree, _) = matterix_syntax::parse(FileId(0), text);
    let given = given(&tree, &name);
    let mut shown: Vec<&str> = given.iter().map(|g| g.shown).collect();
    shown.dedup();
    let mut out = format!("# {name}\n\n`{file}` declares this name. {}\n", shown.join(" ").replace("NAME", &name));
    for Given { within, span, .. } in &given {
        let line = text[..span.start as usize].matches('\n').count() + 1;
        let lines = text[span.start as usize..span.end as usize].lines().map(str::trim);
        let said: Vec<&str> = lines.collect();
        out.push_str(&format!("\nLine {line}, {within}:\n\n```mtx\n{}\n```\n", said.join("\n    ")));
    }
    (!given.is_empty()).then_some(out)
}

fn given(tree: &File, name: &str) -> Vec<Given> {
    let mut out = Vec::new();
    for item in &tree.items {
        of_item(item, name, &mut out);
    }
    out
}

fn of_item(item: &Item, name: &str, out: &mut Vec<Given>) {
    match &item.kind {
        ItemKind::Skill { sig, clauses, .. } => of_clauses(sig, clauses, "skill", "", name, out),
        ItemKind::Hazard { grave, name: own, .. } if own.text == name => {
            let (within, shown) = if *grave { ("a hazard", HAZARD) } else { ("a caution", CAUTION) };
            out.push(Given { within: within.to_string(), span: item.span, shown });
        }
        ItemKind::Capability { name: kind, members, .. } => {
            let of = format!(" of `{}`", kind.text);
            for member in members {
                match &member.kind {
                    MemberKind::Command { sig, clauses } => of_clauses(sig, clauses, "command", &of, name, out),
                    MemberKind::Limit { at_end, refusal, .. } if is(refusal.as_ref(), name) => {
                        let (what, shown) = if *at_end { ("an end", END) } else { ("a limit", FAILURE) };
                        out.push(Given { within: format!("{what}{of}"), span: member.span, shown });
                    }
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

fn of_clauses(sig: &Sig, clauses: &[Clause], what: &str, of: &str, name: &str, out: &mut Vec<Given>) {
    for clause in clauses {
        let shown = match &clause.kind {
            ClauseKind::Needs { refusal, .. } | ClauseKind::Presumes { refusal, .. } if is(refusal.as_ref(), name) => {
                FAILURE
            }
            ClauseKind::Fails(names) if names.iter().any(|n: &Name| n.text == name) => LATER,
            _ => continue,
        };
        out.push(Given { within: format!("{what} `{}`{of}", verb_text(&sig.verb)), span: clause.span, shown });
    }
}

fn is(refusal: Option<&Refusal>, name: &str) -> bool {
    refusal.is_some_and(|r| r.failure.text == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "mtx 1
capability Press: Body {
    state force: Force = 0 N
    command squeeze at(f: Force)
        needs f <= 50 N else too_hard \"squeeze with 50 N at most\"
        fails slips
        effect force = f
    keeps force <= 40 N else cracks \"it cracks\"
    ends force == 0 N else left_pressed \"release it\"
}
hazard hot(p: Heater) when p.target > 60 degC \"less\"
";

    #[test]
    fn what_gives_a_name_is_shown_with_its_line() {
        for (name, parts) in [
            ("too_hard", ["Line 5, command `squeeze` of `Press`", "needs f <= 50 N else too_hard", "need-unmet"]),
            ("too-hard", ["# too_hard", "on too_hard { }", "squeeze with 50 N at most"]),
            ("slips", ["Line 6", "fails slips", "only in a run"]),
            ("cracks", ["a limit of `Press`", "keeps force <= 40 N", "need-unmet"]),
            ("left_pressed", ["an end of `Press`", "release it", "unfinished"]),
            ("hot", ["a hazard", "hazard hot(p: Heater)", "allow hot"]),
        ] {
            let said = named(name, "press.mtx", TEXT).unwrap_or_else(|| panic!("`{name}` is given"));
            parts.iter().for_each(|part| assert!(said.contains(part), "`{name}` lacks `{part}`:\n{said}"));
        }
        assert_eq!(named("squeeze", "press.mtx", TEXT), None);
    }
}
