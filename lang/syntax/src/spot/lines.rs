//! Lines that start wrongly, stand in the wrong place or go on too long.

use super::{ITEM_WORDS, Mistake, RESERVED, Rule, STEP_WORDS, Spot, either, first_word, is_word, last_word};

/// `heat(plate, 80 degC)` as a step.
pub(super) fn function_call(spot: &Spot) -> Option<Mistake> {
    let verb = first_word(spot.after);
    if spot.only != Rule::only_stmt || !spot.is_at_start() || !is_word(verb) {
        return None;
    }
    let rest = spot.after.get(verb.len()..)?;
    let (headline, help) = match rest.chars().next()? {
        '(' => ("a step has no brackets", "write for example `heat plate to 80 degC`"),
        '.' | '[' | ':' => ("a step must start with a verb", "write for example `heat plate to 80 degC`"),
        _ => return None,
    };
    Some(Mistake::new(headline, "this reads as a value").help(help))
}

/// `stir plate at 300 rpm for 5 min`: a step that sets something going ends at once.
pub(super) fn lasting(spot: &Spot) -> Option<Mistake> {
    if spot.only != Rule::only_stmt || spot.token != "for" || spot.is_at_start() || RESERVED.contains(&spot.form()) {
        return None;
    }
    let time = spot.after.strip_prefix("for")?.split([';', '{', '}']).next()?.split("//").next()?.trim();
    if !time.starts_with(|c: char| c.is_ascii_digit()) || !crate::is_step(&format!("wait {time}")) {
        return None;
    }
    let mistake = Mistake::new(format!("`{}` has no duration", spot.form()), "`for` is not expected here");
    Some(mistake.help(format!("write `wait {time}` as the next step; a device goes on until a step stops it")))
}

/// `needs cond because "..."`: only a failure with a name is explained.
pub(super) fn because(spot: &Spot) -> Option<Mistake> {
    let asks = matches!(spot.form(), "needs" | "presumes" | "warns" | "keeps" | "ends");
    if spot.only == Rule::only_stmt || spot.token != "because" || !asks {
        return None;
    }
    let mistake = Mistake::new("`because` needs the name of a failure before it", "no failure is named");
    Some(mistake.help("name the failure: `else not_enough because \"...\"`"))
}

/// `command heat { effect ... }`: what follows a verb stands below it.
pub(super) fn braced_clauses(spot: &Spot) -> Option<Mistake> {
    if spot.form() != "command" || spot.token != "{" {
        return None;
    }
    let mistake = Mistake::new("a command has no block", "its clauses go below it, without braces");
    Some(mistake.help("write each of `says`, `needs`, `effect` and `takes` on its own line below"))
}

/// `state open: Bool = false` in an asset: what its kind has stands in a capability.
pub(super) fn of_a_capability(spot: &Spot) -> Option<Mistake> {
    let word = spot.form();
    if spot.only != Rule::only_asset_line
        || !["state", "param", "derived", "reading", "command", "event"].contains(&word)
    {
        return None;
    }
    let mistake = Mistake::new(format!("`{word}` belongs in a capability, not in an asset"), "not a line of an asset");
    let help = "declare it in a capability, `capability Opens: Body { ... }`, and give the asset this capability: `asset Valve: Opens { ... }`";
    Some(mistake.help(help).at(spot.start, spot.start + word.len()))
}

pub(super) fn reserved(spot: &Spot) -> Option<Mistake> {
    let names = spot
        .expected
        .iter()
        .any(|r| matches!(r, Rule::ident | Rule::path | Rule::param | Rule::bare_word | Rule::verb));
    if !RESERVED.contains(&spot.token) || !names || spot.is_at_start() || spot.only == Rule::only_wire {
        return None;
    }
    let word = spot.token;
    Some(Mistake::new(format!("`{word}` is a word of the language and cannot be a name"), "choose another name"))
}

/// The nearest of some words, if it is near.
fn nearest<'w>(word: &str, words: &[&'w str]) -> Option<&'w str> {
    let near = words.iter().map(|w| (strsim::damerau_levenshtein(word, w), *w)).min()?;
    (near.0 <= 1 + word.len() / 5).then_some(near.1)
}

/// The word that starts a step and is near to another one, where the line can be read with it.
pub(crate) fn meant_step(word: &str, rest: &str) -> Option<&'static str> {
    // What follows the brace is on other lines.
    let block = if rest.trim_end().ends_with('{') { " note \"\" }" } else { "" };
    let reads = |meant: &str| crate::is_step(&format!("{meant}{rest}{block}"));
    STEP_WORDS.iter().copied().find(|meant| is_slip(word, meant) && reads(meant))
}

/// Whether a word is another one with a slip: letters that changed places, one too few or too many, capitals; in a short word another
/// letter makes another word, as `stop` and `step` are two.
fn is_slip(word: &str, meant: &str) -> bool {
    let turned = || strsim::levenshtein(word, meant) == 2;
    match strsim::damerau_levenshtein(word, meant) {
        _ if word.eq_ignore_ascii_case(meant) => true,
        1 => word.len() != meant.len() || word.len() >= 6 || turned(),
        2 => word.len() >= 8,
        _ => false,
    }
}

/// `repaet 3 times {`: a word of the language with a slip in it, where the line can be read without the slip.
pub(super) fn misspelt_step(spot: &Spot) -> Option<Mistake> {
    let word = spot.form();
    if spot.only != Rule::only_stmt || spot.is_at_start() || RESERVED.contains(&word) {
        return None;
    }
    let meant = meant_step(word, &format!("{} {}", spot.before.get(word.len()..)?, spot.after))?;
    let (from, to) = (spot.start, spot.start + word.len());
    let mistake = Mistake::new(format!("`{word}` does not start a step"), format!("did you mean `{meant}`?"));
    Some(mistake.guess(format!("write `{meant}`"), from, to, meant).at(from, to))
}

/// Words that other languages use.
const FOREIGN: &[(&str, &str)] = &[
    ("import", "use"),
    ("include", "use"),
    ("def", "fn"),
    ("function", "fn"),
    ("func", "fn"),
    ("protocol", "workflow"),
    ("procedure", "workflow"),
    ("class", "asset"),
    ("device", "asset"),
    ("compound", "species"),
    ("reagent", "species"),
];

pub(super) fn unknown_item(spot: &Spot) -> Option<Mistake> {
    if spot.only != Rule::only_item || !spot.is_at_start() {
        return None;
    }
    let word = first_word(spot.token);
    if word.is_empty() || ITEM_WORDS.contains(&word) {
        let found = spot.token;
        return Some(Mistake::new(
            format!("`{found}` is not expected between declarations"),
            "not the start of a declaration",
        ));
    }
    let foreign = FOREIGN.iter().find(|(other, _)| *other == word).map(|(_, ours)| *ours);
    Some(unknown(spot, word, foreign.or_else(|| nearest(word, ITEM_WORDS)), "declaration", ITEM_WORDS))
}

fn unknown(spot: &Spot, word: &str, meant: Option<&str>, what: &str, words: &[&str]) -> Mistake {
    let headline = format!("`{word}` does not start a {what}");
    match meant {
        Some(meant) => Mistake::new(headline, format!("did you mean `{meant}`?")).guess(
            format!("write `{meant}`"),
            spot.at,
            spot.at + word.len(),
            meant,
        ),
        None => {
            let list: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
            Mistake::new(headline, "not known here")
                .help(format!("a {what} starts with {}", either(&list.iter().map(String::as_str).collect::<Vec<_>>())))
        }
    }
}

/// The first word of a line in a body whose lines start with fixed words.
pub(super) fn unknown_line(spot: &Spot) -> Option<Mistake> {
    let (what, words): (&str, &[&str]) = match spot.only {
        Rule::only_member => (
            "member",
            &[
                "param",
                "state",
                "derived",
                "reading",
                "flow",
                "extensive",
                "part",
                "view",
                "command",
                "process",
                "event",
                "frame",
            ],
        ),
        Rule::only_study_line => ("line of a study", &["vary", "runs", "report"]),
        Rule::only_fit_line => ("line of a fit", &["data", "estimate", "match"]),
        _ => return None,
    };
    let word = first_word(spot.token);
    if !spot.is_at_start() || word.is_empty() || words.contains(&word) {
        return None;
    }
    Some(unknown(spot, word, nearest(word, words), what, words))
}

/// A word that belongs to something above it.
pub(super) fn out_of_place(spot: &Spot) -> Option<Mistake> {
    if !spot.is_at_start() || spot.only != Rule::only_stmt {
        return None;
    }
    let word = spot.token;
    let (headline, help) = match word {
        "else" => ("`else` has no `if` or `try`", "write it right after the `}` of an `if` or a `try`"),
        "while" => ("`while` does not start a step", "write `repeat while CONDITION max N { }`"),
        "on" => (
            "`on` has no block before it",
            "write it right after the `}` of a `step`, `sequence`, `parallel`, `try`, `keep` or `within`",
        ),
        "takes" | "needs" | "presumes" | "warns" | "effect" | "says" | "option" | "fails" => (
            "a clause of a skill must come before its block",
            "write it on a line between the signature of the skill and its `{`; a primitive, `extern skill`, has no block",
        ),
        "finally" => ("`finally` has no block before it", "write it right after the `}` of a block"),
        "timeout" => {
            ("`timeout` has no wait before it", "write it after `wait until CONDITION` or `hold CONDITION for TIME`")
        }
        word if ITEM_WORDS.contains(&word) => {
            ("a declaration cannot be inside a workflow or skill", "close the block above it first")
        }
        _ => return None,
    };
    Some(Mistake::new(headline, "here").help(help))
}

/// Something complete, and then more on the same line.
pub(super) fn second_form(spot: &Spot) -> Option<Mistake> {
    let words = spot.words();
    let complete = words.is_empty() || words.contains(&"the end of the line");
    if spot.is_at_start() || !complete || spot.token.is_empty() {
        return None;
    }
    let found = spot.token;
    let last = last_word(spot.before);
    let mistake = Mistake::new(format!("`{found}` is not expected after `{last}`"), "the line is correct up to here");
    Some(match spot.only {
        Rule::only_stmt if found.starts_with(char::is_alphabetic) => mistake.help("write each step on its own line"),
        _ => mistake,
    })
}

/// A line that ends where a value must follow.
pub(super) fn missing_value(spot: &Spot) -> Option<Mistake> {
    if !spot.token.is_empty() || spot.is_at_start() {
        return None;
    }
    let words = spot.words();
    if words.is_empty() {
        return None;
    }
    let last = last_word(spot.before);
    Some(Mistake::new(format!("{} is missing after `{last}`", either(&words)), "the line ends here"))
}
