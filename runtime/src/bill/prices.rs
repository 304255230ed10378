//! A list of prices, and what a bill comes to by it.

use super::{Bill, CostLine, Costs};

/// A price.
#[derive(Clone, Debug, PartialEq)]
pub struct Price {
    /// Name of a species, solution or type.
    pub item: String,
    /// For `quantity` of `unit`.
    pub price: f64,
    /// Its currency.
    pub currency: String,
    /// More than 0.
    pub quantity: f64,
    /// `mg`, `g`, `kg`, `mL`, `L`, `piece` or `pack`.
    pub unit: String,
}

/// A list of prices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prices(Vec<Price>);

/// The columns of a list of prices.
const COLUMNS: [&str; 5] = ["item", "price", "currency", "quantity", "unit"];

/// Units of a price with their size in g, mL, pieces or packs.
const UNITS: [(&str, Measure, f64); 7] = [
    ("mg", Measure::Mass, 1e-3),
    ("g", Measure::Mass, 1.0),
    ("kg", Measure::Mass, 1e3),
    ("mL", Measure::Volume, 1.0),
    ("L", Measure::Volume, 1e3),
    ("piece", Measure::Piece, 1.0),
    ("pack", Measure::Pack, 1.0),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Measure {
    Mass,
    Volume,
    Piece,
    Pack,
}

impl Prices {
    /// Reads a CSV table with the columns `item,price,currency,quantity,unit`; an error says which line is wrong and why.
    pub fn read(text: &str) -> Result<Prices, String> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| e.to_string())?.clone();
        if header.iter().ne(COLUMNS) {
            return Err(format!("the first line must be `{}`", COLUMNS.join(",")));
        }
        let mut all: Vec<Price> = Vec::new();
        for (i, record) in reader.records().enumerate() {
            let line = i + 2;
            let record = record.map_err(|e| format!("line {line}: {e}"))?;
            let cell = |at: usize| record.get(at).unwrap_or_default();
            let number = |at: usize| {
                let value = cell(at).parse::<f64>().ok().filter(|v| v.is_finite() && *v >= 0.0);
                value.ok_or_else(|| format!("line {line}: `{}` is not a valid {}", cell(at), COLUMNS[at]))
            };
            let (item, unit) = (cell(0).to_owned(), cell(4).to_owned());
            if !UNITS.iter().any(|u| u.0 == unit) {
                let known: Vec<&str> = UNITS.iter().map(|u| u.0).collect();
                return Err(format!("line {line}: `{unit}` is not one of {}", known.join(", ")));
            }
            if all.iter().any(|p| p.item == item) {
                return Err(format!("line {line}: `{item}` has a price already"));
            }
            let (price, quantity) = (number(1)?, number(3)?);
            if quantity == 0.0 {
                return Err(format!("line {line}: a price is for more than 0 {unit}"));
            }
            all.push(Price { item, price, currency: cell(2).to_owned(), quantity, unit });
        }
        Ok(Prices(all))
    }

    /// What all runs of a bill cost: what is weighed in (or a solution bought as such), consumables and, where they have a
    /// price, vessels and labware.
    pub fn costs(&self, bill: &Bill) -> Costs {
        let mut costs = Costs { lines: Vec::new(), totals: Vec::new(), without_price: Vec::new() };
        let mut bought = Vec::new();
        for r in &bill.reagents {
            let made = bill.weigh_in.iter().any(|w| w.within.first() == Some(&r.name));
            if made && self.find(&r.name).is_some() {
                bought.push(&r.name);
                self.add(&mut costs, &r.name, &[(Measure::Mass, r.mass_all)]);
            }
        }
        let mut substances: Vec<(&str, f64, Option<f64>)> = Vec::new();
        for w in bill.weigh_in.iter().filter(|w| !w.within.first().is_some_and(|s| bought.contains(&s))) {
            let volume = w.volume.map(|v| v * bill.runs as f64);
            match substances.iter_mut().find(|s| s.0 == w.name) {
                Some(line) => {
                    line.1 += w.mass_all;
                    line.2 = line.2.zip(volume).map(|(a, b)| a + b);
                }
                None => substances.push((&w.name, w.mass_all, volume)),
            }
        }
        for (name, mass, volume) in substances {
            let mut known = vec![(Measure::Mass, mass)];
            known.extend(volume.map(|v| (Measure::Volume, v)));
            self.add(&mut costs, name, &known);
        }
        for c in &bill.consumables {
            let item = if self.find(&c.kind).is_some() { &c.kind } else { &c.from_kind };
            self.add(&mut costs, item, &[(Measure::Piece, c.used_all as f64), (Measure::Pack, c.packs_all as f64)]);
        }
        for l in bill.labware.iter().filter(|l| self.find(&l.kind).is_some()) {
            self.add(&mut costs, &l.kind, &[(Measure::Piece, bill.runs as f64)]);
        }
        costs
    }

    fn find(&self, item: &str) -> Option<&Price> {
        self.0.iter().find(|p| p.item == item)
    }

    /// Adds what an item costs, measured in one of the ways known.
    fn add(&self, costs: &mut Costs, item: &str, known: &[(Measure, f64)]) {
        let found = self.find(item).and_then(|price| {
            let (_, measure, size) = UNITS.iter().find(|u| u.0 == price.unit)?;
            let (_, there) = known.iter().find(|k| k.0 == *measure)?;
            Some((price, there / size))
        });
        let Some((price, quantity)) = found else {
            costs.without_price.push(item.to_owned());
            return;
        };
        let (sum, currency) = (quantity / price.quantity * price.price, price.currency.clone());
        match costs.totals.iter_mut().find(|t| t.0 == currency) {
            Some(total) => total.1 += sum,
            None => costs.totals.push((currency.clone(), sum)),
        }
        costs.lines.push(CostLine { item: item.to_owned(), quantity, per: price.unit.clone(), price: sum, currency });
    }
}

#[cfg(test)]
mod tests {
    use super::Prices;

    #[test]
    fn a_list_that_cannot_be_read_says_where() {
        let head = "item,price,currency,quantity,unit\n";
        for (text, wanted) in [
            ("name,price\n", "the first line must be `item,price,currency,quantity,unit`"),
            ("water,dear,EUR,1,L\n", "line 2: `dear` is not a valid price"),
            ("water,1,EUR,0,L\n", "line 2: a price is for more than 0 L"),
            ("water,1,EUR,1,bottle\n", "line 2: `bottle` is not one of mg, g, kg, mL, L, piece, pack"),
            ("water,1,EUR,1,L\nwater,2,EUR,1,L\n", "line 3: `water` has a price already"),
        ] {
            let text = if text.starts_with("name") { text.to_owned() } else { format!("{head}{text}") };
            assert_eq!(Prices::read(&text), Err(wanted.to_owned()));
        }
    }
}
