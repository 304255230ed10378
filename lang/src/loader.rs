//! Where module texts come from. The compiler never touches disk: the caller hands it a loader.

use matterix_ir::FileId;

use crate::stop::Stop;

/// Finds the text of imported modules.
pub trait Loader {
    /// The module `module` (`sn1`, `parts::racks`) as seen from the file `from`: its display name and text.
    fn load(&self, from: FileId, module: &str) -> Option<(String, String)>;

    /// The bytes of a data file as named in the file `from`, or in words why it cannot be read.
    fn bytes(&self, from: FileId, path: &str) -> Result<Vec<u8>, String>;

    /// The text of a data file as named in the file `from`, or in words why it cannot be read.
    fn file(&self, from: FileId, path: &str) -> Result<String, String>;

    /// What may stop the compilation that asks.
    fn stop(&self) -> Stop {
        Stop::default()
    }
}

/// A loader that knows the standard library only.
pub struct LibraryOnly;

impl Loader for LibraryOnly {
    fn load(&self, _: FileId, _: &str) -> Option<(String, String)> {
        None
    }

    fn bytes(&self, _: FileId, _: &str) -> Result<Vec<u8>, String> {
        Err("the file does not exist".into())
    }

    fn file(&self, _: FileId, _: &str) -> Result<String, String> {
        Err("the file does not exist".into())
    }
}
