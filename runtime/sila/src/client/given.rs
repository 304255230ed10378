//! What a text gives to a command.

use matterix_sila::feature::{Command, Element, Feature};

use crate::text::{self, Call};
use crate::value::Value;

/// The values of a command's parameters, in their order.
pub(super) fn arguments(feature: &Feature, command: &Command, call: &Call) -> Result<Vec<Value>, String> {
    let name = &command.identifier;
    for (given, _) in &call.arguments {
        if !command.parameters.iter().any(|p| p.identifier == *given) {
            let known: Vec<String> = command.parameters.iter().map(|p| format!("`{}`", p.identifier)).collect();
            return Err(format!("`{name}` has no parameter `{given}`; it has {}", known.join(", ")));
        }
    }
    let value = |element: &Element| {
        let mut given = call.arguments.iter().filter(|(given, _)| *given == element.identifier);
        match (given.next(), given.next()) {
            (Some((_, text)), None) => text::value(feature, &element.ty, text)
                .map_err(|why| format!("`{}` of `{name}`: {why}", element.identifier)),
            (None, _) => Err(format!("`{name}` is not given `{}`", element.identifier)),
            (_, Some(_)) => Err(format!("`{name}` is given `{}` twice", element.identifier)),
        }
    };
    command.parameters.iter().map(value).collect()
}

/// Whether a text that is sent begins this command.
pub fn is_of(said: &str, asked: &str) -> bool {
    match (text::call(said), text::call(asked)) {
        (Ok(said), Ok(asked)) => said.path == asked.path,
        _ => false,
    }
}
