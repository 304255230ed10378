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
}

/// The code with this name.
pub fn find(name: &str) -> Option<Code> {
    ALL.iter().copied().find(|c| c.name == name)
}
