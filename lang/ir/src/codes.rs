//! The registry of diagnostic codes. Each has a page in `docs/codes/`, whose examples run as tests.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A kind of finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Stable name, as in `error[unit-mismatch]`.
    pub name: &'static str,
    /// The family of checks it belongs to (`U1`, `K2`), or `P0` for parsing, `N0` for names, `X0` for runs,
    /// `W0` for files that are written for other programs.
    pub family: &'static str,
    /// One line for the index.
    pub summary: &'static str,
    /// Markdown page: what it means, an example with the fault, the same example mended.
    pub page: &'static str,
}

impl Serialize for Code {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl<'de> Deserialize<'de> for Code {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        find(&name).ok_or_else(|| de::Error::custom(format_args!("unknown code `{name}`")))
    }
}

macro_rules! codes {
    ($($id:ident $name:literal $family:literal $summary:literal;)*) => {
        $(
            #[doc = $summary]
            pub const $id: Code = Code {
                name: $name,
                family: $family,
                summary: $summary,
                page: include_str!(concat!("../../../docs/codes/", $name, ".md")),
            };
        )*
        /// Every registered code.
        pub const ALL: &[Code] = &[$($id),*];
    };
}

codes! {
    SYNTAX "syntax" "P0" "the text does not follow the grammar here";
    HIDDEN_CHARACTER "hidden-character" "P0" "a hidden character changes how the text is displayed";
    BUDGET_SPENT "budget-spent" "P0" "a text needs more work than a check may do";
    UNSUPPORTED "unsupported" "P0" "the construct is part of the language but not supported yet";
    UNKNOWN_MODULE "unknown-module" "N0" "an imported module does not exist";
    MESH_FILE "mesh-file" "N0" "a mesh cannot be read";
    LABWARE_FILE "labware-file" "N0" "a labware definition cannot be read";
    SILA_FILE "sila-file" "N0" "a definition of a SiLA 2 feature cannot be read or used in full";
    URDF_FILE "urdf-file" "N0" "a robot description cannot be read";
    UNKNOWN_NAME "unknown-name" "N0" "a name is not declared";
    UNKNOWN_UNIT "unknown-unit" "N0" "a unit is not declared";
    UNKNOWN_MEMBER "unknown-member" "N0" "an instance, species or reaction has no such member";
    UNKNOWN_FIELD "unknown-field" "N0" "the owner has no such field";
    DERIVED_MEMBER "derived-member" "N0" "a field sets a value that follows from other members";
    UNKNOWN_VERB "unknown-verb" "N0" "no skill or command has this name";
    UNKNOWN_PARAMETER "unknown-parameter" "N0" "a workflow has no such parameter";
    DUPLICATE_NAME "duplicate-name" "N0" "a name is declared twice";
    AMBIGUOUS_NAME "ambiguous-name" "N0" "a name has several meanings here";
    WRONG_KIND "wrong-kind" "N0" "a name is of another kind than needed";
    CIRCULAR "circular" "N0" "a declaration depends on itself";
    NO_WORKFLOW "no-workflow" "N0" "it is not clear which workflow to run";
    MISSING_FIELD "missing-field" "N0" "a required field is missing";
    MISSING_PROPERTY "missing-property" "N0" "a species lacks a property that a law needs";
    UNBOUND_EXTERN "unbound-extern" "N0" "an external function that the compiler does not have";
    WRONG_ARGUMENTS "wrong-arguments" "N0" "the arguments do not fit the call";
    WRONG_DEVICE "wrong-device" "N0" "a command for a device that cannot carry it out";
    TYPE_MISMATCH "type-mismatch" "N0" "a value of another type than expected";
    TABLE_FILE "table-file" "N0" "a table cannot be read, or a row or cell of it";
    UNDECIDED_CHANGE "undecided-change" "N0" "a `var` changes where only the run decides";
    CANNOT_VARY "cannot-vary" "N0" "a study or fit varies something that is fixed";
    DATA_FILE "data-file" "N0" "the data of a fit cannot be read";
    UNBOUND_ROLE "unbound-role" "N0" "the thing for a role, or the lab, is ambiguous or missing";
    MISPLACED "misplaced" "N0" "a statement that is not allowed at its place";
    EMPTY_RANGE "empty-range" "N0" "the lower end of a range is above its upper end";
    OUT_OF_REACH "out-of-reach" "G1" "a robot cannot reach its target";
    MISSES_MOUTH "misses-mouth" "G1" "an arm pours into a mouth that is too narrow";
    SPILLED "spilled" "G1" "a vessel in a gripper tilts so far that it spills";
    COLLISION "collision" "G2" "a robot or its load collides with something";
    OVERLAP "overlap" "G2" "two things of a lab occupy the same space";
    MISPLACED_GRIP "misplaced-grip" "G4" "a gripper is not at the right place to grip or release";
    OUT_OF_RANGE "out-of-range" "D1" "a parameter outside its range";
    INVALID_LAW "invalid-law" "N0" "a law changes something that it may not change";
    UNIT_MISMATCH "unit-mismatch" "U1" "quantities of different dimensions are mixed";
    TEMPERATURE_POINT "temperature-point" "U2" "a temperature and a difference of temperatures are confused";
    CONCENTRATION_KIND "concentration-kind" "U3" "kinds of concentration are mixed, or none is chosen";
    RATE_UNIT "rate-unit" "U4" "the unit of a rate constant does not fit the order";
    LABEL_MISMATCH "label-mismatch" "U5" "a label contradicts its recipe";
    INVALID_RECIPE "invalid-recipe" "U5" "a recipe does not add up";
    REACTION_NEVER_STARTS "reaction-never-starts" "K1" "a reaction whose reactants never meet";
    NEVER_MADE "never-made" "K3" "a step waits for or expects a substance that is never made";
    UNBALANCED "unbalanced" "K2" "atoms or charge differ between the sides of an equation";
    EQUILIBRIUM_FORM "equilibrium-form" "K2" "the equation of an equilibrium does not fit its constant";
    REACTION_AT_EQUILIBRIUM "reaction-at-equilibrium" "K2" "equilibria of the file already do the work of a reaction";
    INTERACTION_FORM "interaction-form" "K2" "an interaction has species that are not dissolved, or parameters for other charges";
    EQUILIBRIA_CONTRADICT "equilibria-contradict" "K2" "the constants of a circle of equilibria contradict each other";
    FORMULA_INVALID "formula-invalid" "K2" "a formula, structure or molar mass is wrong";
    TEMPLATE_MISMATCH "template-mismatch" "K2" "a template does not give the declared products";
    INCOMPATIBLE_MIX "incompatible-mix" "H1" "incompatible substances are mixed";
    MATERIAL_ATTACKED "material-attacked" "M1" "the contents attack the wall of their vessel";
    HAZARD "hazard" "H2" "a condition that a library or file declares a hazard becomes true";
    ABOVE_BOILING_POINT "above-boiling-point" "H2" "a set point above the boiling point of the contents";
    CLOSED_VESSEL_HEATED "closed-vessel-heated" "H2" "a closed vessel is heated";
    ABOVE_FLASH_POINT "above-flash-point" "H2" "a set point that brings a liquid to its flash point";
    WEAK_ACID_LEFT_OUT "weak-acid-left-out" "H3" "a pH is used, and the model leaves out a weak acid there";
    ACID_BESIDE_BASE "acid-beside-base" "H3" "H+ and OH- are used side by side, and no reaction consumes both";
    RATE_BESIDE_WEAK_ACID "rate-beside-weak-acid" "H3" "a reaction goes by H+ or OH-, and the model leaves out a weak acid or base there";
    BEGINS_BOILING "begins-boiling" "H2" "contents begin above their boiling point";
    BEGINS_FROZEN "begins-frozen" "H3" "contents begin below their melting point";
    WEAK_BASE_LEFT_OUT "weak-base-left-out" "H3" "a pH is used, and the model leaves out a weak base there";
    PH_OF_STRONG_SOLUTION "ph-of-strong-solution" "H3" "a pH is used where activities are far from concentrations";
    UNDISSOLVED "undissolved" "H3" "a mixture holds more of a salt than dissolves";
    SECOND_PHASE "second-phase" "H3" "water holds more of an organic liquid or solid than dissolves";
    GAS_STAYS "gas-stays" "H3" "a gas would escape that the model keeps dissolved";
    GAS_LEAVES "gas-leaves" "H3" "a mixture holds more of a gas than stays dissolved";
    GAS_BUBBLES_OFF "gas-bubbles-off" "H3" "an open vessel holds gases above the pressure of the air";
    PH_OUT_OF_WINDOW "ph-out-of-window" "D1" "the pH of a vessel leaves its given window";
    HEAT_BEYOND_SATURATION "heat-beyond-saturation" "H3" "the temperature of a mixture with too little water for its salts is used";
    PH_FAR_FROM_25_DEGC "ph-far-from-25-degc" "H3" "the pH of a warm or cold solution is used";
    HEAT_OF_STRONG_SOLUTION "heat-of-strong-solution" "H3" "the temperature of a concentrated solution with unknown heat capacity is used";
    VOLUME_OF_STRONG_SOLUTION "volume-of-strong-solution" "H3" "a strong solution with unknown density is measured out by volume";
    HEAT_LEFT_OUT "heat-left-out" "H3" "a temperature is used after a step whose heat the model ignores";
    BOILING_BY_MIXING "boiling-by-mixing" "H3" "a mixture would boil by the heat of mixing";
    HOT_MIXING "hot-mixing" "H3" "dissolving, diluting or neutralising makes a mixture hot";
    WATER_INTO_ACID "water-into-acid" "H3" "water is poured into a strong acid, which gets hot";
    WELLS_STAY_COLD "wells-stay-cold" "H3" "a heater warms labware whose wells do not heat up in the model";
    NEED_UNMET "need-unmet" "P1" "a step cannot start because one of its needs is not met";
    VOLUME_OVERFLOW "volume-overflow" "V1" "a vessel would overflow";
    VOLUME_UNDERFLOW "volume-underflow" "V2" "a step removes more from a vessel than it holds";
    WRONG_TIP "wrong-tip" "T1" "a tip that does not fit the pipette";
    DEAD_BRANCH "dead-branch" "F2" "a part of the workflow never runs: constants decide a branch, it follows a `fail`, or no step raises the failure of a handler";
    JOB_NOT_BEGUN "job-not-begun" "F2" "`await` for a job that has not started";
    JOB_STILL_RUNNING "job-still-running" "F2" "a job is started again while it still runs";
    STOPPED_MEANWHILE "stopped-meanwhile" "F2" "a branch or job prevents a condition that another one waits for";
    UNDECLARED_FAILURE "undeclared-failure" "F1" "a skill fails with a failure that its `fails` does not name";
    UNHANDLED_FAILURE "unhandled-failure" "F1" "a workflow has no handler for a failure that a device may report";
    UNUSED "unused" "F4" "a thing or a reagent is declared and never used";
    NOT_REACHED "not-reached" "D2" "a wait for a value that the device cannot reach";
    WRONG_REAGENT "wrong-reagent" "C2" "a call names a substance that its source does not hold";
    FRAMING "framing" "N0" "a framing whose frames cannot be separated, checked or built";
    DRIVER_LINE "driver-line" "N0" "a line of a driver does not fit its device or transport";
    NO_SAFE "no-safe" "N0" "a driver has no `safe` line, but its device can be left on";
    CONTAMINATION "contamination" "C1" "a tool carries one reagent into another";
    BELOW_MINIMUM "below-minimum" "V3" "a volume below the smallest volume of a pipette";
    ABOVE_LIQUID "above-liquid" "V3" "a tip does not reach all the liquid that it aspirates";
    BEADS_NOT_HELD "beads-not-held" "V3" "a pipette takes beads along, as the magnets under the well are down";
    BEADS_NOT_GATHERED "beads-not-gathered" "V3" "a pipette takes liquid before the beads have gathered at the magnets";
    OUTSIDE_WELL "outside-well" "V3" "a height outside of the well";
    TIP_OVERFLOW "tip-overflow" "V3" "a tip would aspirate more than it holds";
    NEVER_FILLED "never-filled" "V2" "liquid is taken from an empty vessel";
    OUT_OF_TIPS "out-of-tips" "V4" "a rack has no fresh tip left";
    NO_RACK "no-rack" "T1" "a transfer needs tips, but names no rack";
    NO_RULE "no-rule" "T1" "a liquid class has no rule for a pipette with its tips";
    NO_MIX_VOLUME "no-mix-volume" "V3" "a transfer mixes, but gives no volume";
    LEFT_IN_TIP "left-in-tip" "T2" "liquid stays in a tip until it drips or dries";
    OVERLOAD "overload" "V3" "the load of a balance is above its range";
    BELOW_READABILITY "below-readability" "V3" "an amount below the readability of a balance";
    NOT_PIPED "not-piped" "T1" "a pump draws or pushes without a tube";
    TOO_STIFF "too-stiff" "G3" "a button needs more force than an arm can push with";
    NO_TIP "no-tip" "T1" "a pipette has no tip for a step that needs one";
    TIP_ON_TIP "tip-on-tip" "T2" "a pipette with a tip picks up another one";
    UNFINISHED "unfinished" "P1" "a workflow ends while a device is on or an arm holds something";
    TIP_USED "tip-used" "T2" "a used tip is picked up";
    NOT_EMPTY "not-empty" "P1" "a vessel that should be empty is not";
    TAKES_LIQUID "takes-liquid" "T1" "an air gap is taken where the tip is in a liquid, or at its rack";
    TIP_NOT_EMPTY "tip-not-empty" "T1" "a tip is returned to its rack with liquid in it";
    WRONG_COLUMN "wrong-column" "T1" "the channels of a pipette do not match the wells";
    WRONG_SPOT "wrong-spot" "T1" "a tip is returned to another place than it came from";
    HAND_FULL "hand-full" "T1" "an arm that holds something would pick up something else";
    NOT_IN_HAND "not-in-hand" "T1" "an arm puts down or pours a thing that it does not hold";
    IN_HAND "in-hand" "T1" "a thing is moved while an arm holds it";
    OCCUPIED "occupied" "T1" "a thing is placed where there is no room";
    CAPPED "capped" "T1" "a vessel is filled or emptied with its cap on";
    UNCAPPED "uncapped" "T1" "a vessel is spun with its cap off";
    LID_OPEN "lid-open" "T1" "a device runs with its lid or door open";
    LID_CLOSED "lid-closed" "T1" "a thing is placed under a closed lid, or taken from there";
    LATCH_OPEN "latch-open" "T1" "a device shakes with its latch open";
    LATCH_CLOSED "latch-closed" "T1" "a thing is placed under a closed latch, or taken from there";
    STILL_MOVING "still-moving" "T1" "a device is opened, loaded or reached into while it moves";
    NEVER_STARTED "never-started" "T1" "a device that was never started is stopped";
    USED_AFTER_DISPOSAL "used-after-disposal" "T2" "a thing is used after disposal";
    DISPOSED_TWICE "disposed-twice" "T2" "a thing is disposed of twice";
    NO_EFFECT "no-effect" "T3" "a step has no effect: its result is already reached";
    TOO_HEAVY "too-heavy" "G3" "a load is too heavy for an arm";
    TOO_WIDE "too-wide" "G4" "a gripper does not open wide enough for a thing";
    TOO_THIN "too-thin" "G4" "a gripper does not close far enough to hold a thing";
    TOO_TALL "too-tall" "G5" "a thing is too tall for its place";
    GRIP_TOO_WEAK "grip-too-weak" "G3" "the friction of a gripper's fingers cannot hold a thing";
    OFF_PLACE "off-place" "G5" "a lab places a thing beside the slot that it names";
    SLIDES "slides" "G5" "a thing is placed where it slides off or topples";
    UNSTABLE "unstable" "G5" "a thing is placed on a support narrower than its foot";
    WRONG_HOLE "wrong-hole" "G5" "a thing is placed into a hole that is too narrow, or far too wide";
    UNBALANCED_ROTOR "unbalanced-rotor" "D1" "a rotor is loaded unevenly";
    WINDOW_UNMEETABLE "window-unmeetable" "S1" "a step can never start or end in its given time";
    UNSCHEDULABLE "unschedulable" "S1" "no schedule for a workflow exists, or none was found";
    TAKES_CONTRADICTED "takes-contradicted" "D3" "the duration of a command or skill is outside its bounds";
    FLOW_UNBALANCED "flow-unbalanced" "E1" "one body loses a quantity that the other does not gain";
    HEAT_LEFT_BEHIND "heat-left-behind" "E1" "a law moves matter from one mixture to another without its heat";
    NOT_LUMPED "not-lumped" "E2" "a body releases heat too fast to have a single temperature";
    BINDING "binding" "W1" "the bindings of a lab do not locate its devices";
    UNDRIVEN "undriven" "W1" "no real device carries out a step";
    UNOBSERVED "unobserved" "W1" "a decision depends on a value that no device reports";
    DEVICE_LOST "device-lost" "W2" "a device no longer answers";
    DEVICE_GARBLED "device-garbled" "W2" "a device sends an invalid reply";
    DEVICE_REFUSED "device-refused" "W2" "a device refuses a command or query";
    UNSENDABLE "unsendable" "W2" "a message does not fit the format or frame that its driver declares";
    OTHER_DEVICE "other-device" "W2" "another device than the bound one answers";
    DIVERGED "diverged" "W2" "a device reports another value than it was set to, or than its twin";
    JOURNAL_MISMATCH "journal-mismatch" "W2" "a deployment cannot resume from its journal";
    BALANCE_BREACH "balance-breach" "X0" "a balance of the lab does not close";
    NONPHYSICAL_TEMPERATURE "nonphysical-temperature" "X0" "a law brings a mixture to an impossible temperature";
    CHATTERING "chattering" "X0" "a condition switches on and off endlessly";
    EVENT_PENDING "event-pending" "X0" "a delayed event is triggered again before it has happened";
    EVENT_CASCADE "event-cascade" "X0" "events trigger each other endlessly at one instant";
    NO_CONTACT_MODEL "no-contact-model" "X0" "a lab contains something for which contact is not modelled";
    INTEGRATION_FAILED "integration-failed" "X0" "a quantity changes faster than any step can follow";
    NOT_A_NUMBER "not-a-number" "X0" "a quantity has no finite value";
    TRANSFER_FRACTION "transfer-fraction" "X0" "a transfer removes a negative amount, or more than there is";
    RUN_FAILED "run-failed" "X0" "a step of the run failed without a handler";
    EXPECTATION_FAILED "expectation-failed" "X0" "an expectation was false when it was judged";
    ROBOTS_MEET "robots-meet" "R3" "two robots may, or must, be in one place at the same time";
    CLAIMED_TWICE "claimed-twice" "R1" "two steps use the same instance at the same time";
    DEADLOCK "deadlock" "R2" "steps wait for each other forever";
    WAITS_FOR_EVER "waits-for-ever" "X0" "the run waits for a condition that never becomes true";
    ENDLESS_INSTANT "endless-instant" "X0" "steps repeat endlessly without time passing";
    PROMISE_BROKEN "promise-broken" "X0" "a skill ended without achieving its effect";
    NOT_EXPRESSIBLE "not-expressible" "W0" "the target format cannot express the workflow";
    WRONG_MESSAGE "wrong-message" "W0" "a driver sends a message that its wire does not know";
    NOT_ANALYSED "not-analysed" "L1" "an analysis reached its limit and left the rest unchecked";
    UNUSABLE_NUMBER "unusable-number" "X0" "a duration, interval or count has an invalid value";
}

/// The code with this name.
pub fn find(name: &str) -> Option<Code> {
    ALL.iter().copied().find(|c| c.name == name)
}
