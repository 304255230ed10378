//! What the modules of the standard library declare, with signatures and documentation, and where words are found in it.

use std::sync::OnceLock;

use matterix_ir::{FileId, Span};
use matterix_lang::ast::{self, ItemKind, MemberKind, Sig};
use matterix_lang::library::MODULES;
use matterix_lang::names::item_name;
use matterix_lang::syntax::parse;
use rmcp::schemars::JsonSchema;
use serde::Serialize;

use crate::mcp::answer::beginning;

/// Bytes of a declaration that is shown whole; of a longer one the head is.
const SHORT: usize = 240;

/// Something that a module declares.
#[derive(Clone, Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Item {
    /// Where it is: `std::heating`.
    module: &'static str,
    /// Its name: `IkaRctBasic`; of a member with what it belongs to: `Heater.heat to`.
    name: String,
    /// How it is declared.
    signature: String,
    /// What is said of it.
    docs: String,
    /// What to import to use it.
    import: Option<String>,
}

impl Item {
    /// To read.
    pub fn told(&self) -> String {
        let docs: String = self.docs.lines().map(|line| format!("/// {line}\n")).collect();
        format!("{}\n{docs}{}\n\n", self.import.as_deref().unwrap_or(self.module), self.signature)
    }
}

/// The text of a module.
pub fn module_text(name: &str) -> Option<&'static str> {
    MODULES.iter().find(|m| m.name == name).map(|m| m.text)
}

/// All modules with the first line of what they say of themselves.
pub fn modules() -> impl Iterator<Item = (&'static str, &'static str)> {
    MODULES.iter().map(|m| (m.name, m.text.lines().find_map(|l| l.strip_prefix("//! ")).unwrap_or_default()))
}

/// The items that fit words best, of one module or of all. Each word counts where it is found: as the name, in the name, in the
/// signature, in the documentation; an item with more of the words comes first.
pub fn search(words: &str, module: Option<&str>, most: usize) -> Vec<Item> {
    let words: Vec<String> = words.to_lowercase().split_whitespace().map(str::to_string).collect();
    let asked = all().iter().filter(|item| module.is_none_or(|m| m == item.module));
    let mut ranked: Vec<((usize, usize), &Item)> =
        asked.map(|item| (fit(item, &words), item)).filter(|(fit, _)| fit.0 > 0).collect();
    // Of equal ones what stands for itself comes before members; then the order of the library.
    ranked.sort_by_key(|(fit, item)| (std::cmp::Reverse(*fit), item.name.contains('.')));
    ranked.into_iter().take(most).map(|(_, item)| item.clone()).collect()
}

/// How many of the words are in it, and how well they fit.
fn fit(item: &Item, words: &[String]) -> (usize, usize) {
    let name = item.name.to_lowercase();
    let (signature, docs) = (item.signature.to_lowercase(), item.docs.to_lowercase());
    let weights = words.iter().map(|word| {
        let word = word.as_str();
        // `pipettes` is found as `pipette`.
        let stem = word.strip_suffix('s').filter(|s| s.len() > 3).unwrap_or(word);
        match () {
            () if name.split(['.', ' ']).any(|part| part == word) => 8,
            () if name.contains(stem) => 4,
            () if signature.contains(stem) => 2,
            () if docs.contains(stem) || item.module.contains(stem) => 1,
            () => 0,
        }
    });
    weights.fold((0, 0), |(found, sum), weight| (found + usize::from(weight > 0), sum + weight))
}

fn all() -> &'static [Item] {
    static ITEMS: OnceLock<Vec<Item>> = OnceLock::new();
    ITEMS.get_or_init(|| MODULES.iter().flat_map(|m| of(m.name, m.text)).collect())
}

fn of(module: &'static str, text: &str) -> Vec<Item> {
    let (tree, _) = parse(FileId(0), text);
    let mut items = Vec::new();
    for item in &tree.items {
        let Some(name) = name(item, text) else { continue };
        items.push(Item {
            module,
            signature: signature(text, item.span),
            docs: item.docs.join("\n"),
            import: imported(&item.kind, module, &name),
            name: name.clone(),
        });
        let ItemKind::Capability { members, .. } = &item.kind else { continue };
        for member in members {
            let own = match &member.kind {
                MemberKind::Value { name, .. } => name.text.clone(),
                MemberKind::Command { sig, .. } => verb(sig),
                _ => continue,
            };
            items.push(Item {
                module,
                name: format!("{name}.{own}"),
                signature: signature(text, member.span),
                docs: member.docs.join("\n"),
                import: imported(&item.kind, module, &name),
            });
        }
    }
    items
}

/// What an item is called, as written; nothing for what is not named.
fn name(item: &ast::Item, text: &str) -> Option<String> {
    let written = |span: Span| text.get(span.start as usize..span.end as usize).map(str::to_string);
    match &item.kind {
        ItemKind::Unit { name, .. } => Some(name.text.clone()),
        ItemKind::Dimension { name, .. } => Some(name.text.clone()),
        ItemKind::Incompatible { a, b, .. } => Some(format!("{} with {}", written(a.span)?, written(b.span)?)),
        ItemKind::Skill { sig, .. } => Some(verb(sig)),
        _ => item_name(item).and_then(|(_, span)| written(span)),
    }
}

/// The line that imports a type; what else there is comes with its module or is known everywhere.
fn imported(kind: &ItemKind, module: &str, name: &str) -> Option<String> {
    matches!(kind, ItemKind::Asset { .. } | ItemKind::Capability { .. }).then(|| format!("use {module}::{name}"))
}

fn verb(sig: &Sig) -> String {
    let words: Vec<&str> = sig.verb.iter().chain(sig.labelled.iter().map(|l| &l.0)).map(|n| n.text.as_str()).collect();
    words.join(" ")
}

/// A short declaration whole; of a longer one what stands before its first line ends.
fn signature(text: &str, span: Span) -> String {
    let whole = text.get(span.start as usize..span.end as usize).unwrap_or_default().trim_end();
    if whole.len() <= SHORT {
        return whole.to_string();
    }
    let head = whole.split_once("{\n").map_or(whole, |(head, _)| head).trim_end();
    match head.len() <= 2 * SHORT {
        true => format!("{head} {{ ... }}"),
        false => format!("{} ...", beginning(head, 2 * SHORT)),
    }
}
