//! An analysis of a protocol: the commands that it would run, as Opentrons' software writes them (`opentrons analyze --json-output`), or the
//! commands of a JSON protocol of schema 6 to 8.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use super::robot::Robot;
use crate::Mistake;

/// The file.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Analysis {
    pub(super) commands: Vec<Command>,
    #[serde(default)]
    pub(super) errors: Vec<Trouble>,
    #[serde(default)]
    pub(super) metadata: BTreeMap<String, Value>,
    #[serde(default)]
    robot_type: Option<String>,
    #[serde(default)]
    robot: Option<Model>,
    /// Liquids: a list in an analysis, by identifier in a protocol.
    #[serde(default)]
    liquids: Value,
    /// Definitions of a JSON protocol.
    #[serde(default)]
    pub(super) labware_definitions: BTreeMap<String, Value>,
}

#[derive(Debug, Deserialize)]
struct Model {
    #[serde(default)]
    model: String,
}

/// An error of the analysis.
#[derive(Debug, Deserialize)]
pub(super) struct Trouble {
    #[serde(default)]
    pub(super) detail: String,
}

/// One command.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Command {
    pub(super) command_type: String,
    #[serde(default)]
    pub(super) params: Value,
    #[serde(default)]
    pub(super) result: Value,
}

impl Analysis {
    /// Reads it.
    pub(super) fn read(text: &str) -> Result<Analysis, Mistake> {
        let read: Analysis = serde_json::from_str(text).map_err(|e| {
            let why = format!("this is neither an analysis nor a JSON protocol of Opentrons ({e})");
            Mistake { line: e.line(), why }
        })?;
        if let Some(trouble) = read.errors.first() {
            let why = format!("the protocol fails in its analysis: {}", trouble.detail.replace('\n', " "));
            return Err(Mistake { line: 0, why });
        }
        if let Some(model) = read.model().filter(|model| Robot::named(model).is_none()) {
            let why = format!("it is for `{model}`; only protocols of the OT-2 and of the Flex are imported");
            return Err(Mistake { line: 0, why });
        }
        Ok(read)
    }

    /// What it calls its robot.
    fn model(&self) -> Option<&str> {
        self.robot_type.as_deref().or(self.robot.as_ref().map(|r| r.model.as_str()))
    }

    /// Its robot; the OT-2 where it names none.
    pub(super) fn robot(&self) -> Robot {
        self.model().and_then(Robot::named).unwrap_or_default()
    }

    /// The name of a liquid.
    pub(super) fn liquid(&self, id: &str) -> Option<&str> {
        let entry = match &self.liquids {
            Value::Array(all) => all.iter().find(|liquid| liquid["id"] == id),
            Value::Object(all) => all.get(id),
            _ => None,
        };
        entry?["displayName"].as_str()
    }
}

impl Command {
    /// A text among its parameters; empty where there is none.
    pub(super) fn text(&self, name: &str) -> &str {
        self.params[name].as_str().unwrap_or("")
    }

    /// A number among its parameters.
    pub(super) fn number(&self, name: &str) -> Option<f64> {
        self.params[name].as_f64()
    }

    /// What its stroke is more than its volume, uL, because of the liquid class.
    pub(super) fn correction(&self) -> f64 {
        self.number("correctionVolume").unwrap_or(0.0)
    }

    /// Its volume, uL; 0 where it gives none.
    pub(super) fn volume(&self) -> f64 {
        self.number("volume").unwrap_or(0.0)
    }

    /// What its result or, in a JSON protocol, its parameters call what it loads.
    pub(super) fn loaded(&self, name: &str) -> Option<&str> {
        self.result[name].as_str().or_else(|| self.params[name].as_str())
    }
}
