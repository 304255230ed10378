//! What people say on the page: the same as at the keyboard, with the name that they give.

use matterix_hardware::deploy::Answer as Said;
use matterix_hardware::deploy::{Control, Gate};
use matterix_ir::hidden::visible;
use matterix_net::http::{Answer, Request};
use serde::Deserialize;

use crate::keys;

/// Longest name of a person, characters.
const LONGEST_NAME: usize = 80;

/// A request to `/act`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Act {
    /// Who says it.
    who: String,
    #[serde(rename = "do")]
    what: What,
    /// The number of the question that is answered.
    #[serde(default)]
    question: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum What {
    Pause,
    Step,
    Go,
    Stop,
    Yes,
    No,
}

/// Does what a request says; the answer to it.
pub(super) fn answer(request: &Request, control: &Control) -> Answer {
    let is_json = request.header("Content-Type").is_some_and(|kind| kind.starts_with("application/json"));
    if !is_json {
        return Answer::text(400, "send JSON (`Content-Type: application/json`)");
    }
    let act: Act = match serde_json::from_slice(&request.body) {
        Ok(act) => act,
        Err(_) => {
            return Answer::text(422, r#"send `{"who": "NAME", "do": "pause"}`: pause, step, go, stop, yes or no"#);
        }
    };
    let name = act.who.trim();
    if name.is_empty() || name.chars().count() > LONGEST_NAME || name.chars().any(char::is_control) {
        return Answer::text(422, "enter your name: 1 to 80 characters");
    }
    let who = format!("{}, on the page", visible(name));
    let (gate, what) = match act.what {
        What::Pause => (Some(Gate::Pause), "pause"),
        What::Step => (Some(Gate::Step), "one step"),
        What::Go => (Some(Gate::Go), "continue"),
        What::Stop => (None, "stop"),
        What::Yes | What::No => return reply(&act, who, control),
    };
    keys::told(what, &who);
    match gate {
        Some(gate) => keys::gate(gate, &who, control),
        None => keys::stop(&who, control),
    }
    Answer::text(202, "heard")
}

/// Answers a question.
fn reply(act: &Act, who: String, control: &Control) -> Answer {
    let Some(question) = act.question.as_ref().and_then(|number| number.parse().ok()) else {
        return Answer::text(422, "name the question: `\"question\": \"3\"`");
    };
    let yes = act.what == What::Yes;
    if !control.answer(question, Said { yes, who }) {
        return Answer::text(409, "this question is no longer open: it was answered or withdrawn");
    }
    Answer::text(202, "heard")
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use matterix_net::http::head;

    use super::*;

    fn posted(kind: &str, body: &str) -> Request {
        let head = head(format!("POST /act HTTP/1.1\r\nHost: localhost\r\nContent-Type: {kind}\r\n\r\n").as_bytes());
        Request { head: head.expect("a head"), body: body.as_bytes().to_vec() }
    }

    #[test]
    fn what_is_not_understood_changes_nothing() {
        static CANCEL: AtomicBool = AtomicBool::new(false);
        static CONTROL: Control = Control::new(&CANCEL, |_| {});
        for (kind, body, wanted) in [
            ("text/plain", r#"{"who": "A", "do": "stop"}"#, 400),
            ("application/json", "", 422),
            ("application/json", r#"{"who": "A", "do": "halt"}"#, 422),
            ("application/json", r#"{"who": "", "do": "stop"}"#, 422),
            ("application/json", "{\"who\": \"A\\nB\", \"do\": \"stop\"}", 422),
            ("application/json", r#"{"who": "A", "do": "stop", "more": 1}"#, 422),
            ("application/json", r#"{"who": "A", "do": "yes"}"#, 422),
            ("application/json", r#"{"who": "A", "do": "yes", "question": "7"}"#, 409),
        ] {
            assert_eq!(answer(&posted(kind, body), &CONTROL).status(), wanted, "{body}");
        }
        assert!(!CANCEL.load(Ordering::SeqCst) && CONTROL.next_gate().is_none());
    }

    #[test]
    fn of_two_who_answer_the_first_counts() {
        static CANCEL: AtomicBool = AtomicBool::new(false);
        static CONTROL: Control = Control::new(&CANCEL, |_| {});
        CONTROL.ask(u64::MAX, "is it in?");
        let no = posted("application/json", &format!(r#"{{"who": "Ann", "do": "no", "question": "{}"}}"#, u64::MAX));
        let yes = posted("application/json", &format!(r#"{{"who": "Bo", "do": "yes", "question": "{}"}}"#, u64::MAX));
        assert_eq!(answer(&no, &CONTROL).status(), 202);
        assert_eq!(answer(&yes, &CONTROL).status(), 409);
        assert_eq!(CONTROL.answered(u64::MAX), Some(Said { yes: false, who: "Ann, on the page".to_owned() }));
    }
}
