//! A protocol as JSON of schema 8.

use matterix_ir::Span;
use serde_json::{Map, Value, json};

use super::form::loads_bin;
use super::protocol::{Command, Protocol};
use crate::place;

/// The file.
pub(super) fn write(protocol: &Protocol<'_>) -> Vec<u8> {
    let mut commands: Vec<Value> = Vec::new();
    let mut said: Option<Span> = None;
    // Bins are areas of the deck, which nothing loads.
    for command in protocol.loads.iter().filter(|command| !loads_bin(command.name)) {
        commands.push(entry(commands.len(), command.name, &command.params));
    }
    for command in &protocol.commands {
        if said != Some(command.at) {
            said = Some(command.at);
            let (file, line, text) = place::line(protocol.subject.sources, command.at);
            let message = Map::from_iter([("message".to_owned(), Value::from(format!("{file}:{line}: {text}")))]);
            commands.push(entry(commands.len(), "comment", &message));
        }
        commands.push(entry(commands.len(), command.name, &params(command)));
    }
    let liquids: Map<String, Value> = protocol
        .liquids
        .iter()
        .map(|(id, name)| (id.clone(), json!({ "displayName": name, "description": "" })))
        .collect();
    // Those of Opentrons too: the software of a robot may be older than the library.
    let definitions: Map<String, Value> = protocol.definitions.iter().chain(&protocol.library).cloned().collect();
    let robot = |name: &str| protocol.robot.setting(name).unwrap_or_default();
    let document = json!({
        "$otSharedSchema": "#/protocol/schemas/8",
        "schemaVersion": 8,
        "metadata": {
            "protocolName": protocol.subject.program.plan.workflow,
            "author": "",
            "description": "",
            "created": 0,
            "tags": [],
        },
        "robot": { "model": robot("robot"), "deckId": robot("deck") },
        "liquidSchemaId": "opentronsLiquidSchemaV1",
        "liquids": liquids,
        "labwareDefinitionSchemaId": "opentronsLabwareSchemaV2",
        "labwareDefinitions": definitions,
        "commandSchemaId": "opentronsCommandSchemaV8",
        "commands": commands,
        "commandAnnotationSchemaId": "opentronsCommandAnnotationSchemaV1",
        "commandAnnotations": [],
    });
    format!("{document:#}\n").into_bytes()
}

fn params(command: &Command) -> Map<String, Value> {
    command.params.clone()
}

fn entry(index: usize, name: &str, params: &Map<String, Value>) -> Value {
    json!({ "commandType": name, "key": format!("{}", index + 1), "params": params })
}
