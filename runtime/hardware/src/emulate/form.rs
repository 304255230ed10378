//! A form with one file in it (RFC 7578), as files are given to servers.

/// The content type of one.
pub(super) const KIND: &str = "multipart/form-data";

/// The field of a form that a file is in, or why there is none.
pub(super) fn field(kind: &str, bytes: &[u8]) -> Result<String, String> {
    let mark = kind.split(';').filter_map(|p| p.trim().strip_prefix("boundary=")).next();
    let mark = mark.map(|m| m.trim_matches('"')).filter(|m| !m.is_empty()).ok_or("the form has no boundary")?;
    let begins = format!("--{mark}\r\n");
    let ends = format!("\r\n--{mark}--");
    let rest = bytes.strip_prefix(begins.as_bytes()).ok_or("the form does not start with its boundary")?;
    let at = rest.windows(4).position(|w| w == b"\r\n\r\n").ok_or("the form has no file")?;
    let head = std::str::from_utf8(&rest[..at]).map_err(|_| "the head of the form is not text")?;
    let file = &rest[at + 4..];
    let end = file.windows(ends.len()).rposition(|w| w == ends.as_bytes()).ok_or("the form is incomplete")?;
    let named = |name: &str| head.split([';', '\r', '\n']).find_map(|p| p.trim().strip_prefix(name)?.strip_suffix('"'));
    let (Some(field), Some(name)) = (named("name=\""), named("filename=\"")) else {
        return Err("the form has no file with a name".to_owned());
    };
    match &file[..end] {
        [] => Err(format!("the file `{name}` is empty")),
        content if name.ends_with(".json") => match serde_json::from_slice::<serde_json::Value>(content) {
            Ok(_) => Ok(field.to_owned()),
            Err(e) => Err(format!("the file `{name}` is not JSON: {e}")),
        },
        _ => Ok(field.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::field;

    fn form(name: &str, file: &str) -> Vec<u8> {
        let head = format!("Content-Disposition: form-data; name=\"files\"; filename=\"{name}\"");
        format!("--x\r\n{head}\r\nContent-Type: a/b\r\n\r\n{file}\r\n--x--\r\n").into_bytes()
    }

    #[test]
    fn a_file_in_a_form_is_found() {
        assert_eq!(field("multipart/form-data; boundary=x", &form("a.json", "{}")), Ok("files".to_owned()));
        assert_eq!(field("multipart/form-data; boundary=x", &form("a.py", "x = 1")), Ok("files".to_owned()));
    }

    #[test]
    fn what_is_no_form_is_said_to_be_none() {
        let kind = "multipart/form-data; boundary=x";
        assert!(field("multipart/form-data", &form("a.json", "{}")).is_err());
        assert!(field(kind, &form("a.json", "{")).is_err());
        assert!(field(kind, &form("a.py", "")).is_err());
        let whole = form("a.json", "{}");
        for end in 0..whole.len() - 2 {
            assert!(field(kind, &whole[..end]).is_err(), "{end}");
        }
    }
}
