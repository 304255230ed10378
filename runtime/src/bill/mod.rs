//! What a run uses up and occupies: reagents, consumables, vessels, waste, devices and people.
//!
//! A bill follows a run: [`Follower`] listens to it and keeps for every mixture how much of its mass came from which
//! holding, so that what was brought in is found again, to the last digit, in products, stocks, devices and waste. What
//! counts as used, as waste or as working is said by the library (`counts_as`), never here.

mod build;
mod csv;
mod follow;
mod human;
mod origins;
mod prices;
mod yields;

use serde::Serialize;

pub use csv::csv;
pub use follow::Follower;
pub use human::human;
pub use prices::{Price, Prices};

/// Version of the document; it changes when a field is renamed, removed or changes its meaning.
pub const BILL_SCHEMA: u32 = 1;

/// What a run uses up and occupies. Masses in g, times in s; everything is for one run but the fields that end in `all`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bill {
    /// [`BILL_SCHEMA`].
    pub schema: u32,
    /// Name and version of the program that wrote it.
    pub tool: String,
    /// Name of the workflow.
    pub workflow: String,
    /// Name of the lab.
    pub lab: String,
    /// Parameters of the workflow as bound.
    pub arguments: Vec<(String, String)>,
    /// `passed`, `missed`, `failed`, `cancelled`: how the run ended that was followed.
    pub status: String,
    /// Lab time of one run, s.
    pub duration: f64,
    /// Number of runs that totals are for.
    pub runs: u64,
    /// Studies of the workflow: name and number of runs.
    pub studies: Vec<(String, u64)>,
    /// What was brought in, by species or solution.
    pub reagents: Vec<ReagentLine>,
    /// The vessels it was taken from.
    pub stocks: Vec<StockLine>,
    /// What has to be measured out to make it.
    pub weigh_in: Vec<WeighLine>,
    /// Things used once, such as tips.
    pub consumables: Vec<ConsumableLine>,
    /// Vessels and labware.
    pub labware: Vec<LabwareLine>,
    /// What vessels hold at the end, where equilibria say something of it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mixtures: Vec<MixtureLine>,
    /// What reactions made in vessels, and what they could have made at most.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub yields: Vec<YieldLine>,
    /// What is thrown away.
    pub waste: Vec<WasteLine>,
    /// Devices and how long they are busy.
    pub devices: Vec<DeviceLine>,
    /// What a person does.
    pub person: Vec<PersonLine>,
    /// What it costs, where prices are given.
    pub costs: Option<Costs>,
}

/// A species or solution as it was brought in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReagentLine {
    /// Its name.
    pub name: String,
    /// In the unit of the file, where all of it was given in one.
    pub amount: Option<Quantity>,
    /// g.
    pub mass: f64,
    /// g, for all runs.
    pub mass_all: f64,
    /// Taken from stocks, g.
    pub taken: f64,
    /// In vessels that are neither stocks nor waste at the end, g.
    pub in_products: f64,
    /// In the stocks at the end, g.
    pub left_over: f64,
    /// Of it what cannot be got out of its vessel, g.
    pub dead: f64,
    /// In devices at the end, such as tips and lines, g.
    pub in_devices: f64,
    /// g.
    pub in_waste: f64,
    /// What has to be brought in at least: what was taken and what cannot be got out, or all of it where nothing was taken, g.
    pub least: f64,
}

/// A vessel that only gives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StockLine {
    /// Its name.
    pub vessel: String,
    /// What it held, as written.
    pub holds: String,
    /// g.
    pub held: f64,
    /// g.
    pub taken: f64,
    /// g.
    pub left_over: f64,
    /// Of it what cannot be got out, g.
    pub dead: f64,
}

/// What has to be measured out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WeighLine {
    /// The species.
    pub name: String,
    /// Hill formula; empty for an undefined structure.
    pub formula: String,
    /// The solutions it goes into, as a path from the one that is held; empty where it is held as it is.
    pub within: Vec<String>,
    /// g.
    pub mass: f64,
    /// g, for all runs.
    pub mass_all: f64,
    /// mmol; absent for a species counted by mass.
    pub amount: Option<f64>,
    /// mL of the pure liquid; absent for what is no liquid.
    pub volume: Option<f64>,
    /// Hazards it is known for.
    pub hazards: Vec<String>,
}

/// Things used once, by what they are taken from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConsumableLine {
    /// Type of the thing.
    pub kind: String,
    /// Type of what it is taken from.
    pub from_kind: String,
    /// Names of those.
    pub from: Vec<String>,
    /// How many of it are used.
    pub used: u64,
    /// For all runs.
    pub used_all: u64,
    /// How many one holds when full.
    pub each_holds: u64,
    /// How many of those are begun by all runs.
    pub packs_all: u64,
}

/// A vessel or a piece of labware.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabwareLine {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: String,
    /// How many of its places hold or held something.
    pub places_used: usize,
    /// How many it has.
    pub places: usize,
}

/// A mixture at equilibrium at the end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MixtureLine {
    /// The vessel.
    pub vessel: String,
    /// Its properties by name, such as its volume and pH.
    pub properties: Vec<(String, Quantity)>,
    /// Those of them, by name, that are outside the range of their model.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outside: Vec<String>,
    /// The solids in it.
    pub solids: Vec<SolidLine>,
}

/// A solid beside a solution.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolidLine {
    /// The species.
    pub name: String,
    /// mmol.
    pub amount: f64,
    /// g.
    pub mass: f64,
}

/// What a reaction made of a species in a vessel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct YieldLine {
    /// The vessel.
    pub vessel: String,
    /// The reaction.
    pub reaction: String,
    /// The species that it makes.
    pub product: String,
    /// What is there at the end, mmol.
    pub made: f64,
    /// What would be there if the scarcest reactant were used up, mmol.
    pub at_most: f64,
    /// The scarcest reactant.
    pub limiting: String,
    /// What is left of it, mmol.
    pub left: f64,
}

/// What is thrown away into one vessel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WasteLine {
    /// The vessel.
    pub vessel: String,
    /// g.
    pub mass: f64,
    /// g, for all runs.
    pub mass_all: f64,
    /// What came from where: reagent and mass, g.
    pub reagents: Vec<(String, f64)>,
    /// What it is in the end: species and mass, g.
    pub contents: Vec<(String, f64)>,
}

/// A device and how long it is busy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviceLine {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: String,
    /// How long steps use it, s.
    pub in_use: f64,
    /// How long it works by itself, as a heater that holds its set point, s.
    pub running: f64,
    /// Either of them, s.
    pub busy: f64,
    /// s, for all runs.
    pub busy_all: f64,
    /// How many steps use it.
    pub steps: usize,
}

/// A question to a person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PersonLine {
    /// s.
    pub time: f64,
    /// What is asked.
    pub text: String,
}

/// A number with its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// In the unit.
    pub value: f64,
    /// As the user writes it.
    pub unit: String,
}

/// What all runs cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Costs {
    /// Item, what is counted in words, and price.
    pub lines: Vec<CostLine>,
    /// Sum by currency.
    pub totals: Vec<(String, f64)>,
    /// What has no price.
    pub without_price: Vec<String>,
}

/// What one item costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostLine {
    /// Its name.
    pub item: String,
    /// How much of it, as in the list of prices.
    pub quantity: f64,
    /// The unit of the quantity.
    pub per: String,
    /// Its price.
    pub price: f64,
    /// Currency.
    pub currency: String,
}

impl Bill {
    /// The document with a line end at its end.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}
