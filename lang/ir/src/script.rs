//! What the drivers of devices say for a workflow in one kind of file.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::plan::{Condition, StepId};
use crate::scene::InstanceId;
use crate::{NodeId, Span, Text};

/// Everything that is said for one program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wiring {
    /// `opentrons`: what stands after `over`.
    pub transport: String,
    /// Devices with a driver over it, in the order of the scene.
    pub devices: Vec<Wired>,
    /// What an operation says when it begins, for those whose device has a line for it.
    pub steps: BTreeMap<StepId, Vec<Message>>,
    /// Where devices wait by themselves instead for a condition: a wait of no time after that, and the condition, which must hold then.
    #[serde(default)]
    pub awaited: BTreeMap<StepId, Condition>,
    /// Each operation as it is called, with its values.
    pub calls: BTreeMap<StepId, Text>,
    /// Texts of the files that assets come from, by what the asset's text says after `from`.
    #[serde(default)]
    pub files: BTreeMap<String, String>,
}

impl Wiring {
    /// The driver of a device.
    pub fn of(&self, device: InstanceId) -> Option<&Wired> {
        self.devices.iter().find(|w| w.device == device)
    }
}

/// A device with its driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wired {
    /// Which.
    pub device: InstanceId,
    /// The name of its driver.
    pub driver: String,
    /// What the driver says of its wire: `api: "2.19"`.
    pub settings: Vec<(String, String)>,
    /// What is said before anything else.
    pub opens: Vec<Message>,
    /// Where the driver's name stands.
    pub span: Span,
}

impl Wired {
    /// A setting.
    pub fn setting(&self, name: &str) -> Option<&str> {
        self.settings.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }
}

/// One message; its quantities are numbers in the unit that the text names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Message {
    /// With its values.
    pub text: Text,
    /// Where the driver says it.
    pub span: Span,
    /// It is said only if this holds as the workflow begins.
    #[serde(default)]
    pub condition: Option<NodeId>,
}
