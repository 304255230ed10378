//! A feature as the standard defines it: what a server can be told, what it tells, what can go wrong.

/// A feature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feature {
    /// `HotplateStirrer`.
    pub identifier: String,
    /// For people.
    pub display: String,
    /// For people.
    pub description: String,
    /// `org.example`.
    pub originator: String,
    /// `none` where the text names none.
    pub category: String,
    /// Of the feature: major and minor.
    pub version: (u32, u32),
    /// What it can be told.
    pub commands: Vec<Command>,
    /// What it tells.
    pub properties: Vec<Property>,
    /// What goes beside calls.
    pub metadata: Vec<Metadata>,
    /// What can go wrong.
    pub errors: Vec<Named>,
    /// Types with a name of their own.
    pub types: Vec<Element>,
}

impl Feature {
    /// `org.example/hotplate/HotplateStirrer/v1`.
    pub fn id(&self) -> String {
        format!("{}/{}/{}/v{}", self.originator, self.category, self.identifier, self.version.0)
    }

    /// The service of gRPC: `sila2.org.example.hotplate.hotplatestirrer.v1.HotplateStirrer`.
    pub fn service(&self) -> String {
        let Feature { originator, category, identifier, version, .. } = self;
        format!("sila2.{originator}.{category}.{}.v{}.{identifier}", identifier.to_lowercase(), version.0)
    }

    /// A command.
    pub fn command(&self, identifier: &str) -> Option<&Command> {
        self.commands.iter().find(|c| c.identifier == identifier)
    }

    /// A property.
    pub fn property(&self, identifier: &str) -> Option<&Property> {
        self.properties.iter().find(|p| p.identifier == identifier)
    }

    /// What a name of this feature stands for; other types stand for themselves.
    pub fn resolved<'f>(&'f self, ty: &'f DataType) -> Option<&'f DataType> {
        match ty {
            DataType::Identifier(name) => Some(&self.types.iter().find(|t| t.identifier == *name)?.ty),
            other => Some(other),
        }
    }
}

/// A name with what it says to people.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Named {
    /// `SensorFailed`.
    pub identifier: String,
    /// For people.
    pub display: String,
    /// For people.
    pub description: String,
}

/// A value with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// `Target`.
    pub identifier: String,
    /// For people.
    pub display: String,
    /// For people.
    pub description: String,
    /// What values it takes.
    pub ty: DataType,
}

/// What goes beside calls.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Its name and type.
    pub element: Element,
    /// The errors that a call may end with because of it, by identifier.
    pub errors: Vec<String>,
}

/// What a server can be told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Command {
    /// `SetTargetTemperature`.
    pub identifier: String,
    /// For people.
    pub display: String,
    /// For people.
    pub description: String,
    /// Whether it lasts, and can be followed while it does.
    pub observable: bool,
    /// What it is given.
    pub parameters: Vec<Element>,
    /// What it answers in the end.
    pub responses: Vec<Element>,
    /// What it tells while it lasts.
    pub intermediate: Vec<Element>,
    /// Identifiers of what can go wrong.
    pub errors: Vec<String>,
}

/// What a server tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Property {
    /// `CurrentTemperature`.
    pub identifier: String,
    /// For people.
    pub display: String,
    /// For people.
    pub description: String,
    /// Whether it can be subscribed to.
    pub observable: bool,
    /// What values it has.
    pub ty: DataType,
    /// Identifiers of what can go wrong.
    pub errors: Vec<String>,
}

/// What values there are.
#[derive(Clone, Debug, PartialEq)]
pub enum DataType {
    /// One of the standard's.
    Basic(Basic),
    /// Several of one type.
    List(Box<DataType>),
    /// One of each.
    Structure(Vec<Element>),
    /// Not all of a type.
    Constrained(Box<DataType>, Box<Constraints>),
    /// By its name in the feature.
    Identifier(String),
}

impl DataType {
    /// The type without what constrains it.
    pub fn plain(&self) -> &DataType {
        match self {
            DataType::Constrained(inner, _) => inner.plain(),
            other => other,
        }
    }

    /// What constrains it.
    pub fn constraints(&self) -> Option<&Constraints> {
        match self {
            DataType::Constrained(_, constraints) => Some(constraints),
            _ => None,
        }
    }
}

/// The types of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basic {
    /// A text.
    String,
    /// A whole number of 64 bits.
    Integer,
    /// A number.
    Real,
    /// A truth value.
    Boolean,
    /// Bytes.
    Binary,
    /// A day.
    Date,
    /// A time of day.
    Time,
    /// A day and a time of day.
    Timestamp,
    /// A value with its type.
    Any,
}

impl Basic {
    /// All, as they are written.
    pub const ALL: [(&'static str, Basic); 9] = [
        ("String", Basic::String),
        ("Integer", Basic::Integer),
        ("Real", Basic::Real),
        ("Boolean", Basic::Boolean),
        ("Binary", Basic::Binary),
        ("Date", Basic::Date),
        ("Time", Basic::Time),
        ("Timestamp", Basic::Timestamp),
        ("Any", Basic::Any),
    ];

    /// As it is written.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, b)| *b == self).map_or("", |(name, _)| name)
    }
}

/// What constrains a type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constraints {
    /// What a number is counted in.
    pub unit: Option<SiUnit>,
    /// All values there are, as written.
    pub set: Vec<String>,
    /// The least, and whether it is itself left out.
    pub least: Option<(f64, bool)>,
    /// The greatest, and whether it is itself left out.
    pub greatest: Option<(f64, bool)>,
    /// Fewest and most characters of a text.
    pub length: (Option<u64>, Option<u64>),
    /// A regular expression that the whole of a text matches.
    pub pattern: Option<String>,
    /// Fewest and most elements of a list.
    pub count: (Option<u64>, Option<u64>),
}

impl Constraints {
    /// These, and where they say nothing those of the type inside; of two bounds the narrower one holds.
    pub fn over(&self, inner: &Constraints) -> Constraints {
        let pick = |a: Option<(f64, bool)>, b: Option<(f64, bool)>, lower: bool| match (a, b) {
            (Some(a), Some(b)) if a.0 == b.0 => Some((a.0, a.1 || b.1)),
            (Some(a), Some(b)) => Some(if (a.0 > b.0) == lower { a } else { b }),
            (a, b) => a.or(b),
        };
        let size = |a: (Option<u64>, Option<u64>), b: (Option<u64>, Option<u64>)| {
            (a.0.max(b.0), [a.1, b.1].into_iter().flatten().min())
        };
        let set = match (self.set.is_empty(), inner.set.is_empty()) {
            (false, false) => self.set.iter().filter(|v| inner.set.contains(v)).cloned().collect(),
            (true, _) => inner.set.clone(),
            (_, true) => self.set.clone(),
        };
        Constraints {
            unit: self.unit.clone().or_else(|| inner.unit.clone()),
            set,
            least: pick(self.least, inner.least, true),
            greatest: pick(self.greatest, inner.greatest, false),
            length: size(self.length, inner.length),
            pattern: self.pattern.clone().or_else(|| inner.pattern.clone()),
            count: size(self.count, inner.count),
        }
    }
}

/// The units of the international system that all others are given by.
pub const BASES: [&str; 8] = ["Dimensionless", "Meter", "Kilogram", "Second", "Ampere", "Kelvin", "Mole", "Candela"];

/// A unit: SI is `number * factor + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct SiUnit {
    /// As shown to people.
    pub label: String,
    /// SI value of one.
    pub factor: f64,
    /// SI value of zero.
    pub offset: f64,
    /// Index in [`BASES`] and exponent.
    pub components: Vec<(usize, i32)>,
}
