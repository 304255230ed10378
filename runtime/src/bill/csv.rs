//! The bill as a table with one row per number, for spreadsheets.

use matterix_ir::quantity::show_number;

use super::Bill;

/// `section,item,of,measure,value,unit`: what a number is about stands left of it.
pub fn csv(bill: &Bill) -> Result<String, String> {
    let mut table = Rows(csv::Writer::from_writer(Vec::new()));
    table.row("section", "item", "of", "measure", "value", "unit")?;
    table.number("run", &bill.workflow, &bill.lab, "duration", bill.duration, "s")?;
    table.number("run", &bill.workflow, &bill.lab, "runs", bill.runs as f64, "")?;
    for (name, runs) in &bill.studies {
        table.number("study", name, &bill.workflow, "runs", *runs as f64, "")?;
    }
    for r in &bill.reagents {
        if let Some(amount) = &r.amount {
            table.number("reagent", &r.name, "", "amount", amount.value, &amount.unit)?;
        }
        let masses = [
            ("mass", r.mass),
            ("mass_all", r.mass_all),
            ("taken", r.taken),
            ("in_products", r.in_products),
            ("left_over", r.left_over),
            ("dead", r.dead),
            ("in_devices", r.in_devices),
            ("in_waste", r.in_waste),
            ("least", r.least),
        ];
        for (measure, value) in masses {
            table.number("reagent", &r.name, "", measure, value, "g")?;
        }
    }
    for s in &bill.stocks {
        for (measure, value) in [("held", s.held), ("taken", s.taken), ("left_over", s.left_over), ("dead", s.dead)] {
            table.number("stock", &s.vessel, &s.holds, measure, value, "g")?;
        }
    }
    for w in &bill.weigh_in {
        let within = w.within.join(" > ");
        table.number("weigh_in", &w.name, &within, "mass", w.mass, "g")?;
        table.number("weigh_in", &w.name, &within, "mass_all", w.mass_all, "g")?;
        for (measure, value, unit) in [("amount", w.amount, "mmol"), ("volume", w.volume, "mL")] {
            if let Some(value) = value {
                table.number("weigh_in", &w.name, &within, measure, value, unit)?;
            }
        }
    }
    for c in &bill.consumables {
        let numbers = [
            ("used", c.used as f64),
            ("used_all", c.used_all as f64),
            ("each_holds", c.each_holds as f64),
            ("packs_all", c.packs_all as f64),
        ];
        for (measure, value) in numbers {
            table.number("consumable", &c.kind, &c.from_kind, measure, value, "")?;
        }
    }
    for l in &bill.labware {
        table.number("labware", &l.name, &l.kind, "places_used", l.places_used as f64, "")?;
        table.number("labware", &l.name, &l.kind, "places", l.places as f64, "")?;
    }
    for m in &bill.mixtures {
        for (name, of) in &m.properties {
            table.number("mixture", &m.vessel, "", name, of.value, &of.unit)?;
        }
        for solid in &m.solids {
            table.number("mixture", &m.vessel, &solid.name, "solid", solid.amount, "mmol")?;
            table.number("mixture", &m.vessel, &solid.name, "solid_mass", solid.mass, "g")?;
        }
    }
    for y in &bill.yields {
        let of = format!("{} in {}", y.product, y.vessel);
        table.number("yield", &y.reaction, &of, "made", y.made, "mmol")?;
        table.number("yield", &y.reaction, &of, "at_most", y.at_most, "mmol")?;
        table.number("yield", &y.reaction, &y.limiting, "left", y.left, "mmol")?;
    }
    for w in &bill.waste {
        table.number("waste", &w.vessel, "", "mass", w.mass, "g")?;
        table.number("waste", &w.vessel, "", "mass_all", w.mass_all, "g")?;
        for (name, value) in &w.reagents {
            table.number("waste", &w.vessel, name, "reagent", *value, "g")?;
        }
        for (name, value) in &w.contents {
            table.number("waste", &w.vessel, name, "contents", *value, "g")?;
        }
    }
    for d in &bill.devices {
        let times = [("in_use", d.in_use), ("running", d.running), ("busy", d.busy), ("busy_all", d.busy_all)];
        for (measure, value) in times {
            table.number("device", &d.name, &d.kind, measure, value, "s")?;
        }
        table.number("device", &d.name, &d.kind, "steps", d.steps as f64, "")?;
    }
    for p in &bill.person {
        table.number("person", &p.text, "", "time", p.time, "s")?;
    }
    for c in bill.costs.iter().flat_map(|c| &c.lines) {
        table.number("cost", &c.item, &c.per, "price", c.price, &c.currency)?;
    }
    for (currency, sum) in bill.costs.iter().flat_map(|c| &c.totals) {
        table.number("cost", "in all", "", "price", *sum, currency)?;
    }
    let bytes = table.0.into_inner().map_err(|e| e.to_string())?;
    String::from_utf8(bytes).map_err(|e| e.to_string())
}

struct Rows(csv::Writer<Vec<u8>>);

impl Rows {
    fn row(
        &mut self,
        section: &str,
        item: &str,
        of: &str,
        measure: &str,
        value: &str,
        unit: &str,
    ) -> Result<(), String> {
        self.0.write_record([section, item, of, measure, value, unit]).map_err(|e| e.to_string())
    }

    fn number(
        &mut self,
        section: &str,
        item: &str,
        of: &str,
        measure: &str,
        value: f64,
        unit: &str,
    ) -> Result<(), String> {
        self.row(section, item, of, measure, &show_number(value), unit)
    }
}
