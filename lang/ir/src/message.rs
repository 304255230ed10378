//! Messages over HTTP as drivers write them: a method, a path, and the members of a JSON body by their pointers (RFC 6901),
//! `POST /runs/<run>/commands /data/commandType=home intent='set up'`; of an answer its status, and members.
//!
//! A pointer without `/` at its start stands beside the member before it. A value is JSON where it reads as such, else a text;
//! in single quotes it is always a text. A word in angle brackets stands for what an answer said there before.

/// Methods that a message may begin with.
pub const METHODS: &[&str] = &["GET", "POST", "PUT", "PATCH", "DELETE"];

/// Whether a message changes nothing where it goes (RFC 9110, 9.2.1).
pub fn only_asks(text: &str) -> bool {
    text.starts_with("GET ")
}

/// A member of a body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field<'t> {
    /// Where it stands: `/data/id`.
    pub pointer: String,
    /// What stands there, without quotes.
    pub value: &'t str,
    /// It was quoted: a text, whatever it reads as.
    pub quoted: bool,
}

/// What is asked of a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request<'t> {
    /// One of [`METHODS`].
    pub method: &'t str,
    /// The path with its query.
    pub target: &'t str,
    /// The field of a form in which the file goes that is to be played: `files=@`. Such a request has no other body.
    pub file: Option<&'t str>,
    /// Of the body; empty where there is none.
    pub fields: Vec<Field<'t>>,
}

/// What a server answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer<'t> {
    /// Any where absent.
    pub status: Option<u16>,
    /// Of the body, those that matter.
    pub fields: Vec<Field<'t>>,
}

/// Takes a request apart, or says what is wrong with it.
pub fn request(text: &str) -> Result<Request<'_>, String> {
    let words = words(text)?;
    let (Some(method), Some(target)) = (words.first().copied(), words.get(1).copied()) else {
        return Err("write a request as a method and a path, as in `GET /health`".to_owned());
    };
    if !METHODS.contains(&method) {
        return Err(format!("`{method}` is not a method: use one of {}", METHODS.join(", ")));
    }
    if !target.starts_with('/') || target.contains('=') && !target.contains('?') {
        return Err(format!("`{target}` is not a path: a path starts with `/`"));
    }
    let rest = words.get(2..).unwrap_or_default();
    if let [only] = rest
        && let Some(file) = only.strip_suffix("=@").filter(|f| f.bytes().all(|b| b.is_ascii_alphanumeric()))
    {
        return Ok(Request { method, target, file: Some(file), fields: Vec::new() });
    }
    Ok(Request { method, target, file: None, fields: fields(rest)? })
}

/// Takes an answer apart, or says what is wrong with it.
pub fn answer(text: &str) -> Result<Answer<'_>, String> {
    let words = words(text)?;
    let (status, rest) = match words.split_first() {
        Some((first, rest)) if !first.starts_with('/') => (Some(status(first)?), rest),
        _ => (None, words.as_slice()),
    };
    Ok(Answer { status, fields: fields(rest)? })
}

fn status(word: &str) -> Result<u16, String> {
    let known = word.parse::<u16>().ok().filter(|n| (100..600).contains(n));
    known.ok_or_else(|| format!("`{word}` is neither a status such as `201` nor a member such as `/data/id=7`"))
}

fn fields<'t>(words: &[&'t str]) -> Result<Vec<Field<'t>>, String> {
    let mut out: Vec<Field<'t>> = Vec::with_capacity(words.len());
    for word in words {
        let before = out.last().map(|f| f.pointer.as_str());
        let field = field(word, before)?;
        out.push(field);
    }
    Ok(out)
}

/// A member; `before` is the pointer of the one before it.
fn field<'t>(word: &'t str, before: Option<&str>) -> Result<Field<'t>, String> {
    let wrong = || format!("`{word}` is not a member of a body, as in `/data/volume=100`");
    let (own, value) = word.split_once('=').filter(|(p, _)| !p.is_empty()).ok_or_else(wrong)?;
    let beside = before.and_then(|b| b.rsplit_once('/')).map(|(above, _)| format!("{above}/{own}"));
    let whole = own.starts_with('/').then(|| own.to_owned());
    let pointer = whole.or(beside).ok_or_else(wrong)?;
    let inner = value.strip_prefix('\'').and_then(|v| v.strip_suffix('\''));
    Ok(Field { pointer, value: inner.unwrap_or(value), quoted: inner.is_some() })
}

/// The words of a message: parted by blanks that no quotes enclose.
fn words(text: &str) -> Result<Vec<&str>, String> {
    let (mut words, mut start, mut quoted) = (Vec::new(), None, false);
    for (at, c) in text.char_indices() {
        match c {
            ' ' | '\t' if !quoted => words.extend(start.take().and_then(|from: usize| text.get(from..at))),
            _ => {
                quoted ^= c == '\'';
                start.get_or_insert(at);
            }
        }
    }
    words.extend(start.and_then(|from| text.get(from..)));
    if quoted { Err("a quote is not closed".to_owned()) } else { Ok(words) }
}

/// The word in angle brackets that a value is, if it is one.
pub fn kept(value: &str) -> Option<&str> {
    let inner = value.strip_prefix('<')?.strip_suffix('>')?;
    let good = !inner.is_empty() && inner.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    good.then_some(inner)
}

/// What of an array a part of a pointer chooses: `[serialNumber:<serial>]` is the first item of which that member is that text.
pub fn choice(token: &str) -> Option<(&str, &str)> {
    token
        .strip_prefix('[')?
        .strip_suffix(']')?
        .split_once(':')
        .filter(|(member, text)| !member.is_empty() && !text.is_empty())
}

/// A pointer with what answers said in place of the words by which it chooses.
pub fn chosen(pointer: &str, known: impl Fn(&str) -> Option<String>) -> String {
    let part = |token: &str| match choice(token).and_then(|(member, text)| Some((member, known(kept(text)?)?))) {
        Some((member, text)) => format!("[{member}:{text}]"),
        None => token.to_owned(),
    };
    pointer.split('/').map(part).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::{answer, choice, chosen, kept, request};

    #[test]
    fn an_item_of_an_array_is_chosen_by_a_member() {
        let said = answer("200 /data/[serialNumber:<serial>]/id=<module>").expect("an answer");
        let [field] = &said.fields[..] else { panic!("one member") };
        assert_eq!((field.pointer.as_str(), field.value), ("/data/[serialNumber:<serial>]/id", "<module>"));
        assert_eq!(choice("[serialNumber:<serial>]"), Some(("serialNumber", "<serial>")));
        assert_eq!((choice("data"), choice("[x]"), choice("[:x]")), (None, None, None));
        let known = |word: &str| (word == "serial").then(|| "HS7".to_owned());
        assert_eq!(chosen(&field.pointer, known), "/data/[serialNumber:HS7]/id");
    }

    #[test]
    fn a_request_has_a_method_a_path_and_members() {
        let r = request("POST /runs?a=1 /data/x=100 /data/y='two words'").expect("a request");
        assert_eq!((r.method, r.target), ("POST", "/runs?a=1"));
        let fields: Vec<_> = r.fields.iter().map(|f| (f.pointer.as_str(), f.value, f.quoted)).collect();
        assert_eq!(fields, [("/data/x", "100", false), ("/data/y", "two words", true)]);
        let r = request("POST /a /data/x=1 y=2 params/z=3 w=4").expect("a request");
        let pointers: Vec<_> = r.fields.iter().map(|f| f.pointer.as_str()).collect();
        assert_eq!(pointers, ["/data/x", "/data/y", "/data/params/z", "/data/params/w"]);
    }

    #[test]
    fn what_is_no_message_is_said_to_be_none() {
        for text in ["", "GET", "FETCH /x", "GET x", "GET /x y", "GET /x y=1", "GET /x /y='1", "GET /x=1"] {
            assert!(request(text).is_err(), "{text}");
        }
        for text in ["ok", "2011", "201 x=1"] {
            assert!(answer(text).is_err(), "{text}");
        }
        assert_eq!(answer("/data/id=<run>").map(|a| a.status), Ok(None));
        assert_eq!((kept("<run>"), kept("run"), kept("<>")), (Some("run"), None, None));
    }
}
