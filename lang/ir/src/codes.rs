//! The registry of diagnostic codes. Each has a page in `docs/codes/`, whose examples run as tests.

use serde::{Serialize, Serializer};

/// A kind of finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Stable name, as in `error[unit-mismatch]`.
    pub name: &'static str,
    /// The family of checks it belongs to (`U1`, `K2`), or `P0` for parsing, `N0` for names, `X0` for runs.
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
    UNSUPPORTED "unsupported" "P0" "the construct is part of the language but has no meaning yet";
    UNKNOWN_MODULE "unknown-module" "N0" "an imported module does not exist";
    UNKNOWN_NAME "unknown-name" "N0" "a name is not declared";
    UNKNOWN_UNIT "unknown-unit" "N0" "a unit is not declared";
    UNKNOWN_MEMBER "unknown-member" "N0" "an instance, species or reaction has no such member";
    UNKNOWN_FIELD "unknown-field" "N0" "a field is not one of its owner";
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
    MISPLACED "misplaced" "N0" "a statement that has no meaning at its place";
    EMPTY_RANGE "empty-range" "N0" "the lower end of a range is above its upper end";
    OUT_OF_RANGE "out-of-range" "D1" "a parameter outside what it may be";
    INVALID_LAW "invalid-law" "N0" "a law changes what it may not change";
    UNIT_MISMATCH "unit-mismatch" "U1" "quantities of different dimensions are mixed";
    TEMPERATURE_POINT "temperature-point" "U2" "a temperature and a difference of temperatures are confused";
    CONCENTRATION_KIND "concentration-kind" "U3" "kinds of concentration are mixed, or none is chosen";
    RATE_UNIT "rate-unit" "U4" "the unit of a rate constant does not fit the order";
    LABEL_MISMATCH "label-mismatch" "U5" "a label does not agree with its recipe";
    INVALID_RECIPE "invalid-recipe" "U5" "a recipe does not add up";
    REACTION_NEVER_STARTS "reaction-never-starts" "K1" "a reaction whose reactants never meet";
    UNBALANCED "unbalanced" "K2" "atoms or charge differ between the sides of an equation";
    FORMULA_INVALID "formula-invalid" "K2" "a formula, structure or molar mass is wrong";
    TEMPLATE_MISMATCH "template-mismatch" "K2" "a template does not give the declared products";
    NEED_UNMET "need-unmet" "P1" "a step cannot begin because what it needs does not hold";
    FLOW_UNBALANCED "flow-unbalanced" "E1" "what one body loses the other does not gain";
    BALANCE_BREACH "balance-breach" "X0" "a balance of the lab does not close";
    CHATTERING "chattering" "X0" "a condition switches back and forth without end";
    EVENT_CASCADE "event-cascade" "X0" "events set each other off at one instant without end";
    INTEGRATION_FAILED "integration-failed" "X0" "a quantity changes faster than any step can follow";
    NOT_A_NUMBER "not-a-number" "X0" "a quantity has no finite value";
    TRANSFER_FRACTION "transfer-fraction" "X0" "a transfer takes less than nothing or more than there is";
    RUN_FAILED "run-failed" "X0" "a step of the run failed and nothing handled it";
    EXPECTATION_FAILED "expectation-failed" "X0" "an expectation did not hold when it was judged";
    CLAIMED_TWICE "claimed-twice" "X0" "two steps use the same instance at the same time";
    DEADLOCK "deadlock" "X0" "steps wait for each other and nothing can go on";
    WAITS_FOR_EVER "waits-for-ever" "X0" "the run waits for something that does not come";
    ENDLESS_INSTANT "endless-instant" "X0" "steps follow one another without time passing";
    PROMISE_BROKEN "promise-broken" "X0" "a skill ended without what it promises";
    UNUSABLE_NUMBER "unusable-number" "X0" "a duration, an interval or a count is not one";
}

/// The code with this name.
pub fn find(name: &str) -> Option<Code> {
    ALL.iter().copied().find(|c| c.name == name)
}
