//! What a lab offers, as features: one for each device and capability.

use matterix_ir::Unit;
use matterix_ir::offer::{Bound, Bounds, Failure, Kind, Offer, Offers, Shown};
use matterix_ir::scene::{InstanceId, Scene};
use matterix_sila::Feature;
use matterix_sila::feature::{BASES, Basic, Command, Constraints, DataType, Element, Named, Property, SiUnit};
use matterix_sila::words::identifier;
use matterix_sila_wire::spaced;

/// Who defines the features.
const ORIGINATOR: &str = "org.matterixc";

/// Symbols of the base units, as [`BASES`] has them.
const SYMBOLS: [&str; 8] = ["", "m", "kg", "s", "A", "K", "mol", "cd"];

/// Longest identifier of the standard, letters.
const LONGEST: usize = 255;

/// A unit of plain angles, which the standard counts as nothing.
const ANGLE: &str = "rad";

/// Features with what stands behind each of their commands and properties.
pub struct Catalogue<'p> {
    /// As they are offered.
    pub features: Vec<Feature>,
    /// By feature and command.
    pub commands: Vec<Vec<&'p Offer>>,
    /// By feature and property.
    pub properties: Vec<Vec<&'p Shown>>,
}

/// The features of a lab for these of its commands and quantities; `texts` has the comments of their declarations.
///
/// Fails where two would have one identifier, or one would be longer than the standard allows: who calls them goes by it.
pub fn catalogue<'p>(
    scene: &'p Scene,
    texts: &Offers,
    offers: Vec<&'p Offer>,
    shown: Vec<&'p Shown>,
) -> Result<Catalogue<'p>, String> {
    let mut out = Catalogue { features: Vec::new(), commands: Vec::new(), properties: Vec::new() };
    let mut places: Vec<(Option<InstanceId>, &str)> = Vec::new();
    let of_offers = offers.iter().map(|o| (o.device, o.capability.as_str()));
    for place in of_offers.chain(shown.iter().map(|s| (Some(s.device), s.capability.as_str()))) {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places.sort_by_key(|(device, _)| *device);
    let category: String = scene.lab.to_lowercase().chars().filter(char::is_ascii_lowercase).collect();
    let category = if category.is_empty() { "lab".to_owned() } else { category };
    for (device, capability) in places {
        let (name, display, description) = match device.map(|d| &scene.get(d).name) {
            Some(name) => (
                format!("{name} {capability}"),
                format!("{name}: {capability}"),
                joined(&[
                    &format!("`{name}` of the lab `{}` as a {capability}.", scene.lab),
                    texts.docs(device, capability),
                    texts.docs(device, ""),
                ]),
            ),
            None => (
                format!("{} skills", scene.lab),
                "Skills".to_owned(),
                format!("Skills of the lab `{}` that use several of its things.", scene.lab),
            ),
        };
        let called = identifier(&name);
        if called.len() > LONGEST {
            return Err(format!("the name of `{display}` would have {} letters; {LONGEST} are allowed", called.len()));
        }
        if let Some(other) = out.features.iter().find(|f| f.identifier.eq_ignore_ascii_case(&called)) {
            return Err(format!(
                "`{}` and `{display}` would both have the name `{called}`: rename one of the things",
                other.display
            ));
        }
        let mut feature = Feature {
            identifier: called,
            display,
            description,
            originator: ORIGINATOR.to_owned(),
            category: category.clone(),
            version: (1, 0),
            ..Feature::default()
        };
        let is_here = |d: Option<InstanceId>, c: &str| d == device && c == capability;
        let commands: Vec<&Offer> = offers.iter().copied().filter(|o| is_here(o.device, &o.capability)).collect();
        for offer in &commands {
            let command = command(scene, offer, &feature);
            for error in offer.fails.iter().map(defined) {
                match feature.errors.iter_mut().find(|e| e.identifier == error.identifier) {
                    Some(known) if known.description.len() >= error.description.len() => {}
                    Some(known) => known.description = error.description,
                    None => feature.errors.push(error),
                }
            }
            feature.commands.push(command);
        }
        let properties: Vec<&Shown> =
            shown.iter().copied().filter(|s| is_here(Some(s.device), &s.capability)).collect();
        for shown in &properties {
            let taken = |n: &str| {
                feature.properties.iter().any(|p| p.identifier == n)
                    || feature.commands.iter().any(|c| c.identifier == n)
            };
            let identifier = unique(identifier(&shown.name), taken);
            feature.properties.push(Property {
                display: spaced(&identifier),
                identifier,
                description: said(&shown.docs, &format!("`{}`.", shown.name), &shown.kind),
                observable: true,
                ty: data_type(scene, &shown.kind, Bounds::default()),
                errors: Vec::new(),
            });
        }
        out.features.push(feature);
        out.commands.push(commands);
        out.properties.push(properties);
    }
    Ok(out)
}

fn command(scene: &Scene, offer: &Offer, feature: &Feature) -> Command {
    let name = unique(identifier(&offer.verb), |n| feature.commands.iter().any(|c| c.identifier == n));
    let mut parameters: Vec<Element> = Vec::new();
    for parameter in &offer.parameters {
        let identifier = unique(identifier(&parameter.name), |n| parameters.iter().any(|p| p.identifier == n));
        parameters.push(Element {
            display: spaced(&identifier),
            identifier,
            description: said("", &format!("`{}: {}`.", parameter.name, parameter.declared), &parameter.kind),
            ty: data_type(scene, &parameter.kind, parameter.bounds),
        });
    }
    Command {
        display: spaced(&name),
        identifier: name,
        description: said(&offer.docs, &format!("`{}`.", offer.verb), &Kind::Truth),
        observable: offer.lasts,
        parameters,
        responses: offer.result.iter().map(|kind| result(scene, kind)).collect(),
        intermediate: Vec::new(),
        errors: offer.fails.iter().map(|f| error_name(&f.name)).collect(),
    }
}

/// What stands in a declaration, or else this; with the unit where the type cannot say it.
fn said(docs: &str, otherwise: &str, kind: &Kind) -> String {
    let text = if docs.is_empty() { otherwise } else { docs };
    match kind {
        Kind::Quantity { unit, bases } if si_unit(unit, bases.as_deref()).is_none() && !unit.symbol.is_empty() => {
            format!("{text} In {}.", unit.symbol)
        }
        _ => text.to_owned(),
    }
}

/// The failure of a need that names none.
const NEED: &str = "need";

/// The response of a command that returns a number.
fn result(scene: &Scene, kind: &Kind) -> Element {
    Element {
        identifier: RESULT.to_owned(),
        display: RESULT.to_owned(),
        description: said("", "The number that it returns.", kind),
        ty: data_type(scene, kind, Bounds::default()),
    }
}

/// The only response of a command.
const RESULT: &str = "Result";

/// The identifier of the defined error for a failure.
pub(super) fn error_name(failure: &str) -> String {
    match failure {
        NEED => "NeedUnmet".to_owned(),
        other => identifier(other),
    }
}

/// A failure as a defined error.
fn defined(failure: &Failure) -> Named {
    let identifier = error_name(&failure.name);
    let what = match failure.name.as_str() {
        NEED => "A need of the command is not met.".to_owned(),
        other => format!("The failure `{other}`."),
    };
    let help = failure.help.as_ref().map_or(String::new(), |help| format!("To fix it: {help}."));
    Named { display: spaced(&identifier), identifier, description: joined(&[&what, &help]) }
}

/// Sentences in a row.
fn joined(texts: &[&str]) -> String {
    let texts: Vec<&str> = texts.iter().copied().filter(|t| !t.is_empty()).collect();
    texts.join(" ")
}

/// A name that is not taken: with a number at its end where it would be.
fn unique(name: String, taken: impl Fn(&str) -> bool) -> String {
    if !taken(&name) {
        return name;
    }
    (2..).map(|n| format!("{name}{n}")).find(|n| !taken(n)).unwrap_or(name)
}

fn data_type(scene: &Scene, kind: &Kind, bounds: Bounds) -> DataType {
    let constrained = |basic: Basic, constraints: Constraints| match constraints == Constraints::default() {
        true => DataType::Basic(basic),
        false => DataType::Constrained(Box::new(DataType::Basic(basic)), Box::new(constraints)),
    };
    let among = |set: Vec<String>| constrained(Basic::String, Constraints { set, ..Constraints::default() });
    match kind {
        Kind::Quantity { unit, bases } => {
            let end = |bound: Option<Bound>| bound.map(|b| (rounded(unit.of_si(b.number)), b.is_open));
            let (least, greatest) = (end(bounds.least), end(bounds.greatest));
            let unit = si_unit(unit, bases.as_deref());
            constrained(Basic::Real, Constraints { unit, least, greatest, ..Constraints::default() })
        }
        Kind::Whole => {
            let end = |bound: Option<Bound>| bound.map(|b| (b.number, b.is_open));
            let (least, greatest) = (end(bounds.least), end(bounds.greatest));
            constrained(Basic::Integer, Constraints { least, greatest, ..Constraints::default() })
        }
        Kind::Truth => DataType::Basic(Basic::Boolean),
        Kind::Words(words) => among(words.clone()),
        Kind::Things(things) => among(things.iter().map(|t| scene.get(*t).name.clone()).collect()),
    }
}

/// A number as people write it, where it is that but for the last digits, which come from the conversion of units.
fn rounded(number: f64) -> f64 {
    let short: f64 = format!("{number:.11e}").parse().unwrap_or(number);
    if (short - number).abs() <= 8.0 * f64::EPSILON * number.abs() { short } else { number }
}

/// A unit as the standard has it; nothing where it has no such thing.
fn si_unit(unit: &Unit, bases: Option<&[(String, i32)]>) -> Option<SiUnit> {
    let bases = bases.filter(|b| !b.is_empty())?;
    let known = bases.iter().filter(|(symbol, _)| symbol != ANGLE);
    let component = |(symbol, exponent): &(String, i32)| Some((SYMBOLS.iter().position(|s| s == symbol)?, *exponent));
    let components = known.map(component).collect::<Option<Vec<_>>>()?;
    debug_assert_eq!(SYMBOLS.len(), BASES.len());
    Some(SiUnit { label: unit.symbol.clone(), factor: unit.factor, offset: unit.offset, components })
}
