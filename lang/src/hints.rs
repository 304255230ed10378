//! Words that people bring from elsewhere, and what is written here instead.

/// What is written in place of a verb that no module has; nothing for a word that may be a slip.
pub fn of_verb(word: &str) -> Option<&'static str> {
    Some(match word {
        "pickup" | "pick_up" | "pick_up_tip" => {
            "a pipette takes a tip with `pick up tip from RACK by PIPETTE`; an arm takes a thing with `pick THING by ARM`"
        }
        "drop_tip" => "write `drop tip by PIPETTE`",
        "cool" | "chill" => {
            "`heat DEVICE to 4 degC` also sets a device that can cool; after `stop heating DEVICE` any other device cools by itself: `wait until VESSEL.contents.temperature <= 30 degC timeout 1 h`"
        }
        "warm" | "incubate" => "write `heat DEVICE to 37 degC`, then `wait 30 min`",
        "add" | "fill" | "dispense_liquid" => {
            "the lab declares the initial contents of a vessel: `holding 10 mL of water`; later `transfer` moves liquids with a pipette, `pump` with a pump, `pour` with an arm, and `dose` doses a powder"
        }
        "dilute" => "write `transfer 100 uL from DILUENT to WELLS by PIPETTE using RACK { tips: each }`, then `mix`",
        "aliquot" | "distribute" => {
            "`transfer` can move liquid from one source to many targets: `transfer 50 uL from A to plate.column(1) ...`"
        }
        "centrifuge" => "write `spin CENTRIFUGE at 3000 rpm using 5 min`",
        "vortex" | "agitate" => "write `shake SHAKER at 500 rpm` or `stir PLATE at 300 rpm`",
        "pause" | "sleep" | "delay" => "write `wait 10 s`; `ask \"...\"` waits for a person",
        "print" | "log" | "comment" => {
            "write `note \"...\"`, with values in braces: `note \"{plate.temperature as degC :.1}\"`"
        }
        "measure" => {
            "use a reading as a value: `let t = PLATE.temperature`; `weigh` puts a thing on a balance and reads it"
        }
        "filter" | "filtrate" | "evaporate" | "distill" | "distil" | "reflux" | "crystallise" | "crystallize"
        | "extract" | "sonicate" => {
            "the library has no verb and no model for this: describe it as a `skill` with its effect, or ask a person: `ask \"...\"`"
        }
        "discard" | "throw" => "write `dispose THING into BIN`, or `drop tip by PIPETTE`",
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

/// What is written in place of going through a range.
pub const OF_RANGE: &str =
    "write `repeat 3 times { }`, a list `[1, 2, 3]`, or wells: `plate.wells`, `plate.column(1)`, `plate[A1 .. A12]`";
