//! Addresses of texts: files, and modules of the standard library.

use std::path::{Path, PathBuf};

use lsp_types::Uri;

use crate::uri::escape;

/// The path of a file's address.
pub fn path(uri: &Uri) -> Option<PathBuf> {
    let scheme = uri.scheme()?;
    if !scheme.as_str().eq_ignore_ascii_case("file") {
        return None;
    }
    let decoded = uri.path().as_estr().decode().into_string().ok()?;
    // `/c:/lab` names a drive.
    let drive = |p: &str| p.as_bytes().get(2) == Some(&b':') && cfg!(windows);
    let path = decoded.strip_prefix('/').filter(|_| drive(&decoded)).unwrap_or(&decoded);
    Some(PathBuf::from(path))
}

/// The address of a file.
pub fn of(path: &Path) -> Option<Uri> {
    let text = path.to_str()?;
    let text = if cfg!(windows) { format!("/{}", text.replace('\\', "/")) } else { text.to_string() };
    format!("file://{}", escape(&text)).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn paths_come_back() {
        for text in ["/lab/a b.mtx", "/µL/100 %/é.mtx", "/plain"] {
            let uri = of(Path::new(text)).map(|uri| path(&uri));
            assert_eq!(uri, Some(Some(PathBuf::from(text))));
        }
        assert_eq!("untitled:Untitled-1".parse().ok().and_then(|uri| path(&uri)), None);
    }
}
