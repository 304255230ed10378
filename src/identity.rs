//! Identifiers and certificates of served labs, in the user's folder for data: a server keeps its own from one start to the next.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use etcetera::{BaseStrategy, choose_base_strategy};
use matterix_sila_wire::tls::{Identity, own};

fn folder(instead: &str) -> Result<PathBuf, String> {
    let base = choose_base_strategy().map_err(|_| format!("this user has no data folder: use {instead}"))?;
    Ok(base.data_dir().join(env!("CARGO_PKG_NAME")))
}

/// The identifier of the server of this lab of this file; a new one is noted the first time.
pub fn of(file: &Path, lab: &str) -> Result<String, String> {
    let folder = folder("`--uuid UUID`")?;
    let file = fs::canonicalize(file).map_err(|e| format!("`{}`: {e}", file.display()))?;
    noted(&folder, &format!("{file:?} {lab}"))
}

/// The identifier in a folder under a name.
fn noted(folder: &Path, name: &str) -> Result<String, String> {
    let list = folder.join("servers");
    let failed = |e: std::io::Error| format!("cannot store the identifier of the server in `{}`: {e}", list.display());
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

/// The certificate of a server for these hosts, and the file that it is in. A new one is made where there is none yet, or the
/// one that is kept is not for all of them.
pub fn certificate(uuid: &str, hosts: &[String]) -> Result<(Identity, PathBuf), String> {
    kept(&folder("`--certificate FILE --key FILE` or `--insecure`")?.join("certificates"), uuid, hosts)
}

/// What stands in front of a certificate, before the hosts that it is for.
const HOSTS: &str = "For ";

fn kept(folder: &Path, uuid: &str, hosts: &[String]) -> Result<(Identity, PathBuf), String> {
    let (shown, hidden) = (folder.join(format!("{uuid}.pem")), folder.join(format!("{uuid}.key")));
    let read = || {
        let (chain, key) = (fs::read_to_string(&shown).ok()?, fs::read_to_string(&hidden).ok()?);
        let known: Vec<&str> = chain.lines().next()?.strip_prefix(HOSTS)?.split(", ").collect();
        let is_for_all = hosts.iter().all(|host| known.contains(&host.as_str()));
        let identity = Identity { chain, key };
        (is_for_all && identity.is_sound().is_ok()).then_some(identity)
    };
    if let Some(identity) = read() {
        return Ok((identity, shown));
    }
    let failed = |e: std::io::Error| format!("cannot store the certificate in `{}`: {e}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    let mut made = own(uuid, hosts)?;
    made.chain = format!("{HOSTS}{}\n{}", hosts.join(", "), made.chain);
    for (path, text, mode) in [(&hidden, &made.key, 0o600), (&shown, &made.chain, 0o644)] {
        // Beside it first: what is there stays whole until what is new is.
        let fresh = path.with_extension(format!("{}.new", std::process::id()));
        let mut open = OpenOptions::new();
        let file = open.create(true).truncate(true).write(true).mode(mode).open(&fresh);
        file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(failed)?;
        fs::rename(&fresh, path).map_err(failed)?;
    }
    read().map(|identity| (identity, shown.clone())).ok_or_else(|| failed(ErrorKind::InvalidData.into()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_server_keeps_its_certificate_until_it_needs_one_for_more_hosts() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("matterixc-certificate-{}", std::process::id()));
        let hosts = |all: &[&str]| all.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>();
        let kept = |all: &[&str]| super::kept(&folder, "7f3f5b0e", &hosts(all)).expect("it is kept").0;
        let first = kept(&["localhost", "127.0.0.1"]);
        assert_eq!(kept(&["127.0.0.1"]), first);
        let more = kept(&["localhost", "10.0.0.7"]);
        assert_ne!(more, first);
        let mode = std::fs::metadata(folder.join("7f3f5b0e.key")).expect("it is there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        std::fs::write(folder.join("7f3f5b0e.key"), &first.key).expect("it is written");
        assert_ne!(kept(&["localhost"]), more);
        std::fs::remove_dir_all(&folder).expect("it was made");
    }

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
