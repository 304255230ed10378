//! What robots with joints do in a performance, for their controllers.

pub mod ros;
mod travel;
pub mod urscript;

pub use travel::{Point, Travel, travels};
