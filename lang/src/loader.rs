//! Where module texts come from. The compiler never touches disk: the caller hands it a loader.

use matterix_ir::FileId;

/// Finds the text of imported modules.
pub trait Loader {
    /// The module `module` (`sn1`, `parts::racks`) as seen from the file `from`: its display name and text.
    fn load(&self, from: FileId, module: &str) -> Option<(String, String)>;
}

/// A loader that knows the standard library only.
pub struct LibraryOnly;

impl Loader for LibraryOnly {
    fn load(&self, _: FileId, _: &str) -> Option<(String, String)> {
        None
    }
}
