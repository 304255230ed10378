//! Features as XML that keeps to the standard's schema.

use std::fmt::Write;

use crate::feature::{BASES, Constraints, DataType, Element, Feature};

/// The feature as a text.
pub fn write(feature: &Feature) -> String {
    let mut out = Writer { text: String::new(), depth: 0 };
    out.text.push_str("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
    let head = format!(
        "Feature SiLA2Version=\"1.1\" FeatureVersion=\"{}.{}\" MaturityLevel=\"Draft\" Originator=\"{}\" \
         Category=\"{}\" xmlns=\"http://www.sila-standard.org\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"http://www.sila-standard.org \
         https://gitlab.com/SiLA2/sila_base/raw/master/schema/FeatureDefinition.xsd\"",
        feature.version.0, feature.version.1, feature.originator, feature.category
    );
    out.open(&head);
    out.named(&feature.identifier, &feature.display, &feature.description);
    for command in &feature.commands {
        out.open("Command");
        out.named(&command.identifier, &command.display, &command.description);
        out.leaf("Observable", if command.observable { "Yes" } else { "No" });
        command.parameters.iter().for_each(|e| out.element("Parameter", e));
        command.responses.iter().for_each(|e| out.element("Response", e));
        command.intermediate.iter().for_each(|e| out.element("IntermediateResponse", e));
        out.errors(&command.errors);
        out.close("Command");
    }
    for property in &feature.properties {
        out.open("Property");
        out.named(&property.identifier, &property.display, &property.description);
        out.leaf("Observable", if property.observable { "Yes" } else { "No" });
        out.data_type(&property.ty);
        out.errors(&property.errors);
        out.close("Property");
    }
    for metadata in &feature.metadata {
        out.open("Metadata");
        out.inner(&metadata.element);
        out.errors(&metadata.errors);
        out.close("Metadata");
    }
    for error in &feature.errors {
        out.open("DefinedExecutionError");
        out.named(&error.identifier, &error.display, &error.description);
        out.close("DefinedExecutionError");
    }
    feature.types.iter().for_each(|e| out.element("DataTypeDefinition", e));
    out.close("Feature");
    out.text
}

struct Writer {
    text: String,
    depth: usize,
}

impl Writer {
    fn line(&mut self, text: &str) {
        // Writing to a text cannot fail.
        let _ = writeln!(self.text, "{:1$}{text}", "", 2 * self.depth);
    }

    fn open(&mut self, tag: &str) {
        self.line(&format!("<{tag}>"));
        self.depth += 1;
    }

    fn close(&mut self, tag: &str) {
        self.depth -= 1;
        self.line(&format!("</{tag}>"));
    }

    fn leaf(&mut self, tag: &str, text: &str) {
        self.line(&format!("<{tag}>{}</{tag}>", escaped(text)));
    }

    fn named(&mut self, identifier: &str, display: &str, description: &str) {
        self.leaf("Identifier", identifier);
        self.leaf("DisplayName", display);
        self.leaf("Description", description);
    }

    fn element(&mut self, tag: &str, element: &Element) {
        self.open(tag);
        self.inner(element);
        self.close(tag);
    }

    fn inner(&mut self, element: &Element) {
        self.named(&element.identifier, &element.display, &element.description);
        self.data_type(&element.ty);
    }

    fn errors(&mut self, errors: &[String]) {
        if errors.is_empty() {
            return;
        }
        self.open("DefinedExecutionErrors");
        errors.iter().for_each(|e| self.leaf("Identifier", e));
        self.close("DefinedExecutionErrors");
    }

    fn data_type(&mut self, ty: &DataType) {
        self.open("DataType");
        match ty {
            DataType::Basic(basic) => self.leaf("Basic", basic.name()),
            DataType::List(inner) => {
                self.open("List");
                self.data_type(inner);
                self.close("List");
            }
            DataType::Structure(parts) => {
                self.open("Structure");
                parts.iter().for_each(|p| self.element("Element", p));
                self.close("Structure");
            }
            DataType::Constrained(inner, constraints) => {
                self.open("Constrained");
                self.data_type(inner);
                self.constraints(constraints);
                self.close("Constrained");
            }
            DataType::Identifier(name) => self.leaf("DataTypeIdentifier", name),
        }
        self.close("DataType");
    }

    /// Fewest and most, as one number where these are the same.
    fn sizes(&mut self, sizes: (Option<u64>, Option<u64>), tag: &str) {
        if let (Some(least), Some(most)) = sizes
            && least == most
        {
            return self.leaf(tag, &least.to_string());
        }
        for (size, prefix) in [(sizes.0, "Minimal"), (sizes.1, "Maximal")] {
            // The schema has no least size of 0, which every value has.
            if let Some(size) = size.filter(|s| *s > 0) {
                self.leaf(&format!("{prefix}{tag}"), &size.to_string());
            }
        }
    }

    fn constraints(&mut self, of: &Constraints) {
        self.open("Constraints");
        self.sizes(of.length, "Length");
        if let Some(pattern) = &of.pattern {
            self.leaf("Pattern", pattern);
        }
        self.sizes(of.count, "ElementCount");
        if !of.set.is_empty() {
            self.open("Set");
            of.set.iter().for_each(|v| self.leaf("Value", v));
            self.close("Set");
        }
        for (bound, tag) in [(of.greatest, "Maximal"), (of.least, "Minimal")] {
            if let Some((number, left_out)) = bound {
                let tag = format!("{tag}{}", if left_out { "Exclusive" } else { "Inclusive" });
                self.leaf(&tag, &number.to_string());
            }
        }
        if let Some(unit) = &of.unit {
            self.open("Unit");
            self.leaf("Label", &unit.label);
            self.leaf("Factor", &unit.factor.to_string());
            self.leaf("Offset", &unit.offset.to_string());
            let none = [(0, 0)];
            for (base, exponent) in if unit.components.is_empty() { &none } else { unit.components.as_slice() } {
                self.open("UnitComponent");
                self.leaf("SIUnit", BASES.get(*base).copied().unwrap_or(BASES[0]));
                self.leaf("Exponent", &exponent.to_string());
                self.close("UnitComponent");
            }
            self.close("Unit");
        }
        self.close("Constraints");
    }
}

/// A text inside an element; what XML cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\n' | '\t' => out.push(c),
            '\r' => out.push_str("&#13;"),
            c if c < ' ' || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => out.push(c),
        }
    }
    out
}
