//! What the verb of a call stands for.

use crate::declare::tables::MemberRef;
use crate::names::DeclId;

/// What a verb can mean.
#[derive(Clone, Debug)]
pub enum Verb<'a> {
    /// A skill in scope.
    Skill(DeclId),
    /// A command of a capability.
    Command(DeclId, MemberRef<'a>),
}
