//! The tool `library`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rmcp::schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Task;
use super::items::{self, Item};
use crate::mcp::answer::Answer;
use crate::mcp::desk::Desk;

/// Items of an answer that does not say.
const ITEMS: usize = 15;
/// The most it may say.
const MOST_ITEMS: usize = 200;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(crate = "rmcp::schemars")]
pub struct Library {
    /// Words to look for in names, signatures and documentation: `stir hotplate`, `96 well plate`, `wash tip`.
    words: Option<String>,
    /// A module such as `std::heating`: its whole text, or with `words` only items in it. Without both, all modules are listed.
    module: Option<String>,
    /// The most items that are named, 1 to 200; 15 if not given.
    #[schemars(range(min = 1, max = 200))]
    items: Option<usize>,
}

/// A module.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Module {
    /// As it is imported: `std::heating`.
    name: String,
    /// What it holds.
    about: String,
}

/// What the library has.
#[derive(Serialize, JsonSchema)]
#[schemars(crate = "rmcp::schemars")]
pub struct Shelf {
    /// Items that fit the words, the best first.
    items: Vec<Item>,
    /// All modules, where nothing was asked for.
    modules: Vec<Module>,
    /// The text of the module, where one was asked for.
    text: Option<String>,
}

impl Task for Library {
    const NAME: &'static str = "library";
    const TITLE: &'static str = "Search the standard library";
    const ABOUT: &'static str = "Searches the standard library: devices, robots, labware, verbs (skills and commands), species, units, materials. Returns signatures and documentation of the items that fit the words, or the text of one module.";
    type Data = Shelf;

    fn perform(self, _: &Desk, _: &Arc<AtomicBool>) -> Result<Answer, String> {
        let most = self.items.unwrap_or(ITEMS);
        if !(1..=MOST_ITEMS).contains(&most) {
            return Err(format!("`items` must be from 1 to {MOST_ITEMS}"));
        }
        let module = match &self.module {
            None => None,
            Some(name) => Some(items::module_text(name).ok_or_else(|| {
                format!("the library has no module `{name}`; without arguments this tool lists them")
            })?),
        };
        let empty = Shelf { items: Vec::new(), modules: Vec::new(), text: None };
        match (self.words, module) {
            (Some(words), _) => {
                let items = items::search(&words, self.module.as_deref(), most);
                let mut text: String = items.iter().map(Item::told).collect();
                if items.is_empty() {
                    text = format!("no item of the library fits `{words}`\n");
                }
                Answer::new(text, Shelf { items, ..empty })
            }
            (None, Some(text)) => Answer::new(text.to_string(), Shelf { text: Some(text.to_string()), ..empty }),
            (None, None) => {
                let modules: Vec<Module> = items::modules()
                    .map(|(name, about)| Module { name: name.to_string(), about: about.to_string() })
                    .collect();
                let text: String = modules.iter().map(|m| format!("{}  {}\n", m.name, m.about)).collect();
                Answer::new(text, Shelf { modules, ..empty })
            }
        }
    }
}
