//! Ways to begin: what a client can put before its model, with what a person has filled in.

use rmcp::model::{GetPromptResult, JsonObject, Prompt, PromptArgument, PromptMessage, Role};
use serde_json::Value;

/// A beginning with gaps.
struct Start {
    name: &'static str,
    title: &'static str,
    about: &'static str,
    gap: &'static str,
    gap_about: &'static str,
    text: &'static str,
}

const STARTS: &[Start] = &[
    Start {
        name: "write-protocol",
        title: "Write a protocol",
        about: "Write a protocol from a description, until it has no findings and its expectations are met",
        gap: "task",
        gap_about: "the task of the protocol: substances, amounts, vessels, devices, the expected result",
        text: include_str!("texts/write.md"),
    },
    Start {
        name: "repair-protocol",
        title: "Repair a protocol",
        about: "Repair a protocol until it has no findings, without changing its purpose",
        gap: "path",
        gap_about: "the file, relative to the folder of the server",
        text: include_str!("texts/repair.md"),
    },
];

/// All that are offered.
pub fn all() -> Vec<Prompt> {
    let prompts = STARTS.iter().map(|start| {
        let gap = PromptArgument::new(start.gap).with_description(start.gap_about).with_required(true);
        Prompt::new(start.name, Some(start.about), Some(vec![gap])).with_title(start.title)
    });
    prompts.collect()
}

/// One with its gap filled in; `Err` says in words what is missing.
pub fn get(name: &str, given: &JsonObject) -> Result<GetPromptResult, String> {
    let Some(start) = STARTS.iter().find(|s| s.name == name) else {
        let names: Vec<&str> = STARTS.iter().map(|s| s.name).collect();
        return Err(format!("unknown prompt `{name}`; use {}", names.join(", ")));
    };
    let Some(filled) = given.get(start.gap).and_then(Value::as_str).filter(|t| !t.trim().is_empty()) else {
        return Err(format!("`{name}` needs `{}`: {}", start.gap, start.gap_about));
    };
    let text = start.text.replace(&format!("{{{}}}", start.gap), filled);
    Ok(GetPromptResult::new(vec![PromptMessage::new_text(Role::User, text)]).with_description(start.about))
}
