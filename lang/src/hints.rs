//! Words that people bring from elsewhere, and what is written here instead.

/// What is written in place of a verb that no module has, which may have two words; nothing for a word that may be a slip. `HEATER` and
/// the like stand for a device that has the command of [`STANDS_FOR`].
pub fn of_verb(words: &[&str]) -> Option<&'static str> {
    let first = words.first()?;
    let two = words.get(1).map(|second| format!("{first} {second}"));
    two.and_then(|two| of_words(&two)).or_else(|| of_words(first))
}

/// Words in hints that stand for a device of the lab, each with a command that it has.
pub const STANDS_FOR: &[(&str, &str)] = &[("HEATER", "heat"), ("STIRRER", "stir")];

fn of_words(words: &str) -> Option<&'static str> {
    heat(words)
        .or_else(|| liquids(words))
        .or_else(|| solids(words))
        .or_else(|| hands(words))
        .or_else(|| language(words))
}

/// Heating, cooling, stirring, and switches.
fn heat(words: &str) -> Option<&'static str> {
    Some(match words {
        "cool" | "chill" | "cool down" | "freeze" => {
            "write `stop heating HEATER`, then `wait until VESSEL.contents.temperature <= 30 degC timeout 1 h`: things cool in the air of the lab. Below that only a device of `std::opentrons` with a block that cools, such as `TemperatureModule`, takes them: `heat MODULE to 4 degC`"
        }
        "warm" | "incubate" | "preheat" | "heat up" | "warm up" | "boil" | "thaw" => {
            "write `heat HEATER to 37 degC`, then `wait 30 min`, or `wait until VESSEL.contents.temperature >= 36 degC timeout 1 h`"
        }
        "turn on" | "switch on" => "write `heat HEATER to 60 degC` or `stir STIRRER at 300 rpm`",
        "turn off" | "switch off" | "stop" | "shut" | "shut off" => {
            "write `stop heating HEATER` or `stop stirring STIRRER`"
        }
        "vortex" | "agitate" | "swirl" => {
            "write `shake SHAKER at 500 rpm` or `stir STIRRER at 300 rpm`, then `wait 5 min`"
        }
        "centrifuge" => "write `spin CENTRIFUGE at 3000 rpm using 5 min`",
        _ => return None,
    })
}

/// Moving liquids.
fn liquids(words: &str) -> Option<&'static str> {
    Some(match words {
        "add" | "fill" | "dispense_liquid" | "charge" | "feed" => {
            "the lab declares the initial contents of a vessel: `holding 10 mL of water`; later `transfer` moves liquids with a pipette, `pump` with a pump, `pour` with an arm, and `dose` doses a powder"
        }
        "dilute" => "write `transfer 100 uL from DILUENT to WELLS by PIPETTE using RACK { tips: each }`, then `mix`",
        "aliquot" | "distribute" | "sample" | "collect" => {
            "`transfer` can move liquid from one source to many targets: `transfer 50 uL from A to plate.column(1) ...`; a pump takes a sample with `draw 1 mL from VESSEL by PUMP`"
        }
        "inject" | "infuse" => {
            "write `push 1 mL into VESSEL by PUMP`, or `pump 10 mL at 1 mL/min by PUMP` (`use std::pumps`)"
        }
        "withdraw" | "suck" | "remove" | "drain" | "empty" => {
            "liquid is taken with `draw 1 mL from VESSEL by PUMP` or `transfer ... from VESSEL`; a thing with `pick THING by ARM`, then `place THING on PLACE by ARM`"
        }
        "decant" | "separate" => {
            "no verb takes one layer, or leaves a solid behind: `pour` and `transfer` take everything in proportion. Describe it as a `skill` with its effect, or ask a person: `ask \"...\"`"
        }
        "extract" => {
            "no verb separates two liquids; an `equilibrium` with `partition` says how much of a substance goes into the other one"
        }
        "neutralise" | "neutralize" | "acidify" | "basify" => {
            "write `adjust VESSEL to 7 by TITRATOR { ... }` of `std::titration`, or `transfer` the calculated volume"
        }
        "rinse" | "clean" | "flush" => "write `wash VESSEL by BASIN`; pipette tips are changed: `{ tips: each }`",
        "degas" | "purge" | "bubble" => "write `sparge by FRIT`, with a `GlassFrit` of `std::gases`",
        _ => return None,
    })
}

/// Solids, and operations that the library lacks.
fn solids(words: &str) -> Option<&'static str> {
    Some(match words {
        "dissolve" => {
            "a salt dissolves by itself as soon as it meets water: `dose POWDER into VESSEL by DISPENSER`, or declare it in the lab: `holding 100 mL of water + 1 g of NaCl`; `stir STIRRER at 300 rpm` stirs"
        }
        "precipitate" | "crystallise" | "crystallize" | "recrystallise" | "recrystallize" => {
            "a solid comes out by itself where an equilibrium says so: `use std::crystals` or `use std::solids`, then let it cool, and `wait`"
        }
        "filter" | "filtrate" | "evaporate" | "concentrate" | "distill" | "distil" | "reflux" | "sonicate"
        | "grind" | "crush" | "mill" | "sublime" | "lyophilise" | "lyophilize" | "chromatograph" | "elute"
        | "evacuate" | "irradiate" | "illuminate" | "absorb" | "electrolyse" | "electrolyze" => {
            "the library has no verb and no model for this: describe it as a `skill` with its effect, or ask a person: `ask \"...\"`"
        }
        _ => return None,
    })
}

/// Handling things.
fn hands(words: &str) -> Option<&'static str> {
    Some(match words {
        "pickup" | "pick_up" | "pick_up_tip" | "grab" | "grip" | "take" => {
            "a pipette takes a tip with `pick up tip from RACK by PIPETTE`; an arm takes a thing with `pick THING by ARM`"
        }
        "put" | "bring" | "carry" | "lay" | "load" | "put in" | "put on" => {
            "write `place THING on PLACE by ARM`; a tube or vial goes into a rack with `insert TUBE into RACK[A1] by ARM`"
        }
        "put down" => "write `place THING on PLACE by ARM`, or `put back THING by ARM` for the place where it stood",
        "drop_tip" => "write `drop tip by PIPETTE`",
        "discard" | "throw" | "throw away" | "bin" => "write `dispose THING into BIN`, or `drop tip by PIPETTE`",
        "seal" | "cover" => "write `cap VIAL` for a vial, `close lid DEVICE` for a device, or place a lid on a plate",
        "unseal" | "uncover" => "write `uncap VIAL` for a vial, `open lid DEVICE` for a device",
        _ => return None,
    })
}

/// What a word of the language says, and measuring.
fn language(words: &str) -> Option<&'static str> {
    Some(match words {
        "pause" | "sleep" | "delay" => "write `wait 10 s`; `ask \"...\"` waits for a person",
        "print" | "log" | "comment" | "label" | "mark" => {
            "write `note \"...\"`, with values in braces: `note \"{plate.temperature as degC :.1}\"`"
        }
        "monitor" | "observe" | "watch" | "track" => "write `record VESSEL.contents.temperature every 10 s`",
        "measure" => {
            "use a reading as a value: `let t = PLATE.temperature`; `weigh` puts a thing on a balance and reads it"
        }
        "loop" | "while" => {
            "write `repeat 3 times { }`, `repeat while CONDITION max 9 { }` or `for well in plate.wells { }`"
        }
        _ => return None,
    })
}

/// What is written in place of a function that there is not.
pub fn of_function(word: &str) -> Option<&'static str> {
    Some(match word {
        "range" => {
            "write `repeat 3 times { }`; `for` loops over a list: `for v in [10 uL, 20 uL]`, `for well in plate.wells`"
        }
        "len" | "length" | "size" => "write `LIST.count`",
        "print" => "write `note \"...\"`",
        "log" => "write `ln(x)` or `log10(x)`",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_words_are_looked_up_before_one() {
        assert!(of_verb(&["turn", "off", "plate"]).is_some_and(|hint| hint.contains("stop heating")));
        assert!(of_verb(&["turn"]).is_none());
        assert!(of_verb(&["put", "cup"]).is_some_and(|hint| hint.contains("place")));
    }

    #[test]
    fn what_may_be_a_slip_has_no_hint() {
        for word in ["heet", "trnasfer", "plcae", "wiat"] {
            assert_eq!(of_verb(&[word]), None, "{word}");
        }
    }
}
