//! Identifiers of served labs, in the user's folder for data: a server keeps its own from one start to the next.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;

use etcetera::{BaseStrategy, choose_base_strategy};

/// The identifier of the server of this lab of this file; a new one is noted the first time.
pub fn of(file: &Path, lab: &str) -> Result<String, String> {
    let base = choose_base_strategy().map_err(|_| "the user has no folder for data: say `--uuid UUID`".to_owned())?;
    let folder = base.data_dir().join(env!("CARGO_PKG_NAME"));
    let file = fs::canonicalize(file).map_err(|e| format!("`{}`: {e}", file.display()))?;
    noted(&folder, &format!("{file:?} {lab}"))
}

/// The identifier in a folder under a name.
fn noted(folder: &Path, name: &str) -> Result<String, String> {
    let list = folder.join("servers");
    let failed =
        |e: std::io::Error| format!("the identifier of the server cannot be kept in `{}`: {e}", list.display());
    let find = || match fs::read_to_string(&list) {
        Ok(text) => Ok(text.lines().find_map(|line| {
            let (uuid, of) = line.split_once(' ')?;
            matterix_sila_wire::uuid(uuid).filter(|_| of == name)
        })),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(failed(e)),
    };
    if let Some(known) = find()? {
        return Ok(known);
    }
    fs::create_dir_all(folder).map_err(failed)?;
    let line = format!("{} {name}\n", matterix_sila_wire::new_uuid());
    let mut open = OpenOptions::new().create(true).append(true).open(&list).map_err(failed)?;
    open.write_all(line.as_bytes()).map_err(failed)?;
    // Where two begin at once, the first line holds for both.
    find()?.ok_or_else(|| failed(ErrorKind::InvalidData.into()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_lab_keeps_its_identifier_and_shares_it_with_no_other() {
        let folder = std::env::temp_dir().join(format!("matterixc-identity-{}", std::process::id()));
        let of = |name: &str| super::noted(&folder, name).expect("it is kept");
        let (one, two) = (of("\"/a b.mtx\" bench"), of("\"/a b.mtx\" other"));
        assert_ne!(one, two);
        assert_eq!(one, of("\"/a b.mtx\" bench"));
        assert_eq!(two, of("\"/a b.mtx\" other"));
        std::fs::remove_dir_all(&folder).expect("it was made");
    }
}
