//! A symbolic link that stands as long as what it leads to.

use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// A link of this process.
#[derive(Debug)]
pub(super) struct Symlink {
    path: PathBuf,
    target: String,
}

impl Symlink {
    /// Makes a link at `path`. A symbolic link there is replaced; anything else there is left as it is, and an error.
    pub(super) fn new(path: &Path, target: &str) -> Result<Self, String> {
        let made = match symlink(target, path) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => replace(path, target),
            other => other,
        };
        made.map_err(|e| format!("cannot make the link `{}`: {e}", path.display()))?;
        Ok(Symlink { path: path.to_owned(), target: target.to_owned() })
    }

    /// Its path, where that is text.
    pub(super) fn name(&self) -> Option<&str> {
        self.path.to_str()
    }
}

impl Drop for Symlink {
    /// Removes the link, unless it leads elsewhere by now: then it is somebody else's.
    fn drop(&mut self) {
        if fs::read_link(&self.path).is_ok_and(|target| target == Path::new(&self.target)) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Takes the place of another link in one step.
fn replace(path: &Path, target: &str) -> io::Result<()> {
    if !fs::symlink_metadata(path)?.is_symlink() {
        return Err(io::Error::other("another file exists there and stays unchanged"));
    }
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let beside = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    symlink(target, &beside)?;
    fs::rename(&beside, path).inspect_err(|_| drop(fs::remove_file(&beside)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("matterix-symlink-{name}-{}", std::process::id()));
        fs::create_dir_all(&dir).expect("a folder");
        dir
    }

    #[test]
    fn only_links_are_replaced_and_only_its_own_is_removed() {
        let dir = folder("replaced");
        let (path, file, inner) = (dir.join("link"), dir.join("file"), dir.join("folder"));
        fs::write(&file, "kept").expect("a file");
        fs::create_dir(&inner).expect("a folder");
        symlink("/nowhere", &path).expect("a link");
        for taken in [&file, &inner] {
            assert!(Symlink::new(taken, "/dev/null").expect_err("refused").contains("another file exists there"));
        }
        assert_eq!(fs::read_to_string(&file).expect("still there"), "kept");

        let first = Symlink::new(&path, "/dev/one").expect("replaces a link that leads nowhere");
        let second = Symlink::new(&path, "/dev/two").expect("replaces a link");
        drop(first);
        assert_eq!(fs::read_link(&path).expect("another's stays"), Path::new("/dev/two"));
        drop(second);
        assert!(fs::symlink_metadata(&path).is_err());

        let third = Symlink::new(&path, "/dev/three").expect("a link");
        fs::remove_file(&path).expect("removed");
        fs::write(&path, "another's").expect("a file");
        drop(third);
        assert_eq!(fs::read_to_string(&path).expect("still there"), "another's");
        fs::remove_dir_all(&dir).expect("removed");
    }
}
