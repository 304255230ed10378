//! Who may log in: a file of names and hashed passwords, as `htpasswd -B` writes it.

use std::collections::BTreeMap;

/// The most work that checking a password may be: each step doubles it. 2^14 rounds take about a second.
const DEAREST: u32 = 14;

/// What passwords of names that are not there are held against, so that both take as long.
const NOBODY: &str = "$2y$10$abcdefghijklmnopqrstuu37RkUr9H1EPO4Rc63Ngz60LSVREthYa";

/// Names with hashed passwords.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Users(BTreeMap<String, String>);

impl Users {
    /// The users of a file, a line each: `ana:$2y$10$...` (bcrypt). What is wrong, with its line.
    pub fn read(text: &str) -> Result<Users, String> {
        let mut users = BTreeMap::new();
        for (line, number) in text.lines().zip(1..) {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let wrong = |why: String| Err(format!("line {number}: {why}"));
            let Some((name, hash)) = line.split_once(':') else {
                return wrong("it is not `NAME:HASH`, as `htpasswd -B` writes it".to_owned());
            };
            match hash.parse::<bcrypt::HashParts>() {
                Err(_) => return wrong(format!("the password of `{name}` is not hashed with bcrypt (`htpasswd -B`)")),
                Ok(parts) if parts.get_cost() > DEAREST => {
                    return wrong(format!(
                        "the password of `{name}` takes too long to check: use at most `htpasswd -C {DEAREST}`"
                    ));
                }
                Ok(_) => {}
            }
            if users.insert(name.to_owned(), hash.to_owned()).is_some() {
                return wrong(format!("`{name}` is listed twice"));
            }
        }
        if users.is_empty() { Err("it names no user".to_owned()) } else { Ok(Users(users)) }
    }

    /// Whether this is the password of a user.
    pub(super) fn knows(&self, name: &str, password: &str) -> bool {
        let hash = self.0.get(name);
        // One that goes on behind what is hashed, or holds a zero byte, is another.
        let fits = password.len() <= 72 && !password.contains('\0');
        let is_it = bcrypt::verify(password, hash.map_or(NOBODY, String::as_str)).unwrap_or(false);
        is_it && fits && hash.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::{NOBODY, Users};

    #[test]
    fn a_file_of_htpasswd_is_read() {
        let hash = bcrypt::hash("secret", 4).expect("it is hashed");
        let users = Users::read(&format!("# people\nana:{hash}\n\n")).expect("it is sound");
        assert!(users.knows("ana", "secret"));
        assert!(!users.knows("ana", "other"));
        assert!(!users.knows("bob", "secret"));
        let long = "x".repeat(72);
        let hash = bcrypt::hash(&long, 4).expect("it is hashed");
        let users = Users::read(&format!("ana:{hash}")).expect("it is sound");
        assert!(users.knows("ana", &long));
        assert!(!users.knows("ana", &format!("{long}y")));
        assert!(NOBODY.parse::<bcrypt::HashParts>().is_ok());
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let hash = bcrypt::hash("secret", 4).expect("it is hashed");
        for (text, wanted) in [
            ("ana", "line 1: it is not `NAME:HASH`"),
            ("\nana:secret", "line 2: the password of `ana` is not hashed"),
            ("ana:{SHA}W6ph5Mm5Pz8GgiULbPgzG37mj9g=", "not hashed with bcrypt"),
            (&format!("ana:{}", hash.replace("$04$", "$31$")), "takes too long"),
            (&format!("ana:{hash}\nana:{hash}"), "line 2: `ana` is listed twice"),
            ("# nobody", "names no user"),
        ] {
            assert!(Users::read(text).is_err_and(|why| why.contains(wanted)), "{text}");
        }
    }
}
