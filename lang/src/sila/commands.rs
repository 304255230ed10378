//! Commands of a feature as commands of a device: every parameter is an option of the call.

use matterix_sila::feature::Command;
use matterix_sila::words::{name, words};

use super::{Writer, docs, member, option};

impl Writer<'_> {
    pub(super) fn command(&mut self, command: &Command) {
        let verb = verb(&command.identifier);
        let (mut options, mut needs, mut arguments) = (Vec::new(), Vec::new(), Vec::new());
        for parameter in &command.parameters {
            let option = option(&parameter.identifier);
            let given = match self.types.given(&option, &parameter.ty) {
                Ok(given) => given,
                Err(why) => {
                    let why = format!("whose parameter `{}` {why}", parameter.identifier);
                    return self.leave_out(&command.identifier, why);
                }
            };
            options.push(format!("option {option}: {}", given.ty));
            needs.extend(given.needs);
            arguments.push(format!("{}: {}", parameter.identifier, given.piece));
        }
        let key = member(&command.identifier);
        if command.observable {
            let [takes, timeout] = [format!("{key}_takes"), format!("{key}_timeout")];
            for (param, says) in [(&takes, "How long it takes in simulation."), (&timeout, "How long it may take.")] {
                if !self.own.contains(param) {
                    self.members.push_str(&docs(says, "    "));
                    self.member(&format!("param {param}: Duration"));
                }
            }
        }
        if !self.own.contains(&verb) {
            self.members.push_str(&docs(&command.description, "    "));
            self.member(&format!("command {verb}"));
            for clause in options {
                self.member(&format!("    {clause}"));
            }
            for need in needs {
                self.member(&format!("    needs {need}"));
            }
            if !command.errors.is_empty() {
                let fails: Vec<String> = command.errors.iter().map(|e| name(e)).collect();
                self.member(&format!("    fails {}", fails.join(", ")));
            }
            if command.observable {
                self.member(&format!("    takes {key}_takes in 0 s .. {key}_timeout"));
            }
        }
        let said = match arguments.is_empty() {
            true => command.identifier.clone(),
            false => format!("{}({})", command.identifier, arguments.join(", ")),
        };
        let until = match command.observable {
            true => format!(" until asks \"{}\" timeout {key}_timeout", command.identifier),
            false => String::new(),
        };
        self.wire(&format!("{verb} sends \"{said}\"{until}"));
        for answer in command.responses.iter().chain(&command.intermediate) {
            let asks = format!("{}.{}", command.identifier, answer.identifier);
            self.reading(&asks, &member(&answer.identifier), &answer.ty, &answer.description);
        }
    }
}

/// The words of a command; one word where they would read as something else.
fn verb(identifier: &str) -> String {
    let words = words(identifier);
    match words.iter().all(|w| matterix_syntax::is_name(w)) {
        true => words.join(" "),
        false => member(identifier),
    }
}
