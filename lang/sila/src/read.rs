//! Features from their XML.

use std::collections::BTreeSet;
use std::fmt;

use roxmltree::{Document, Node, ParsingOptions};

use crate::feature::{
    BASES, Basic, Command, Constraints, DataType, Element, Feature, Metadata, Named, Property, SiUnit,
};

/// Longer texts are refused, bytes.
pub const MOST_BYTES: usize = 4 << 20;

/// Types in types beyond this are refused.
const DEEPEST: usize = 32;

/// Constraints of the standard that are left to the server that states them.
const NOT_LOOKED_AT: &[&str] = &[
    "ContentType",
    "Schema",
    "FullyQualifiedIdentifier",
    "AllowedTypes",
    // Of dates and times.
    "MinimalInclusive",
    "MinimalExclusive",
    "MaximalInclusive",
    "MaximalExclusive",
];

/// Features with more types of their own are refused.
const MOST_TYPES: usize = 1000;

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Line of the text, from 1.
    pub line: u32,
    /// In words.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.message)
    }
}

impl std::error::Error for Problem {}

fn wrong(node: Node<'_, '_>, message: impl Into<String>) -> Problem {
    Problem { line: node.document().text_pos_at(node.range().start).row, message: message.into() }
}

/// The feature that a text defines.
pub fn read(text: &str) -> Result<Feature, Problem> {
    if text.len() > MOST_BYTES {
        return Err(Problem { line: 1, message: format!("the text is longer than {} MiB", MOST_BYTES >> 20) });
    }
    let options = ParsingOptions { nodes_limit: 1 << 18, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text.trim_start_matches('\u{feff}'), options).map_err(|e| {
        let (place, message) = (format!(" at {}", e.pos()), e.to_string());
        Problem { line: e.pos().row, message: message.trim_end_matches(&place).replace('\'', "`") }
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "Feature" {
        let message = format!("the outermost element is `{}`, not `Feature`", root.tag_name().name());
        return Err(wrong(root, message));
    }
    let attribute = |name: &str| root.attribute(name).map(str::trim).filter(|t| !t.is_empty());
    let originator = attribute("Originator").ok_or_else(|| wrong(root, "the feature has no `Originator`"))?;
    let category = attribute("Category").unwrap_or("none");
    for word in [originator, category] {
        if !word.starts_with(|c: char| c.is_ascii_lowercase())
            || !word.chars().all(|c| c.is_ascii_lowercase() || c == '.')
        {
            return Err(wrong(root, format!("`{word}` may contain only lower case letters and points")));
        }
    }
    let version = attribute("FeatureVersion").ok_or_else(|| wrong(root, "the feature has no `FeatureVersion`"))?;
    let version = version.split_once('.').and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)));
    let version = version.ok_or_else(|| wrong(root, "write a `FeatureVersion` as in `1.0`"))?;
    let head = named(root)?;
    let mut feature = Feature {
        identifier: head.identifier,
        display: head.display,
        description: head.description,
        originator: originator.to_owned(),
        category: category.to_owned(),
        version,
        ..Feature::default()
    };
    for child in root.children().filter(Node::is_element) {
        match child.tag_name().name() {
            "Identifier" | "DisplayName" | "Description" => {}
            "Command" => feature.commands.push(command(child)?),
            "Property" => feature.properties.push(property(child)?),
            "Metadata" => feature.metadata.push(Metadata { element: element(child)?, errors: errors(child)? }),
            "DefinedExecutionError" => feature.errors.push(named(child)?),
            "DataTypeDefinition" => feature.types.push(element(child)?),
            other => return Err(wrong(child, format!("a feature cannot contain `{other}`"))),
        }
    }
    if feature.types.len() > MOST_TYPES {
        return Err(wrong(root, format!("the feature has more than {MOST_TYPES} types of its own")));
    }
    judge(&feature, root)?;
    Ok(feature)
}

/// What hangs together: names are there, and there once.
fn judge(feature: &Feature, root: Node<'_, '_>) -> Result<(), Problem> {
    let at = |identifier: &str| {
        let holds = |n: &Node<'_, '_>| n.has_tag_name_of("Identifier") && n.text().map(str::trim) == Some(identifier);
        root.descendants().rfind(holds).unwrap_or(root)
    };
    let groups: [Vec<&String>; 5] = [
        feature.commands.iter().map(|c| &c.identifier).collect(),
        feature.properties.iter().map(|p| &p.identifier).collect(),
        feature.errors.iter().map(|e| &e.identifier).collect(),
        feature.types.iter().map(|t| &t.identifier).collect(),
        feature.metadata.iter().map(|m| &m.element.identifier).collect(),
    ];
    let elements = feature.commands.iter().flat_map(|c| [&c.parameters, &c.responses, &c.intermediate]);
    let elements: Vec<&Vec<Element>> = elements.collect();
    let inner = elements.iter().map(|list| list.iter().map(|e| &e.identifier).collect());
    for group in groups.into_iter().chain(inner.collect::<Vec<_>>()) {
        if let Some(twice) = (1..group.len()).find(|i| group[..*i].contains(&group[*i])).map(|i| group[i]) {
            return Err(wrong(at(twice), format!("`{twice}` is defined twice")));
        }
    }
    let raised = feature.commands.iter().flat_map(|c| &c.errors);
    let raised = raised.chain(feature.properties.iter().flat_map(|p| &p.errors));
    for error in raised.chain(feature.metadata.iter().flat_map(|m| &m.errors)) {
        if !feature.errors.iter().any(|e| e.identifier == *error) {
            return Err(wrong(at(error), format!("the error `{error}` is not defined")));
        }
    }
    let of_commands = elements.iter().flat_map(|list| list.iter().map(|e| &e.ty));
    let types = of_commands.chain(feature.properties.iter().map(|p| &p.ty)).chain(feature.types.iter().map(|t| &t.ty));
    for ty in types.chain(feature.metadata.iter().map(|m| &m.element.ty)) {
        of_lists(ty).map_err(|message| wrong(root, message))?;
        for name in named_in(ty) {
            if !feature.types.iter().any(|t| t.identifier == *name) {
                return Err(wrong(at(name), format!("the type `{name}` is not defined")));
            }
        }
    }
    endless(feature).map_or(Ok(()), |name| Err(wrong(at(name), format!("the type `{name}` contains itself"))))
}

fn of_lists(ty: &DataType) -> Result<(), &'static str> {
    match ty {
        DataType::List(inner) if matches!(inner.plain(), DataType::List(_)) => Err("a list cannot contain lists"),
        DataType::List(inner) | DataType::Constrained(inner, _) => of_lists(inner),
        DataType::Structure(parts) => parts.iter().try_for_each(|p| of_lists(&p.ty)),
        DataType::Basic(_) | DataType::Identifier(_) => Ok(()),
    }
}

/// The types that a type names.
fn named_in(ty: &DataType) -> Vec<&String> {
    match ty {
        DataType::Basic(_) => Vec::new(),
        DataType::List(inner) | DataType::Constrained(inner, _) => named_in(inner),
        DataType::Structure(parts) => parts.iter().flat_map(|p| named_in(&p.ty)).collect(),
        DataType::Identifier(name) => vec![name],
    }
}

/// A type that holds itself: what is left when types that name none of those left are taken away again and again.
fn endless(feature: &Feature) -> Option<&String> {
    let mut left: Vec<(&String, Vec<&String>)> =
        feature.types.iter().map(|t| (&t.identifier, named_in(&t.ty))).collect();
    loop {
        let names: BTreeSet<&String> = left.iter().map(|(name, _)| *name).collect();
        let before = left.len();
        left.retain(|(_, needs)| needs.iter().any(|n| names.contains(*n)));
        if left.len() == before {
            return left.first().map(|(name, _)| *name);
        }
    }
}

trait Tagged {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl Tagged for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn children<'a, 'd>(node: Node<'a, 'd>, name: &'static str) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |n| n.has_tag_name_of(name))
}

fn child<'a, 'd>(node: Node<'a, 'd>, name: &'static str) -> Result<Node<'a, 'd>, Problem> {
    let mut all = children(node, name);
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(wrong(node, format!("`{}` has no `{name}`", node.tag_name().name()))),
        (_, Some(second)) => Err(wrong(second, format!("`{}` has `{name}` twice", node.tag_name().name()))),
    }
}

fn text<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().map_or("", str::trim)
}

fn identifier(node: Node<'_, '_>) -> Result<String, Problem> {
    let word = text(node);
    let good = word.starts_with(|c: char| c.is_ascii_uppercase())
        && word.len() <= 255
        && word.chars().all(|c| c.is_ascii_alphanumeric());
    if good {
        return Ok(word.to_owned());
    }
    Err(wrong(node, format!("`{word}` is not an identifier: a capital letter, then letters and digits")))
}

fn named(node: Node<'_, '_>) -> Result<Named, Problem> {
    Ok(Named {
        identifier: identifier(child(node, "Identifier")?)?,
        display: text(child(node, "DisplayName")?).to_owned(),
        description: text(child(node, "Description")?).to_owned(),
    })
}

fn element(node: Node<'_, '_>) -> Result<Element, Problem> {
    let Named { identifier, display, description } = named(node)?;
    Ok(Element { identifier, display, description, ty: data_type(child(node, "DataType")?, 0)? })
}

fn yes(node: Node<'_, '_>) -> Result<bool, Problem> {
    let observable = child(node, "Observable")?;
    match text(observable) {
        "Yes" => Ok(true),
        "No" => Ok(false),
        other => Err(wrong(observable, format!("`Observable` must be `Yes` or `No`, not `{other}`"))),
    }
}

fn errors(node: Node<'_, '_>) -> Result<Vec<String>, Problem> {
    let lists = children(node, "DefinedExecutionErrors").collect::<Vec<_>>();
    lists.into_iter().flat_map(|list| children(list, "Identifier").collect::<Vec<_>>()).map(identifier).collect()
}

fn command(node: Node<'_, '_>) -> Result<Command, Problem> {
    let Named { identifier, display, description } = named(node)?;
    let all = |name| children(node, name).map(element).collect::<Result<Vec<_>, _>>();
    let observable = yes(node)?;
    let intermediate = all("IntermediateResponse")?;
    if !observable && !intermediate.is_empty() {
        return Err(wrong(node, format!("`{identifier}` is not observable, but has an `IntermediateResponse`")));
    }
    let (parameters, responses) = (all("Parameter")?, all("Response")?);
    Ok(Command {
        identifier,
        display,
        description,
        observable,
        parameters,
        responses,
        intermediate,
        errors: errors(node)?,
    })
}

fn property(node: Node<'_, '_>) -> Result<Property, Problem> {
    let Element { identifier, display, description, ty } = element(node)?;
    Ok(Property { identifier, display, description, observable: yes(node)?, ty, errors: errors(node)? })
}

fn data_type(node: Node<'_, '_>, depth: usize) -> Result<DataType, Problem> {
    if depth > DEEPEST {
        return Err(wrong(node, format!("a type is nested more than {DEEPEST} deep")));
    }
    let mut inside = node.children().filter(Node::is_element);
    let (Some(inner), None) = (inside.next(), inside.next()) else {
        return Err(wrong(node, "a `DataType` must contain one type"));
    };
    Ok(match inner.tag_name().name() {
        "Basic" => {
            let found = Basic::ALL.iter().find(|(name, _)| *name == text(inner));
            let found = found.ok_or_else(|| wrong(inner, format!("unknown basic type `{}`", text(inner))))?;
            DataType::Basic(found.1)
        }
        "List" => DataType::List(Box::new(data_type(child(inner, "DataType")?, depth + 1)?)),
        "Structure" => {
            let parts = children(inner, "Element").map(|part| {
                let Named { identifier, display, description } = named(part)?;
                let ty = data_type(child(part, "DataType")?, depth + 1)?;
                Ok(Element { identifier, display, description, ty })
            });
            DataType::Structure(parts.collect::<Result<_, _>>()?)
        }
        "Constrained" => {
            let of = data_type(child(inner, "DataType")?, depth + 1)?;
            let constraints = constraints(child(inner, "Constraints")?, &of)?;
            DataType::Constrained(Box::new(of), Box::new(constraints))
        }
        "DataTypeIdentifier" => DataType::Identifier(identifier(inner)?),
        other => return Err(wrong(inner, format!("unknown type `{other}`"))),
    })
}

fn number(node: Node<'_, '_>) -> Result<f64, Problem> {
    let word = text(node);
    let number = word.parse::<f64>().ok().filter(|n| n.is_finite());
    number.ok_or_else(|| wrong(node, format!("`{word}` is not a number")))
}

/// How many characters or elements.
fn size(node: Node<'_, '_>) -> Result<u64, Problem> {
    text(node).parse().map_err(|_| wrong(node, format!("`{}` is not a count", text(node))))
}

fn constraints(node: Node<'_, '_>, of: &DataType) -> Result<Constraints, Problem> {
    let is_number = matches!(of.plain(), DataType::Basic(Basic::Real | Basic::Integer));
    // Behind a name may be a number or a date; only one of them is written as a number.
    let is_bounded = |node| is_number || matches!(of.plain(), DataType::Identifier(_)) && number(node).is_ok();
    let has_length = matches!(of.plain(), DataType::Basic(Basic::String | Basic::Binary) | DataType::Identifier(_));
    let has_elements = matches!(of.plain(), DataType::List(_) | DataType::Identifier(_));
    let mut out = Constraints::default();
    for inner in node.children().filter(Node::is_element) {
        let name = inner.tag_name().name();
        match name {
            "Unit" if is_number || matches!(of.plain(), DataType::Identifier(_)) => out.unit = Some(unit(inner)?),
            "Set" => out.set = children(inner, "Value").map(|v| text(v).to_owned()).collect(),
            "MinimalInclusive" | "MinimalExclusive" if is_bounded(inner) => {
                out.least = Some((number(inner)?, name == "MinimalExclusive"));
            }
            "MaximalInclusive" | "MaximalExclusive" if is_bounded(inner) => {
                out.greatest = Some((number(inner)?, name == "MaximalExclusive"));
            }
            "Length" if has_length => out.length = (Some(size(inner)?), Some(size(inner)?)),
            "MinimalLength" if has_length => out.length.0 = Some(size(inner)?),
            "MaximalLength" if has_length => out.length.1 = Some(size(inner)?),
            "ElementCount" if has_elements => out.count = (Some(size(inner)?), Some(size(inner)?)),
            "MinimalElementCount" if has_elements => out.count.0 = Some(size(inner)?),
            "MaximalElementCount" if has_elements => out.count.1 = Some(size(inner)?),
            "Pattern" if has_length => out.pattern = Some(inner.text().unwrap_or_default().to_owned()),
            "Unit" => return Err(wrong(inner, "only numbers can have a `Unit`")),
            "Length" | "MinimalLength" | "MaximalLength" | "Pattern" => {
                return Err(wrong(inner, format!("only texts can have a `{name}`")));
            }
            "ElementCount" | "MinimalElementCount" | "MaximalElementCount" => {
                return Err(wrong(inner, format!("only lists can have a `{name}`")));
            }
            known if NOT_LOOKED_AT.contains(&known) => {}
            other => return Err(wrong(inner, format!("unknown constraint `{other}`"))),
        }
    }
    if let (Some((least, _)), Some((greatest, _))) = (out.least, out.greatest)
        && least > greatest
    {
        return Err(wrong(node, format!("no value is from {least} to {greatest}")));
    }
    for (least, most) in [out.length, out.count] {
        if let (Some(least), Some(most)) = (least, most)
            && least > most
        {
            return Err(wrong(node, format!("no value has from {least} to {most} parts")));
        }
    }
    Ok(out)
}

fn unit(node: Node<'_, '_>) -> Result<SiUnit, Problem> {
    let factor_at = child(node, "Factor")?;
    let factor = number(factor_at)?;
    if factor == 0.0 {
        return Err(wrong(factor_at, "the factor of a unit must not be 0"));
    }
    let mut components = Vec::new();
    for part in children(node, "UnitComponent") {
        let (base, exponent) = (child(part, "SIUnit")?, child(part, "Exponent")?);
        let index = BASES.iter().position(|b| *b == text(base));
        let index = index.ok_or_else(|| wrong(base, format!("unknown base unit `{}`", text(base))))?;
        let power = text(exponent).parse::<i32>().ok().filter(|e| e.abs() <= 20);
        let power = power.ok_or_else(|| wrong(exponent, "an exponent must be a whole number of at most 20"))?;
        if power != 0 && index != 0 {
            components.push((index, power));
        }
    }
    let offset = number(child(node, "Offset")?)?;
    Ok(SiUnit { label: text(child(node, "Label")?).to_owned(), factor, offset, components })
}
