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
        find(&name).ok_or_else(|| de::Error::custom(format_args!("no code is named `{name}`")))
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
    SYNTAX "syntax" "P0" "the text is not what the grammar expects here";
    HIDDEN_CHARACTER "hidden-character" "P0" "a hidden character changes how a text is shown";
    BUDGET_SPENT "budget-spent" "P0" "a text asks for more work than a check does";
    UNSUPPORTED "unsupported" "P0" "the construct is part of the language but has no meaning yet";
    UNKNOWN_MODULE "unknown-module" "N0" "an imported module does not exist";
    MESH_FILE "mesh-file" "N0" "a mesh cannot be read";
    LABWARE_FILE "labware-file" "N0" "a labware definition cannot be read";
    SILA_FILE "sila-file" "N0" "a definition of a SiLA 2 feature cannot be read, or not all of it can be used";
    URDF_FILE "urdf-file" "N0" "a description of a robot cannot be read";
    UNKNOWN_NAME "unknown-name" "N0" "a name is not declared";
    UNKNOWN_UNIT "unknown-unit" "N0" "a unit is not declared";
    UNKNOWN_MEMBER "unknown-member" "N0" "an instance, species or reaction has no such member";
    UNKNOWN_FIELD "unknown-field" "N0" "a field is not one of its owner";
    DERIVED_MEMBER "derived-member" "N0" "a field gives what follows from other members";
    UNKNOWN_VERB "unknown-verb" "N0" "no skill or command has this name";
    UNKNOWN_PARAMETER "unknown-parameter" "N0" "a workflow has no such parameter";
    DUPLICATE_NAME "duplicate-name" "N0" "a name is declared twice";
    AMBIGUOUS_NAME "ambiguous-name" "N0" "a name has several meanings here";
    WRONG_KIND "wrong-kind" "N0" "a name stands for another kind of thing than is needed";
    CIRCULAR "circular" "N0" "a declaration leads back to itself";
    NO_WORKFLOW "no-workflow" "N0" "it is not clear which workflow to run";
    MISSING_FIELD "missing-field" "N0" "something that must be given is not given";
    MISSING_PROPERTY "missing-property" "N0" "a species lacks a property that a law needs";
    UNBOUND_EXTERN "unbound-extern" "N0" "an external function that nothing provides";
    WRONG_ARGUMENTS "wrong-arguments" "N0" "the arguments do not fit what is called";
    WRONG_DEVICE "wrong-device" "N0" "a command for something that cannot do it";
    TYPE_MISMATCH "type-mismatch" "N0" "a value of another type than is expected";
    CANNOT_VARY "cannot-vary" "N0" "a study or a fit leaves open what is fixed";
    DATA_FILE "data-file" "N0" "the data of a fit cannot be read";
    UNBOUND_ROLE "unbound-role" "N0" "it is not decided which instance, or which lab, takes a role";
    MISPLACED "misplaced" "N0" "a statement that has no meaning at its place";
    EMPTY_RANGE "empty-range" "N0" "the lower end of a range is above its upper end";
    OUT_OF_REACH "out-of-reach" "G1" "a robot does not get to where it is to go";
    MISSES_MOUTH "misses-mouth" "G1" "a stream is poured from an arm into a mouth that is too narrow for it";
    SPILLED "spilled" "G1" "a vessel in hand tilts so far that its contents run over the rim";
    COLLISION "collision" "G2" "a robot, or what it holds, runs into something";
    OVERLAP "overlap" "G2" "two things of a lab are put into one place";
    MISPLACED_GRIP "misplaced-grip" "G4" "a gripper is not where it would have to be to grip or let go";
    OUT_OF_RANGE "out-of-range" "D1" "a parameter outside what it may be";
    INVALID_LAW "invalid-law" "N0" "a law changes what it may not change";
    UNIT_MISMATCH "unit-mismatch" "U1" "quantities of different dimensions are mixed";
    TEMPERATURE_POINT "temperature-point" "U2" "a temperature and a difference of temperatures are confused";
    CONCENTRATION_KIND "concentration-kind" "U3" "kinds of concentration are mixed, or none is chosen";
    RATE_UNIT "rate-unit" "U4" "the unit of a rate constant does not fit the order";
    LABEL_MISMATCH "label-mismatch" "U5" "a label does not agree with its recipe";
    INVALID_RECIPE "invalid-recipe" "U5" "a recipe does not add up";
    REACTION_NEVER_STARTS "reaction-never-starts" "K1" "a reaction whose reactants never meet";
    NEVER_MADE "never-made" "K3" "something waits for or expects a substance that nothing makes";
    UNBALANCED "unbalanced" "K2" "atoms or charge differ between the sides of an equation";
    EQUILIBRIUM_FORM "equilibrium-form" "K2" "an equilibrium is not written as its constant is meant";
    REACTION_AT_EQUILIBRIUM "reaction-at-equilibrium" "K2" "a reaction does what equilibria of the file do already";
    INTERACTION_FORM "interaction-form" "K2" "an interaction is not between what is dissolved, or its numbers are not those of its charges";
    EQUILIBRIA_CONTRADICT "equilibria-contradict" "K2" "the constants of a circle of equilibria do not agree";
    FORMULA_INVALID "formula-invalid" "K2" "a formula, structure or molar mass is wrong";
    TEMPLATE_MISMATCH "template-mismatch" "K2" "a template does not give the declared products";
    INCOMPATIBLE_MIX "incompatible-mix" "H1" "substances come together that must not";
    MATERIAL_ATTACKED "material-attacked" "M1" "a vessel is not made for what gets into it";
    HAZARD "hazard" "H2" "a condition that a library or file calls a hazard comes about";
    ABOVE_BOILING_POINT "above-boiling-point" "H2" "a set point above the boiling point of what is heated";
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
    SECOND_PHASE "second-phase" "H3" "more of an organic liquid or solid is in water than dissolves";
    GAS_STAYS "gas-stays" "H3" "a gas leaves that the model keeps dissolved";
    GAS_LEAVES "gas-leaves" "H3" "more of a gas is there than stays dissolved";
    GAS_BUBBLES_OFF "gas-bubbles-off" "H3" "an open vessel holds gases at more than the pressure of the air";
    PH_OUT_OF_WINDOW "ph-out-of-window" "D1" "the pH of a vessel leaves the window that is given for it";
    HEAT_BEYOND_SATURATION "heat-beyond-saturation" "H3" "a temperature is used of a mixture with too little water for its salts";
    PH_FAR_FROM_25_DEGC "ph-far-from-25-degc" "H3" "the pH of a warm or cold solution is used";
    HEAT_OF_STRONG_SOLUTION "heat-of-strong-solution" "H3" "the temperature of a concentrated solution is used whose heat capacity is unknown";
    VOLUME_OF_STRONG_SOLUTION "volume-of-strong-solution" "H3" "a strong solution is measured out by volume whose density is unknown";
    HEAT_LEFT_OUT "heat-left-out" "H3" "a temperature is used after a step whose heat the model leaves out";
    HOT_MIXING "hot-mixing" "H3" "a step dissolves, dilutes or neutralises so much that it gets hot";
    WATER_INTO_ACID "water-into-acid" "H3" "water is poured into a strong acid that gets hot with it";
    WELLS_STAY_COLD "wells-stay-cold" "H3" "a heater warms labware whose wells take no heat in the model";
    NEED_UNMET "need-unmet" "P1" "a step cannot begin because what it needs does not hold";
    VOLUME_OVERFLOW "volume-overflow" "V1" "a vessel gets more than it holds";
    VOLUME_UNDERFLOW "volume-underflow" "V2" "more is taken from a vessel than there is";
    WRONG_TIP "wrong-tip" "T1" "a tip that does not fit the pipette";
    DEAD_BRANCH "dead-branch" "F2" "a part of the plan is never done: constants decide a branch, a `fail` stands before it, or nothing raises what a handler is for";
    JOB_NOT_BEGUN "job-not-begun" "F2" "a job is waited for that has not begun";
    JOB_STILL_RUNNING "job-still-running" "F2" "a job is begun again while it still runs";
    STOPPED_MEANWHILE "stopped-meanwhile" "F2" "a branch or job stops what another one waits for";
    UNDECLARED_FAILURE "undeclared-failure" "F1" "a skill fails with what its `fails` does not name";
    UNHANDLED_FAILURE "unhandled-failure" "F1" "a workflow has no handler for what a device may report";
    UNUSED "unused" "F4" "a thing or a reagent is declared and never used";
    NOT_REACHED "not-reached" "D2" "a device cannot bring about what is waited for";
    WRONG_REAGENT "wrong-reagent" "C2" "a call says of what it takes something, and the source holds none of it";
    FRAMING "framing" "N0" "frames of a line that cannot be told apart, judged or put together";
    DRIVER_LINE "driver-line" "N0" "a line of a driver fits neither its device nor its transport";
    NO_SAFE "no-safe" "N0" "a driver does not say how its device is made safe, though it can be left on";
    CONTAMINATION "contamination" "C1" "a tool carries one reagent into another";
    BELOW_MINIMUM "below-minimum" "V3" "a pipette is asked for less than its smallest volume";
    TIP_OVERFLOW "tip-overflow" "V3" "a tip takes up more than it holds";
    NEVER_FILLED "never-filled" "V2" "a liquid is taken from where there is none";
    OUT_OF_TIPS "out-of-tips" "V4" "a rack has no fresh tip left";
    NO_RACK "no-rack" "T1" "a transfer takes tips, and no rack is named";
    NO_MIX_VOLUME "no-mix-volume" "V3" "a transfer mixes, and no volume is given";
    LEFT_IN_TIP "left-in-tip" "T2" "a liquid hangs in a tip until it drips or dries";
    OVERLOAD "overload" "V3" "a balance bears more than its range";
    BELOW_READABILITY "below-readability" "V3" "less is weighed in than a balance can show";
    NOT_PIPED "not-piped" "T1" "a pump draws or pushes where no tube leads";
    TOO_STIFF "too-stiff" "G3" "a button takes more force than an arm pushes with";
    NO_TIP "no-tip" "T1" "a pipette has no tip for what it does";
    TIP_ON_TIP "tip-on-tip" "T2" "a pipette that has a tip takes another one";
    UNFINISHED "unfinished" "P1" "a workflow ends while a device is on or something is in hand";
    TIP_USED "tip-used" "T2" "a tip is picked up that was taken before";
    NOT_EMPTY "not-empty" "P1" "a vessel that should be empty holds something";
    TIP_NOT_EMPTY "tip-not-empty" "T1" "a tip goes back to its rack with liquid in it";
    WRONG_COLUMN "wrong-column" "T1" "the channels of a pipette do not stand where they would have to";
    WRONG_SPOT "wrong-spot" "T1" "a tip goes back to another place than it came from";
    HAND_FULL "hand-full" "T1" "an arm that holds something is to take something else";
    NOT_IN_HAND "not-in-hand" "T1" "an arm puts down or pours what it does not hold";
    IN_HAND "in-hand" "T1" "something is taken away that an arm holds";
    OCCUPIED "occupied" "T1" "something is put where there is no room";
    CAPPED "capped" "T1" "a vessel is filled or emptied with its cap on";
    UNCAPPED "uncapped" "T1" "a vessel is spun with its cap off";
    LID_OPEN "lid-open" "T1" "a device runs with its lid or door open";
    LID_CLOSED "lid-closed" "T1" "something is put under a closed lid, or taken from there";
    LATCH_OPEN "latch-open" "T1" "a device shakes with its latch open";
    LATCH_CLOSED "latch-closed" "T1" "something is put under a closed latch, or taken from there";
    STILL_MOVING "still-moving" "T1" "a device is opened, loaded or reached into while it moves";
    NEVER_STARTED "never-started" "T1" "a device is stopped that was never started";
    USED_AFTER_DISPOSAL "used-after-disposal" "T2" "something is used that was thrown away";
    DISPOSED_TWICE "disposed-twice" "T2" "something is thrown away that is gone already";
    NO_EFFECT "no-effect" "T3" "a step does what is done already";
    TOO_HEAVY "too-heavy" "G3" "an arm takes more than it can carry";
    TOO_WIDE "too-wide" "G4" "a gripper does not open wide enough for what it is to grip";
    TOO_THIN "too-thin" "G4" "a gripper does not close far enough to hold what it is to grip";
    TOO_TALL "too-tall" "G5" "something is put where there is not enough room above";
    GRIP_TOO_WEAK "grip-too-weak" "G3" "the friction of a gripper's fingers does not bear what it is to hold";
    OFF_PLACE "off-place" "G5" "a lab puts something beside the place of several that it names";
    SLIDES "slides" "G5" "something is put where it slides off or topples";
    UNSTABLE "unstable" "G5" "something is put on what is narrower than its foot";
    WRONG_HOLE "wrong-hole" "G5" "something is put into a hole that is too narrow, or far too wide, for it";
    UNBALANCED_ROTOR "unbalanced-rotor" "D1" "a rotor is loaded on one side";
    WINDOW_UNMEETABLE "window-unmeetable" "S1" "a step can never begin or end in the time it is given";
    UNSCHEDULABLE "unschedulable" "S1" "no schedule of a workflow can be made or found";
    TAKES_CONTRADICTED "takes-contradicted" "D3" "a command or skill cannot take as long as its bounds say";
    FLOW_UNBALANCED "flow-unbalanced" "E1" "what one body loses the other does not gain";
    HEAT_LEFT_BEHIND "heat-left-behind" "E1" "a law carries matter from one mixture to another without its heat";
    NOT_LUMPED "not-lumped" "E2" "a body gives off heat faster than it can have one temperature";
    BINDING "binding" "W1" "the bindings of a lab do not say where its devices are";
    UNDRIVEN "undriven" "W1" "nothing carries out a step on real devices";
    UNOBSERVED "unobserved" "W1" "a decision depends on what no device tells";
    DEVICE_LOST "device-lost" "W2" "a device no longer answers";
    DEVICE_GARBLED "device-garbled" "W2" "a device answers what makes no sense";
    DEVICE_REFUSED "device-refused" "W2" "a device refuses what it is told or asked";
    UNSENDABLE "unsendable" "W2" "what a device is to be sent does not fit the form or frame that its driver declares";
    OTHER_DEVICE "other-device" "W2" "another device answers than the one that is meant";
    DIVERGED "diverged" "W2" "a device tells something else than it was told, or than its twin";
    JOURNAL_MISMATCH "journal-mismatch" "W2" "a deployment cannot go on from its journal";
    BALANCE_BREACH "balance-breach" "X0" "a balance of the lab does not close";
    NONPHYSICAL_TEMPERATURE "nonphysical-temperature" "X0" "a law brings a mixture to an impossible temperature";
    CHATTERING "chattering" "X0" "a condition switches back and forth without end";
    EVENT_PENDING "event-pending" "X0" "a delayed event is set off again before it has happened";
    EVENT_CASCADE "event-cascade" "X0" "events set each other off at one instant without end";
    NO_CONTACT_MODEL "no-contact-model" "X0" "a lab has something of which contact is not modelled";
    INTEGRATION_FAILED "integration-failed" "X0" "a quantity changes faster than any step can follow";
    NOT_A_NUMBER "not-a-number" "X0" "a quantity has no finite value";
    TRANSFER_FRACTION "transfer-fraction" "X0" "a transfer takes less than nothing or more than there is";
    RUN_FAILED "run-failed" "X0" "a step of the run failed and nothing handled it";
    EXPECTATION_FAILED "expectation-failed" "X0" "an expectation did not hold when it was judged";
    ROBOTS_MEET "robots-meet" "R3" "two robots may be in one place at the same time, or must";
    CLAIMED_TWICE "claimed-twice" "R1" "two steps use the same instance at the same time";
    DEADLOCK "deadlock" "R2" "steps wait for each other and nothing can go on";
    WAITS_FOR_EVER "waits-for-ever" "X0" "the run waits for something that does not come";
    ENDLESS_INSTANT "endless-instant" "X0" "steps follow one another without time passing";
    PROMISE_BROKEN "promise-broken" "X0" "a skill ended without what it promises";
    NOT_EXPRESSIBLE "not-expressible" "W0" "a workflow does what the kind of file it is written as cannot say";
    WRONG_MESSAGE "wrong-message" "W0" "a driver says something that its wire does not know";
    NOT_ANALYSED "not-analysed" "L1" "an analysis reaches its limit and leaves the rest unchecked";
    UNUSABLE_NUMBER "unusable-number" "X0" "a duration, an interval or a count is not one";
}

/// The code with this name.
pub fn find(name: &str) -> Option<Code> {
    ALL.iter().copied().find(|c| c.name == name)
}
