//! What a run cannot continue from.

use std::fmt;

use matterix_ir::{Code, Label, Span};

/// Something the simulation cannot continue from; rendered on the source line.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// What kind of fault.
    pub code: Code,
    /// The declaration or statement it comes from.
    pub span: Option<Span>,
    /// Seconds since the run began.
    pub time: f64,
    /// One line, lower case, user text in backticks.
    pub message: String,
    /// How to mend it, a line each.
    pub help: Vec<String>,
    /// What else in the text it rests on.
    pub because: Vec<Label>,
}

impl Fault {
    /// A fault without a place and without help.
    pub fn new(code: Code, time: f64, message: impl Into<String>) -> Self {
        Fault { code, span: None, time, message: message.into(), help: Vec::new(), because: Vec::new() }
    }

    /// The same fault, shown at `span`.
    pub fn at(mut self, span: Span) -> Self {
        self.span = Some(span);
        self
    }

    /// The same fault, with one more place that it rests on.
    pub fn because(mut self, span: Span, text: impl Into<String>) -> Self {
        self.because.push(Label { span, text: text.into(), primary: false });
        self
    }

    /// The same fault with one more line of help.
    pub fn help(mut self, line: impl Into<String>) -> Self {
        self.help.push(line.into());
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "fault[{}] at {} s: {}", self.code.name, self.time, self.message)
    }
}

impl std::error::Error for Fault {}
