//! Texts that come with the command, for editors to show: modules of the library and pages of codes. As files where there is a folder for
//! them, since every editor opens files; else under a scheme of their own, whose texts the client asks for.

use std::fs;
use std::path::{Path, PathBuf};

use lsp_types::Uri;
use matterix_ir::{Code, codes};
use matterix_lang::library;

use super::uris;
use crate::uri::SCHEME;

/// Where the texts are offered.
#[derive(Clone, Debug)]
pub struct Shelf {
    folder: Option<PathBuf>,
}

impl Shelf {
    /// In a folder, or under the scheme.
    pub fn new(folder: Option<PathBuf>) -> Shelf {
        Shelf { folder: folder.map(|folder| folder.join(concat!("texts-", env!("CARGO_PKG_VERSION")))) }
    }

    /// The address of a module of the library: `std::heating`.
    pub fn module(&self, name: &str) -> Option<Uri> {
        let module = library::MODULES.iter().find(|module| module.name == name)?;
        self.offer(&format!("{}.mtx", bare(name)), module.text)
    }

    /// The address of the page of a code.
    pub fn page(&self, code: Code) -> Option<Uri> {
        self.offer(&format!("codes/{}.md", code.name), code.page)
    }

    /// The module of the library whose text is offered under an address.
    pub fn module_at(&self, uri: &Uri) -> Option<&'static library::Module> {
        let path = self.within(uri)?;
        library::MODULES.iter().find(|module| path == format!("{}.mtx", bare(module.name)))
    }

    /// The text under an address of the scheme.
    pub fn text(&self, uri: &Uri) -> Option<&'static str> {
        let page = |code: &&Code| self.within(uri).is_some_and(|path| path == format!("codes/{}.md", code.name));
        let module = self.module_at(uri).map(|module| module.text);
        module.or_else(|| codes::ALL.iter().find(page).map(|code| code.page))
    }

    /// The path of an address on the shelf.
    fn within(&self, uri: &Uri) -> Option<String> {
        if uri.scheme().is_some_and(|scheme| scheme.as_str() == SCHEME) {
            return Some(uri.path().as_str().trim_start_matches('/').to_string());
        }
        let path = uris::path(uri)?;
        Some(path.strip_prefix(self.folder.as_deref()?).ok()?.to_str()?.replace('\\', "/"))
    }

    fn offer(&self, path: &str, text: &str) -> Option<Uri> {
        let written = self.folder.as_ref().map(|folder| folder.join(path)).filter(|file| lies(file, text));
        written.as_deref().and_then(uris::of).or_else(|| format!("{SCHEME}:/{path}").parse().ok())
    }
}

/// Whether a text lies in a file; it is put there, not to be written to, where it does not.
fn lies(file: &Path, text: &str) -> bool {
    if fs::read(file).is_ok_and(|there| there == text.as_bytes()) {
        return true;
    }
    let put = || -> std::io::Result<()> {
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder)?;
        }
        let beside = file.with_extension(format!("{}.new", std::process::id()));
        fs::write(&beside, text)?;
        let mut permissions = fs::metadata(&beside)?.permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&beside, permissions)?;
        fs::rename(&beside, file)
    };
    put().is_ok()
}

/// The name of a module without the library's.
fn bare(name: &str) -> &str {
    name.strip_prefix("std::").unwrap_or(name)
}
