//! Mistakes in numbers, units and fields.

use super::{Mistake, RESERVED, Rule, Spot, is_word, last_word};

pub(super) fn decimal_comma(spot: &Spot) -> Option<Mistake> {
    let next = spot.after.strip_prefix(',')?;
    if !spot.before.ends_with(|c: char| c.is_ascii_digit()) || !next.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let mistake = Mistake::new("a number is written with a decimal point", "write `.`");
    Some(mistake.guess("write a point", spot.at, spot.at + 1, "."))
}

/// `.5` and `5.`.
pub(super) fn bare_point(spot: &Spot) -> Option<Mistake> {
    let next = spot.after.strip_prefix('.')?;
    if next.starts_with(|c: char| c.is_ascii_digit()) {
        let mistake = Mistake::new("a number starts with a digit", format!("write `0{}`", spot.token));
        return Some(mistake.fix("add `0`", spot.at, spot.at, "0"));
    }
    let digit = spot.before.ends_with(|c: char| c.is_ascii_digit()) && !next.starts_with('.');
    digit.then(|| {
        let mistake = Mistake::new("a digit is missing after the decimal point", "here");
        mistake.fix("remove the point", spot.at, spot.at + 1, "")
    })
}

/// `20µ L`.
pub(super) fn split_unit(spot: &Spot) -> Option<Mistake> {
    const PREFIXES: [&str; 9] = ["µ", "μ", "u", "m", "k", "n", "p", "c", "d"];
    let unit = spot.before.rsplit(|c: char| c.is_ascii_digit() || c == ' ').next()?;
    let number = spot.before[..spot.before.len() - unit.len()].trim_end();
    if !PREFIXES.contains(&unit)
        || !number.ends_with(|c: char| c.is_ascii_digit())
        || !spot.token.starts_with(char::is_alphabetic)
    {
        return None;
    }
    let gap = spot.start + spot.before.len();
    let whole = format!("{unit}{}", spot.token);
    let mistake = Mistake::new("a unit is one word", format!("write `{whole}`"));
    Some(mistake.fix(format!("write `{whole}`"), gap, spot.at, ""))
}

fn is_field(only: Rule) -> bool {
    matches!(only, Rule::only_field | Rule::only_fill | Rule::only_named | Rule::only_asset_line | Rule::only_lab_line)
}

/// `gain 70 W/K` for `gain: 70 W/K`.
pub(super) fn colon(spot: &Spot) -> Option<Mistake> {
    let member = spot.expects("`:`");
    let name = if member { last_word(spot.before) } else { spot.before };
    if !(is_field(spot.only) || member) || !is_word(name) || spot.token.is_empty() {
        return None;
    }
    let end = spot.start + spot.before.len();
    if spot.token == "=" {
        let mistake = Mistake::new("a field is written with `:`", format!("write `{name}: ...`"));
        return Some(mistake.fix("write `:`", end, spot.at + 1, ":"));
    }
    let value = spot.token.starts_with(|c: char| c.is_alphanumeric() || matches!(c, '"' | '(' | '-'));
    value.then(|| {
        let mistake = Mistake::new(format!("`:` is missing after `{name}`"), format!("write `{name}: {}`", spot.token));
        mistake.fix("add `:`", end, end, ":")
    })
}

/// `ambient = 25 degC` for `ambient: 25 degC`.
pub(super) fn value_with_equals(spot: &Spot) -> Option<Mistake> {
    let name = spot.before.strip_suffix('=')?.trim_end();
    let value = spot.token.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '"' | '(' | '[' | '-'));
    if !is_field(spot.only) || !is_word(name) || !value {
        return None;
    }
    let mistake = Mistake::new("a value is written with `:`", format!("write `{name}: {}`", spot.token))
        .help("`=` stands before the type of a thing: `beaker = Beaker250mL`");
    Some(mistake.fix("write `:`", spot.start + name.len(), spot.start + spot.before.len(), ":"))
}

/// `power: 600 W limits: ...` on one line.
pub(super) fn missing_comma(spot: &Spot) -> Option<Mistake> {
    let rest = spot.after.strip_prefix(spot.token)?.trim_start();
    if !is_field(spot.only) || spot.is_at_start() || !is_word(spot.token) || !rest.starts_with(':') {
        return None;
    }
    let end = spot.start + spot.before.len();
    let mistake = Mistake::new(format!("`,` is missing before `{}`", spot.token), "a new field starts here");
    Some(mistake.fix("add `,`", end, end, ","))
}

/// `10 g water`.
pub(super) fn missing_of(spot: &Spot) -> Option<Mistake> {
    let unit = spot.before.rsplit(' ').next().unwrap_or_default();
    let number = spot.before[..spot.before.len() - unit.len()].trim_end();
    let quantity = number.ends_with(|c: char| c.is_ascii_digit()) && unit.starts_with(char::is_alphabetic);
    if !quantity
        || !is_word(spot.token)
        || RESERVED.contains(&spot.token)
        || !spot.token.starts_with(char::is_alphabetic)
    {
        return None;
    }
    let mistake = Mistake::new(format!("`{}` is not expected after `{unit}`", spot.token), "a unit is one word")
        .help(format!("an amount of something is written with `of`: `1 {unit} of {}`", spot.token));
    Some(mistake)
}
