//! The tools, one file each.

mod arguments;
mod check;
mod contents;
mod explain;
mod fix;
mod format;
mod items;
mod library;
mod plan;
mod run;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use rmcp::model::{JsonObject, Tool, ToolAnnotations};
use rmcp::schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::answer::Answer;
use super::desk::Desk;
use super::work::Work;

pub use items::module_text;

/// The arguments of a tool, which know what to do.
trait Task: DeserializeOwned + JsonSchema + Send + 'static {
    /// The name it is called by.
    const NAME: &'static str;
    /// A heading.
    const TITLE: &'static str;
    /// What it does and when to use it.
    const ABOUT: &'static str;
    /// Whether it may write a file.
    const WRITES: bool = false;
    /// Its data.
    type Data: Serialize + JsonSchema + 'static;

    /// How long it may take.
    fn limit(&self) -> Option<u64> {
        None
    }

    /// Does it; `stop` is set when nobody waits any more. `Err` says in words what is wrong with the call.
    fn perform(self, desk: &Desk, stop: &Arc<AtomicBool>) -> Result<Answer, String>;
}

/// Seconds of a call that does not say.
const SECONDS: u64 = 60;
/// The most it may say.
const MOST_SECONDS: u64 = 600;

/// What a client asked a tool for: within what time, and the work.
pub struct Order {
    /// When it is given up.
    pub limit: Duration,
    /// What is done.
    pub work: Work,
}

/// A tool as it is offered.
pub struct Offer {
    /// Name, description and schemas.
    pub tool: Tool,
    /// Arguments to work; `Err` says in words what is wrong with them.
    pub order: fn(JsonObject) -> Result<Order, String>,
}

/// All tools, in the order in which they are listed.
pub fn all() -> Vec<Offer> {
    vec![
        offer::<check::Check>(),
        offer::<fix::FixTask>(),
        offer::<explain::Explain>(),
        offer::<contents::Contents>(),
        offer::<run::Run>(),
        offer::<plan::Plan>(),
        offer::<library::Library>(),
        offer::<format::Format>(),
    ]
}

fn offer<T: Task>() -> Offer {
    let hints = ToolAnnotations::new().read_only(!T::WRITES).destructive(T::WRITES).idempotent(true).open_world(false);
    let tool = Tool::new(T::NAME, T::ABOUT, JsonObject::new())
        .with_title(T::TITLE)
        .with_input_schema::<T>()
        .with_output_schema::<T::Data>()
        .annotate(hints);
    Offer { tool, order: order::<T> }
}

fn order<T: Task>(arguments: JsonObject) -> Result<Order, String> {
    let given = Value::Object(arguments);
    let task: T = serde_json::from_value(given).map_err(|e| format!("wrong arguments of `{}`: {e}", T::NAME))?;
    let seconds = task.limit().unwrap_or(SECONDS);
    if !(1..=MOST_SECONDS).contains(&seconds) {
        return Err(format!("`seconds` must be from 1 to {MOST_SECONDS}"));
    }
    Ok(Order { limit: Duration::from_secs(seconds), work: Box::new(move |desk, stop| task.perform(desk, stop)) })
}
