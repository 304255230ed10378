//! Mistakes in numbers, units and fields.

use super::{Mistake, RESERVED, Rule, Spot, first_word, is_word, last_word};

pub(super) fn decimal_comma(spot: &Spot) -> Option<Mistake> {
    let next = spot.after.strip_prefix(',')?;
    if !spot.before.ends_with(|c: char| c.is_ascii_digit()) || !next.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let mistake = Mistake::new("write a number with a decimal point", "write `.`");
    Some(mistake.guess("write a point", spot.at, spot.at + 1, "."))
}

/// `mol^0.5`.
pub(super) fn fractional_power(spot: &Spot) -> Option<Mistake> {
    let digits = spot.after.strip_prefix('.')?;
    let base = spot.before.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('-').strip_suffix('^')?;
    let of_unit = base.ends_with(|c: char| c.is_alphabetic() || matches!(c, '%' | '°'));
    (of_unit && spot.is_tight() && digits.starts_with(|c: char| c.is_ascii_digit())).then(|| {
        Mistake::new("the powers in a unit must be whole numbers", "not a whole number")
            .help("write a root as a separate factor: `1e-3 1/s * sqrt(1 mol/kg)`")
    })
}

/// `.5` and `5.`.
pub(super) fn bare_point(spot: &Spot) -> Option<Mistake> {
    let next = spot.after.strip_prefix('.')?;
    if next.starts_with(|c: char| c.is_ascii_digit()) {
        let mistake = Mistake::new("a number must start with a digit", format!("write `0{}`", spot.token));
        return Some(mistake.fix("add `0`", spot.at, spot.at, "0"));
    }
    let number = spot.is_tight() && last_word(spot.before).starts_with(|c: char| c.is_ascii_digit());
    (number && !next.starts_with('.')).then(|| {
        let mistake = Mistake::new("a digit is missing after the decimal point", "here");
        mistake.fix("remove the point", spot.at, spot.at + 1, "")
    })
}

/// `plate[A1 . H1]`.
pub(super) fn range(spot: &Spot) -> Option<Mistake> {
    let next = spot.after.strip_prefix('.')?;
    let last = last_word(spot.before);
    let ends = last.ends_with(|c: char| c.is_ascii_digit()) && next.trim_start().starts_with(char::is_alphanumeric);
    if spot.is_tight() || !ends || next.starts_with('.') {
        return None;
    }
    let mistake = Mistake::new("write a range with `..`", format!("write `{last} ..`"));
    // Between wells nothing else is meant; between numbers it may be a decimal point.
    Some(match last.starts_with(|c: char| c.is_ascii_digit()) {
        true => mistake.guess("write `..`", spot.at, spot.at + 1, ".."),
        false => mistake.fix("write `..`", spot.at, spot.at + 1, ".."),
    })
}

/// `20µ L`.
pub(super) fn split_unit(spot: &Spot) -> Option<Mistake> {
    const PREFIXES: [&str; 9] = ["µ", "μ", "u", "m", "k", "n", "p", "c", "d"];
    let unit = spot.before.rsplit(|c: char| c.is_ascii_digit() || c == ' ').next()?;
    let number = spot.before[..spot.before.len() - unit.len()].trim_end();
    // What follows is no longer than a unit is.
    let short = spot.token.chars().count() <= 3 && !RESERVED.contains(&spot.token);
    if !PREFIXES.contains(&unit)
        || !short
        || !number.ends_with(|c: char| c.is_ascii_digit())
        || !spot.token.starts_with(char::is_alphabetic)
    {
        return None;
    }
    let gap = spot.start + spot.before.len();
    let whole = format!("{unit}{}", spot.token);
    let mistake = Mistake::new("write a unit as one word", format!("write `{whole}`"));
    let title = format!("write `{whole}`");
    // The metre and the day are units by themselves.
    Some(match unit {
        "m" | "d" => mistake.guess(title, gap, spot.at, ""),
        _ => mistake.fix(title, gap, spot.at, ""),
    })
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
    if spot.token == "=" && spot.only == Rule::only_lab_line && RESERVED.contains(&name) {
        let headline = format!("`{name}` is a word of the language and cannot be a name");
        return Some(Mistake::new(headline, "choose another name").at(spot.start, end));
    }
    if spot.token == "=" {
        let mistake = Mistake::new("write a field with `:`", format!("write `{name}: ...`"));
        // `=` before a type declares a thing: the brace above may not have been closed.
        let thing = spot.after[1..].trim_start().starts_with(char::is_uppercase);
        return Some(match thing {
            true => mistake.guess("write `:`", end, spot.at + 1, ":"),
            false => mistake.fix("write `:`", end, spot.at + 1, ":"),
        });
    }
    let value = spot.token.starts_with(|c: char| c.is_alphanumeric() || matches!(c, '"' | '(' | '-'));
    let fits =
        spot.only != Rule::only_lab_line || !RESERVED.contains(&name) && spot.reads(&format!("{name}: {}", spot.after));
    (value && fits).then(|| {
        let mistake = Mistake::new(format!("`:` is missing after `{name}`"), format!("write `{name}: {}`", spot.token));
        mistake.fix("add `:`", end, end, ":")
    })
}

/// `cup Beaker100mL on plate` and `cup: Beaker100mL on plate` for `cup = Beaker100mL on plate`.
pub(super) fn instance(spot: &Spot) -> Option<Mistake> {
    if spot.only != Rule::only_lab_line {
        return None;
    }
    let name = first_word(spot.before);
    let sign = spot.before.get(name.len()..)?.trim_start();
    let end = spot.start + name.len();
    let (headline, from, rest) = match sign.strip_prefix(':') {
        Some(ty) => {
            let colon = spot.start + spot.before.len() - sign.len();
            let blank = if colon == end { " " } else { "" };
            let headline = format!("`{name}` is a thing: declare it with `=`");
            (headline, (colon, colon + 1, format!("{blank}=")), format!("{} {}", ty.trim_start(), spot.after))
        }
        None if sign.is_empty() => {
            (format!("`=` is missing after `{name}`"), (end, end, " =".into()), spot.after.into())
        }
        None => return None,
    };
    let ty = first_word(&rest);
    if !is_word(name) || RESERVED.contains(&name) || !ty.starts_with(char::is_uppercase) {
        return None;
    }
    let (start, stop, text) = from;
    let mistake = Mistake::new(headline, format!("write `{name} = {ty}`"));
    let mistake = if start == stop { mistake } else { mistake.at(start, stop) };
    Some(match spot.reads(&format!("{name} = {rest}")) {
        true => mistake.fix(if start == stop { "add `=`" } else { "write `=`" }, start, stop, text),
        false => mistake.guess(if start == stop { "add `=`" } else { "write `=`" }, start, stop, text),
    })
}

/// `Beaker100mL at (0, 0, 0) m` without a name, and a step, as lines of a lab.
pub(super) fn lab_line(spot: &Spot) -> Option<Mistake> {
    let (first, line) = (spot.form(), format!("{} {}", spot.before, spot.after));
    if spot.only != Rule::only_lab_line || !is_word(first) || spot.before != first || RESERVED.contains(&first) {
        return None;
    }
    if first.starts_with(char::is_uppercase) && spot.reads(&format!("x = {line}")) {
        let mistake = Mistake::new(format!("this `{first}` has no name"), "a name is missing");
        return Some(mistake.at(spot.start, spot.start + first.len()).help(format!("write `name = {first} ...`")));
    }
    crate::is_step(&line).then(|| {
        let mistake = Mistake::new("a step belongs in a workflow, not in a lab", "this reads as a step");
        mistake.at(spot.start, spot.start + first.len())
    })
}

/// `ambient = 25 degC` for `ambient: 25 degC`.
pub(super) fn value_with_equals(spot: &Spot) -> Option<Mistake> {
    let name = spot.before.strip_suffix('=')?.trim_end();
    let value = spot.token.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '"' | '(' | '[' | '-'));
    if !is_field(spot.only) || !is_word(name) || !value {
        return None;
    }
    let mistake = Mistake::new("write a value with `:`", format!("write `{name}: {}`", spot.token))
        .help("use `=` before the type of a thing: `beaker = Beaker250mL`");
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

/// `10 g water` and `60 deg C`.
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
    let (token, last) = (spot.token, last_word(number));
    let headline = format!("`{token}` is not expected after `{unit}`");
    let mistake = Mistake::new(headline, "write a unit as one word");
    if matches!(unit, "deg" | "degree" | "degrees") && matches!(token, "C" | "F") {
        let start = spot.start + spot.before.len() - unit.len();
        return Some(mistake.fix(format!("write `deg{token}`"), start, spot.end, format!("deg{token}")));
    }
    let mistake = mistake.help(format!("write an amount of a substance with `of`: `{last} {unit} of {token}`"));
    // Elsewhere another word may be missing: `transfer 50 uL stock to vial`.
    Some(match spot.only {
        Rule::only_lab_line | Rule::only_fill => mistake.fix("add `of`", spot.at, spot.at, "of "),
        _ => mistake,
    })
}
