//! The bill as it is read in a terminal.

use matterix_ir::model::OUTSIDE;

use super::{Bill, Quantity, ReagentLine, SolidLine};
use crate::record::report::text::{Align, Table, amount, digits, mass};

use Align::{Left, Right};

/// Aligned plain text; parts with nothing in them are left out.
pub fn human(bill: &Bill) -> String {
    let sections = [
        Some(head(bill)),
        reagents(bill),
        stocks(bill),
        weigh_in(bill),
        consumables(bill),
        labware(bill),
        mixtures(bill),
        yields(bill),
        waste(bill),
        devices(bill),
        person(bill),
        costs(bill),
    ];
    sections.into_iter().flatten().collect::<Vec<_>>().join("\n")
}

fn section(title: &str, table: &Table) -> Option<String> {
    Some(format!("{title}\n{}", table.print()))
}

fn head(bill: &Bill) -> String {
    let how = match bill.status.as_str() {
        "passed" => String::new(),
        "missed" => " (an expectation was not met)".to_owned(),
        other => format!(" (the run {other}: the bill ends there)"),
    };
    let mut text = format!("{} in {}: {} a run{how}", bill.workflow, bill.lab, time(bill.duration));
    if bill.runs != 1 {
        text += &format!(", {} for {} runs one after the other", time(bill.duration * bill.runs as f64), bill.runs);
    }
    text.push('\n');
    for (name, value) in &bill.arguments {
        text += &format!("  {name} = {value}\n");
    }
    for (name, runs) in &bill.studies {
        text += &format!("  study {name}: {0} runs; `--runs {0}` gives its bill\n", runs);
    }
    text
}

/// A mass of a reagent in the unit in which the file gives it.
fn shown(line: &ReagentLine, g: f64) -> String {
    // What is left of a subtraction is nothing.
    if g.abs() <= line.mass * 1e-12 {
        return "0".to_owned();
    }
    match &line.amount {
        Some(Quantity { value, unit }) if line.mass > 0.0 && !unit.is_empty() => {
            format!("{} {unit}", digits(value * g / line.mass))
        }
        _ => mass(g),
    }
}

fn reagents(bill: &Bill) -> Option<String> {
    if bill.reagents.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Right, Right, Right, Right, Right, Right, Right, Right, Right]);
    let several = bill.runs != 1;
    let all = if several { format!("for {} runs", bill.runs) } else { String::new() };
    let used = |f: fn(&ReagentLine) -> f64| bill.reagents.iter().any(|r| f(r) > r.mass * 1e-12);
    let device = used(|r| r.in_devices);
    let (waste, dead) = (used(|r| r.in_waste), used(|r| r.dead));
    let head = |on: bool, text: &str| if on { text.to_owned() } else { String::new() };
    table.row([
        String::new(),
        "put in".into(),
        "taken".into(),
        "products".into(),
        "left over".into(),
        head(dead, "of it dead"),
        head(device, "in devices"),
        head(waste, "waste"),
        "least".into(),
        all,
    ]);
    for r in &bill.reagents {
        table.row([
            r.name.clone(),
            shown(r, r.mass),
            shown(r, r.taken),
            shown(r, r.in_products),
            shown(r, r.left_over),
            head(dead, &shown(r, r.dead)),
            head(device, &shown(r, r.in_devices)),
            head(waste, &shown(r, r.in_waste)),
            shown(r, r.least),
            head(several, &shown(r, r.mass_all)),
        ]);
    }
    section("Reagents", &table)
}

fn stocks(bill: &Bill) -> Option<String> {
    if bill.stocks.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right]);
    table.row(["", "holds", "taken", "left over", "of it dead"]);
    for s in &bill.stocks {
        table.row([s.vessel.clone(), s.holds.clone(), mass(s.taken), mass(s.left_over), mass(s.dead)]);
    }
    section("Stocks", &table)
}

fn weigh_in(bill: &Bill) -> Option<String> {
    if bill.weigh_in.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right, Right, Left]);
    let all = if bill.runs != 1 { format!("for {} runs", bill.runs) } else { String::new() };
    table.row(["".to_owned(), "".into(), "mass".into(), "amount".into(), "volume".into(), all, "".into()]);
    for w in &bill.weigh_in {
        let within = if w.within.is_empty() { String::new() } else { format!("for {}", w.within.join(" > ")) };
        table.row([
            w.name.clone(),
            within,
            mass(w.mass),
            w.amount.map(|a| amount(a / 1e3)).unwrap_or_default(),
            w.volume.map(|v| format!("{} mL", digits(v))).unwrap_or_default(),
            if bill.runs != 1 { mass(w.mass_all) } else { String::new() },
            w.hazards.join(", "),
        ]);
    }
    section("To weigh in", &table)
}

fn consumables(bill: &Bill) -> Option<String> {
    if bill.consumables.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Right, Left, Left]);
    for c in &bill.consumables {
        let of = format!("{} of {} ({})", c.kind, c.from_kind, c.from.join(", "));
        let packs = format!("{} of {} each", c.packs_all, c.each_holds);
        let all = if bill.runs == 1 { packs } else { format!("{} for {} runs: {packs}", c.used_all, bill.runs) };
        table.row([c.used.to_string(), of, all]);
    }
    section("Used up", &table)
}

fn labware(bill: &Bill) -> Option<String> {
    if bill.labware.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Left]);
    for l in &bill.labware {
        let places = if l.places == 1 { String::new() } else { format!("{} of {} places", l.places_used, l.places) };
        table.row([l.name.clone(), l.kind.clone(), places]);
    }
    section("Vessels and labware", &table)
}

fn mixtures(bill: &Bill) -> Option<String> {
    if bill.mixtures.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left]);
    for m in &bill.mixtures {
        let property = |(name, Quantity { value, unit }): &(String, Quantity)| {
            let outside = if m.outside.contains(name) { OUTSIDE } else { "" };
            format!("{name} {}{}{unit}{outside}", digits(*value), if unit.is_empty() { "" } else { " " })
        };
        let solid = |s: &SolidLine| format!("{} {}, solid ({})", amount(s.amount / 1e3), s.name, mass(s.mass));
        let said: Vec<String> = m.properties.iter().map(property).chain(m.solids.iter().map(solid)).collect();
        table.row([m.vessel.clone(), said.join("; ")]);
    }
    section("In the vessels at the end, at equilibrium", &table)
}

fn yields(bill: &Bill) -> Option<String> {
    if bill.yields.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right, Left]);
    table.row(["", "", "made", "at most", "", ""]);
    for y in &bill.yields {
        let share = format!("{:.1} %", 100.0 * y.made / y.at_most);
        let scarcest = format!("{} is the scarcest: {} left", y.limiting, amount(y.left / 1e3));
        let [made, at_most] = [y.made, y.at_most].map(|n| amount(n / 1e3));
        table.row([format!("{} in {}", y.product, y.vessel), y.reaction.clone(), made, at_most, share, scarcest]);
    }
    section("Yields", &table)
}

fn waste(bill: &Bill) -> Option<String> {
    if bill.waste.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Right, Left]);
    for w in &bill.waste {
        let of: Vec<String> = w.reagents.iter().map(|(name, g)| format!("{} of {name}", mass(*g))).collect();
        let contents: Vec<String> = w.contents.iter().map(|(name, g)| format!("{} {name}", mass(*g))).collect();
        table.row([w.vessel.clone(), mass(w.mass), format!("from {}", of.join(", "))]);
        table.row([String::new(), String::new(), format!("is {}", contents.join(", "))]);
    }
    section("Waste", &table)
}

fn devices(bill: &Bill) -> Option<String> {
    if bill.devices.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Left, Left, Right, Right, Right, Right]);
    let all = if bill.runs != 1 { format!("for {} runs", bill.runs) } else { String::new() };
    table.row(["".to_owned(), "".into(), "steps".into(), "in use".into(), "running".into(), all]);
    for d in &bill.devices {
        table.row([
            d.name.clone(),
            d.kind.clone(),
            d.steps.to_string(),
            time(d.in_use),
            time(d.running),
            if bill.runs != 1 { time(d.busy_all) } else { String::new() },
        ]);
    }
    section("Devices", &table)
}

fn person(bill: &Bill) -> Option<String> {
    if bill.person.is_empty() {
        return None;
    }
    let mut table = Table::new(&[Right, Left]);
    for p in &bill.person {
        table.row([time(p.time), p.text.clone()]);
    }
    section("A person is asked", &table)
}

fn costs(bill: &Bill) -> Option<String> {
    let costs = bill.costs.as_ref()?;
    let mut table = Table::new(&[Left, Right, Right]);
    for c in &costs.lines {
        table.row([
            c.item.clone(),
            format!("{} {}", digits(c.quantity), c.per),
            format!("{:.2} {}", c.price, c.currency),
        ]);
    }
    for (currency, sum) in &costs.totals {
        table.row(["in all".to_owned(), String::new(), format!("{sum:.2} {currency}")]);
    }
    let mut text = section("Costs", &table)?;
    if !costs.without_price.is_empty() {
        text += &format!("  without a price: {}\n", costs.without_price.join(", "));
    }
    Some(text)
}

/// A time in the unit that suits it.
fn time(s: f64) -> String {
    match s {
        s if s >= 3600.0 => format!("{} h", digits(s / 3600.0)),
        s if s >= 120.0 => format!("{} min", digits(s / 60.0)),
        s => format!("{} s", digits(s)),
    }
}
