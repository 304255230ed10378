//! Diagnostics as data; renderers live in the command.

use serde::{Deserialize, Serialize};

use crate::{Code, Span};

/// How bad it is: a *must* fault is an error, a *may* fault a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The program is not run.
    Error,
    /// The program runs; something may go wrong.
    Warning,
    /// Worth a thought; shown where it is asked for.
    Advice,
}

/// A remark attached to a place in the text: the cause (primary) or a step of its history.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// Where.
    pub span: Span,
    /// What is there; lower case, no full stop.
    pub text: String,
    /// Whether this is the cause, not the history.
    pub primary: bool,
}

/// A replacement of the text under a span.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edit {
    /// What is replaced; empty for an insertion.
    pub span: Span,
    /// What stands there afterwards.
    pub text: String,
}

/// A machine-applicable correction.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fix {
    /// What it does, as an instruction.
    pub title: String,
    /// The replacements, not overlapping.
    pub edits: Vec<Edit>,
    /// Whether it says the same as the text was meant to: it may be done without asking. A guess at a name, an amount
    /// or the place of a bracket is a person's to judge.
    pub sure: bool,
    /// Whether only a person can say which of several corrections is right, as between a label and what is weighed in: it is
    /// offered and never made unasked.
    #[serde(default)]
    pub asks: bool,
}

/// A name that a file uses and does not import, with where its import goes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Missing {
    /// The module that declares it: `std::heating`.
    pub module: String,
    /// As it stands after the module; none where all of the module is imported.
    pub name: Option<String>,
    /// Below the imports of the file.
    pub below: Span,
    /// Behind the last name of a list that the file imports from the module already.
    pub list: Option<Span>,
    /// No other module declares it.
    pub only: bool,
}

/// One finding: *what* in the headline, *where* in the labels, *how to mend* in the help.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// The registered kind of finding.
    pub code: Code,
    /// Error, warning or advice.
    pub severity: Severity,
    /// One sentence, lower case, no full stop, user text in backticks.
    pub headline: String,
    /// The cause first, then the history in the order of the text.
    pub labels: Vec<Label>,
    /// How to mend it.
    pub help: Vec<String>,
    /// Corrections an editor can apply.
    pub fixes: Vec<Fix>,
    /// The name that it is about, where one is unknown or used in a wrong way: what else uses that name may follow from it.
    #[serde(skip)]
    pub about: Option<String>,
    /// The import whose absence it is about.
    #[serde(skip)]
    pub missing: Option<Missing>,
}

impl Diagnostic {
    /// An error at `span`, whose label says `label`.
    pub fn error(code: Code, span: Span, headline: impl Into<String>, label: impl Into<String>) -> Self {
        Diagnostic {
            code,
            severity: Severity::Error,
            headline: headline.into(),
            labels: vec![Label { span, text: label.into(), primary: true }],
            help: Vec::new(),
            fixes: Vec::new(),
            about: None,
            missing: None,
        }
    }

    /// An error about a name at `span`, whose label says `label`.
    pub fn about(name: &str, code: Code, span: Span, headline: impl Into<String>, label: impl Into<String>) -> Self {
        Diagnostic { about: Some(name.to_owned()), ..Diagnostic::error(code, span, headline, label) }
    }

    /// A warning at `span`, whose label says `label`.
    pub fn warning(code: Code, span: Span, headline: impl Into<String>, label: impl Into<String>) -> Self {
        Diagnostic { severity: Severity::Warning, ..Diagnostic::error(code, span, headline, label) }
    }

    /// A remark at `span`, whose label says `label`.
    pub fn advice(code: Code, span: Span, headline: impl Into<String>, label: impl Into<String>) -> Self {
        Diagnostic { severity: Severity::Advice, ..Diagnostic::error(code, span, headline, label) }
    }

    /// Adds a step of the history.
    pub fn because(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: false });
        self
    }

    /// Adds a line of help.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help.push(text.into());
        self
    }

    /// Adds a correction that replaces the text under `span` and leaves no doubt what was meant.
    pub fn fix(mut self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.fixes.push(Fix {
            title: title.into(),
            edits: vec![Edit { span, text: text.into() }],
            sure: true,
            asks: false,
        });
        self
    }

    /// Adds a correction that replaces the text under `span` by what was probably meant.
    pub fn guess(mut self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.fixes.push(Fix {
            title: title.into(),
            edits: vec![Edit { span, text: text.into() }],
            sure: false,
            asks: false,
        });
        self
    }

    /// Adds a correction that replaces the text under `span`, one of several of which only a person can tell the right one.
    pub fn ask(mut self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.fixes.push(Fix {
            title: title.into(),
            edits: vec![Edit { span, text: text.into() }],
            sure: false,
            asks: true,
        });
        self
    }

    /// Whether it keeps the program from being run.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// The correction that may be done without asking: the only one, and sure.
    pub fn sure_fix(&self) -> Option<&Fix> {
        match self.fixes.as_slice() {
            [fix] if fix.sure => Some(fix),
            _ => None,
        }
    }

    /// The correction that was probably meant: the first, unless only a person can choose.
    pub fn likely_fix(&self) -> Option<&Fix> {
        self.fixes.first().filter(|_| self.fixes.iter().all(|fix| !fix.asks))
    }

    /// Where the cause stands.
    pub fn span(&self) -> Span {
        self.labels.iter().find(|l| l.primary).map(|l| l.span).unwrap_or_default()
    }
}
