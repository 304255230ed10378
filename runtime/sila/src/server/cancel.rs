//! The feature by which commands are broken off: `org.silastandard/core.commands/CancelController/v1`.

use matterix_sila::feature::{Basic, Command, Constraints, DataType, Element, Feature, Named};

use crate::service::spaced;

/// Its identifier.
pub(super) const IDENTIFIER: &str = "CancelController";

/// The error where no such execution goes on.
pub(super) const UNKNOWN: &str = "InvalidCommandExecutionUUID";

/// The standard's error where a command cannot be broken off: all can be here.
const UNSUPPORTED: &str = "OperationNotSupported";

/// The type of its parameter.
const UUID: &str = "UUID";

/// The definition.
pub(super) fn feature() -> Feature {
    let command = |identifier: &str, description: &str| Command {
        identifier: identifier.to_owned(),
        display: spaced(identifier),
        description: description.to_owned(),
        ..Command::default()
    };
    let written = Constraints {
        length: (Some(36), Some(36)),
        pattern: Some("[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}".to_owned()),
        ..Constraints::default()
    };
    Feature {
        identifier: IDENTIFIER.to_owned(),
        display: "Cancel Controller".to_owned(),
        description: "Cancels running commands. The things that they use stay in their state, as after a failure."
            .to_owned(),
        originator: "org.silastandard".to_owned(),
        category: "core.commands".to_owned(),
        version: (1, 0),
        commands: vec![
            Command {
                parameters: vec![Element {
                    identifier: "CommandExecutionUUID".to_owned(),
                    display: "Command Execution UUID".to_owned(),
                    description: "The identifier of the execution.".to_owned(),
                    ty: DataType::Identifier(UUID.to_owned()),
                }],
                errors: vec![UNKNOWN.to_owned(), UNSUPPORTED.to_owned()],
                ..command("CancelCommand", "Cancels one command.")
            },
            command("CancelAll", "Cancels every running command."),
        ],
        types: vec![Element {
            identifier: UUID.to_owned(),
            display: UUID.to_owned(),
            description: "The identifier of an execution.".to_owned(),
            ty: DataType::Constrained(Box::new(DataType::Basic(Basic::String)), Box::new(written)),
        }],
        errors: vec![
            Named {
                identifier: UNKNOWN.to_owned(),
                display: "Invalid Command Execution UUID".to_owned(),
                description: "No command with this execution is running.".to_owned(),
            },
            Named {
                identifier: UNSUPPORTED.to_owned(),
                display: "Operation Not Supported".to_owned(),
                description: "The command cannot be cancelled.".to_owned(),
            },
        ],
        ..Feature::default()
    }
}
