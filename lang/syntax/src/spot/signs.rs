//! Mistaken signs: pasted ones, those of other languages, and the wrong one of two.

use super::{Mistake, RESERVED, Rule, Spot, is_word};

/// Signs that are typed or pasted instead of the plain ones.
pub(super) fn lookalike(spot: &Spot) -> Option<Mistake> {
    const SIGNS: &[(char, &str)] = &[
        ('≥', ">="),
        ('≤', "<="),
        ('≠', "!="),
        ('×', "*"),
        ('·', "*"),
        ('⋅', "*"),
        ('−', "-"),
        ('–', "-"),
        ('—', "-"),
        ('±', "+-"),
        ('→', "->"),
        ('⟶', "->"),
        ('⇌', "<->"),
        ('↔', "<->"),
        ('⇄', "<->"),
        ('÷', "/"),
        ('“', "\""),
        ('”', "\""),
        ('„', "\""),
        ('º', "°"),
        ('˚', "°"),
        ('′', "'"),
        ('’', "'"),
        ('‘', "'"),
        ('…', ".."),
        ('\u{a0}', " "),
        ('\u{202f}', " "),
        ('\u{2009}', " "),
        ('：', ":"),
        ('；', ";"),
    ];
    let first = spot.token.chars().next()?;
    let (sign, plain) = SIGNS.iter().find(|(sign, _)| *sign == first)?;
    let end = spot.at + sign.len_utf8();
    let headline = match *plain {
        " " => "this is a special blank character".to_owned(),
        "\"" => format!("`{sign}` is not a plain quote"),
        _ => format!("the language has no sign `{sign}`"),
    };
    Some(Mistake::new(headline, format!("write `{plain}`")).fix(format!("write `{plain}`"), spot.at, end, *plain))
}

pub(super) fn control(spot: &Spot) -> Option<Mistake> {
    let first = spot.token.chars().next().filter(|c| c.is_control() || *c == '\u{feff}' || *c == '\u{fffd}')?;
    let headline = format!("the file contains a control character (U+{:04X})", u32::from(first));
    Some(Mistake::new(headline, "here"))
}

pub(super) fn comment(spot: &Spot) -> Option<Mistake> {
    let sign = ["#", "/*", "--", "%"].into_iter().find(|sign| spot.after.starts_with(sign))?;
    if sign == "--" && !spot.is_at_start() {
        return None;
    }
    let mistake = Mistake::new(format!("`{sign}` does not start a comment"), "start a comment with `//`");
    Some(mistake.fix("write `//`", spot.at, spot.at + sign.len(), "//"))
}

pub(super) fn quotes(spot: &Spot) -> Option<Mistake> {
    let inner = spot.after.strip_prefix('\'')?;
    let end = inner.find('\'')?;
    let text = inner.get(..end)?;
    let mistake = Mistake::new("a text needs double quotes", format!("write `\"{text}\"`"));
    Some(mistake.fix("use double quotes", spot.at, spot.at + end + 2, format!("\"{text}\"")))
}

/// `x not in a .. b` and `x is not open`: what is negated stands in brackets behind `not`.
pub(super) fn negated(spot: &Spot) -> Option<Mistake> {
    if spot.token != "not" || spot.is_at_start() {
        return None;
    }
    let rest = spot.after.strip_prefix("not")?.trim_start();
    let (left, right) = match spot.before.strip_suffix(" is") {
        Some(left) => (left.trim_end(), format!("is {rest}")),
        None if rest.starts_with("in ") => (spot.before, rest.to_owned()),
        None => return None,
    };
    // From the last blank outside of brackets to the end of the condition.
    let mut depth = 0;
    let start = left.char_indices().rev().find(|(_, c)| {
        depth += i32::from(matches!(c, ')' | ']')) - i32::from(matches!(c, '(' | '['));
        depth < 0 || depth == 0 && c.is_whitespace()
    });
    let start = start.map_or(0, |(at, c)| at + c.len_utf8());
    let ends = [" and ", " or ", " {", " timeout ", " else ", " for ", " max ", ")", ";", "//"];
    let end = ends.iter().filter_map(|end| right.find(end)).min().unwrap_or(right.len());
    let negated = format!("not ({} {})", left.get(start..)?, right[..end].trim_end());
    let stop = spot.at + spot.after.len() - (right.len() - right[..end].trim_end().len());
    let mistake = Mistake::new("`not` stands before the condition", format!("write `{negated}`"));
    Some(mistake.help(format!("write `{negated}`")).guess(
        format!("write `{negated}`"),
        spot.start + start,
        stop,
        negated,
    ))
}

/// Operators of other languages.
pub(super) fn operator(spot: &Spot) -> Option<Mistake> {
    const SIGNS: &[(&str, &str)] = &[
        ("&&", "and"),
        ("||", "or"),
        ("<>", "!="),
        ("=<", "<="),
        ("=>", ">="),
        ("===", "=="),
        ("**", "^"),
        ("!", "not "),
        (":=", "="),
        ("++", "+= 1"),
    ];
    if matches!(spot.form(), "reaction" | "equilibrium" | "interaction") {
        return None;
    }
    // The first sign of two may have been read as an operator of its own.
    let tight = spot.start + spot.before.len() == spot.at;
    let (start, signs) = match spot.before.char_indices().next_back() {
        Some((at, '<' | ':')) if tight => (spot.start + at, format!("{}{}", &spot.before[at..], spot.after)),
        _ => (spot.at, spot.after.to_owned()),
    };
    let (sign, ours) = SIGNS.iter().find(|(sign, _)| signs.starts_with(sign) && !signs.starts_with("!="))?;
    let ours_word = ours.trim_end();
    let mistake = Mistake::new(format!("`{sign}` is not an operator of the language"), format!("write `{ours_word}`"));
    Some(mistake.fix(format!("write `{ours_word}`"), start, start + sign.len(), *ours))
}

pub(super) fn reaction_arrow(spot: &Spot) -> Option<Mistake> {
    let form = spot.form();
    if spot.only != Rule::only_item || !matches!(form, "reaction" | "equilibrium") || !spot.before.contains(':') {
        return None;
    }
    if form == "equilibrium" {
        return both_ways(spot);
    }
    const SIGNS: &[(&str, &str)] = &[
        ("<=>", "<->"),
        ("<==>", "<->"),
        ("<-->", "<->"),
        ("==>", "->"),
        ("-->", "->"),
        ("=>", "->"),
        ("==", "->"),
        ("=", "->"),
        (">", "->"),
    ];
    let (sign, ours) = SIGNS.iter().find(|(sign, _)| spot.after.starts_with(sign))?;
    let mistake = Mistake::new(format!("write a reaction with `{ours}`"), format!("write `{ours}`"));
    let (title, end) = (format!("write `{ours}`"), spot.at + sign.len());
    // An equals sign may stand for either arrow.
    Some(match sign.starts_with("=") && !sign.ends_with('>') {
        true => mistake.guess(title, spot.at, end, *ours),
        false => mistake.fix(title, spot.at, end, *ours),
    })
}

/// `=` for `==` in a condition, `==` for `=` in a definition.
pub(super) fn equals(spot: &Spot) -> Option<Mistake> {
    let condition = match spot.only {
        Rule::only_stmt => ["expect", "if", "wait", "repeat", "hold", "keep"].contains(&spot.form()),
        Rule::only_clause => ["needs", "presumes", "warns", "while", "until"].contains(&spot.form()),
        Rule::only_item => ["process", "event"].contains(&spot.form()),
        Rule::only_law | Rule::only_member => ["if", "process", "event"].contains(&spot.form()),
        _ => false,
    };
    let end = spot.at + spot.token.len();
    match spot.token {
        "=" if condition => {
            let mistake = Mistake::new("`=` defines a value; `==` compares", "write `==` in a condition");
            Some(mistake.fix("write `==`", spot.at, end, "=="))
        }
        "==" if !condition && spot.expects("`=`") => {
            let mistake = Mistake::new("`==` compares; `=` defines a value", "write `=` in a definition");
            Some(mistake.fix("write `=`", spot.at, end, "="))
        }
        _ => None,
    }
}

/// `x = 3` as a step.
pub(super) fn assignment(spot: &Spot) -> Option<Mistake> {
    if spot.only != Rule::only_stmt
        || !["=", "<-"].contains(&spot.token)
        || !is_word(spot.before)
        || RESERVED.contains(&spot.before)
    {
        return None;
    }
    let (name, sign) = (spot.before, spot.token);
    let mistake = Mistake::new(format!("a step cannot change `{name}`"), "use `let` for a new value");
    Some(mistake.guess(format!("write `let {name} {sign} ...`"), spot.start, spot.start, "let "))
}

/// An equilibrium goes both ways, however that is written.
fn both_ways(spot: &Spot) -> Option<Mistake> {
    const SIGNS: &[&str] = &["<==>", "<-->", "<=>", "==>", "-->", "->", "=>", "==", "="];
    let sign = SIGNS.iter().find(|sign| spot.after.starts_with(**sign))?;
    let mistake = Mistake::new("write an equilibrium with `<->`".to_owned(), "write `<->`".to_owned());
    Some(mistake.fix("write `<->`".to_owned(), spot.at, spot.at + sign.len(), "<->"))
}
