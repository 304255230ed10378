//! Parameters that are decided before the plan is written out.

/// A value of a parameter that is a truth value or a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The parameter.
    pub name: String,
    /// The word it has: `true` and `false` for a truth value.
    pub word: String,
    /// All words it may have, in their order.
    pub words: Vec<String>,
}
