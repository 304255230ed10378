//! Features of SiLA 2 as declarations: a capability with a command for each command and a reading for each number that a
//! server tells, and the driver that speaks to it.
//!
//! The declarations are written as text, which is then read like any other: what is found in them stands in words that a
//! reader can look up. A command says nothing of what it changes; who knows that declares it anew in the capability.

mod commands;
mod types;

use std::collections::BTreeSet;
use std::fmt::Write;

use matterix_ir::hidden::visible;
use matterix_sila::Feature;
use matterix_sila::form::{form, packed};
use matterix_sila::words::name;

use crate::ast::{Member, MemberKind};
use crate::names::verb_text;
use crate::units::Units;
use types::Types;

/// A feature as text.
pub struct Declared {
    /// A capability and its driver.
    pub text: String,
    /// What has no place in the language: the identifier and why.
    pub left_out: Vec<(String, String)>,
}

/// Text that is put together.
struct Writer<'f> {
    types: Types<'f>,
    /// Lines of the capability.
    members: String,
    /// Lines of the driver.
    wires: String,
    left_out: Vec<(String, String)>,
    /// What the capability declares by itself: members and commands.
    own: BTreeSet<String>,
    /// Readings so far.
    told: BTreeSet<String>,
}

/// What a capability declares, by name; a command by its words.
pub fn declared(members: &[Member]) -> BTreeSet<String> {
    let named = members.iter().filter_map(|m| match &m.kind {
        MemberKind::Command { sig, .. } => Some(verb_text(&sig.verb)),
        MemberKind::Value { name, .. } => Some(name.text.clone()),
        _ => None,
    });
    named.collect()
}

/// A feature as a capability of this name and a driver for it; what the capability declares by itself is left to it.
pub fn declarations(feature: &Feature, capability: &str, units: &Units, own: BTreeSet<String>) -> Declared {
    let mut writer = Writer {
        types: Types::new(feature, units, capability),
        members: String::new(),
        wires: String::new(),
        left_out: Vec::new(),
        own,
        told: BTreeSet::new(),
    };
    // Properties first: a response of the same name gets a longer one.
    for property in &feature.properties {
        writer.reading(&property.identifier, &member(&property.identifier), &property.ty, &property.description);
    }
    feature.commands.iter().for_each(|c| writer.command(c));
    for error in &feature.errors {
        writer.wire(&format!("reply \"{}\" fails {}", error.identifier, name(&error.identifier)));
    }
    if writer.own.contains(SAFE) {
        writer.wire(&format!("safe sends \"{{{SAFE}}}\""));
    }
    let left_out = writer.left_out;
    let mut text = String::from("mtx 1\n");
    text.push_str(&writer.types.declarations());
    // Writing to a text cannot fail.
    let _ = writeln!(text, "{}capability {capability} {{\n{}}}", docs(&feature.description, ""), writer.members);
    let id = feature.id();
    let form = packed(&form(feature));
    let _ = writeln!(
        text,
        "/// Calls of the feature `{id}`.\ndriver {capability}Sila for {capability} over sila(feature: \"{id}\", timeout: {PATIENCE},\n    definition: \"{form}\") {{\n{}}}",
        writer.wires
    );
    Declared { text, left_out }
}

/// An identifier as a name of the language; one that is a word of the language ends in a line below.
fn member(identifier: &str) -> String {
    let name = name(identifier);
    if matterix_syntax::is_name(&name) { name } else { format!("{name}_") }
}

/// An identifier as the name of an option, which prepositions may be.
fn option(identifier: &str) -> String {
    let name = name(identifier);
    if matterix_syntax::is_option(&name) { name } else { format!("{name}_") }
}

/// The parameter that a capability declares where assets say by which call they are made safe.
const SAFE: &str = "safe_call";

/// How long a server may take to answer a call.
const PATIENCE: &str = "10 s";

/// A description as a comment. Hidden characters of another author's text stand in letters, which nobody has to remove.
fn docs(text: &str, indent: &str) -> String {
    let line: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.is_empty() { String::new() } else { format!("{indent}/// {}\n", visible(&line)) }
}

impl Writer<'_> {
    fn member(&mut self, line: &str) {
        let _ = writeln!(self.members, "    {line}");
    }

    fn wire(&mut self, line: &str) {
        let _ = writeln!(self.wires, "    {line}");
    }

    fn leave_out(&mut self, identifier: &str, why: impl Into<String>) {
        self.left_out.push((identifier.to_owned(), why.into()));
    }

    /// A number that the server tells. What the twin supposes it to be is a parameter: nothing is known of it.
    fn reading(&mut self, asks: &str, member: &str, ty: &matterix_sila::feature::DataType, description: &str) {
        let told = match self.types.told(ty) {
            Ok(told) => told,
            Err(why) => return self.leave_out(asks, format!("which {why}")),
        };
        let member = match self.told.contains(member) {
            true => self::member(&asks.replace('.', "")),
            false => member.to_owned(),
        };
        if !self.told.insert(member.clone()) {
            return self.leave_out(asks, format!("which would have the name `{member}` of another"));
        }
        if !self.own.contains(&member) {
            let supposed = format!("supposed_{member}");
            if !self.own.contains(&supposed) {
                self.members.push_str(&format!("    /// What `{member}` is in simulation.\n"));
                self.member(&format!("param {supposed}: {}", told.ty));
            }
            self.members.push_str(&docs(description, "    "));
            self.member(&format!("reading {member}: {} = {supposed}", told.ty));
        }
        self.wire(&format!("reading {member} asks \"{asks}\" expects \"{{{}}}\"", told.unit));
    }
}
