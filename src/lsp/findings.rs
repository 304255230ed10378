//! Findings in the form of the protocol.

use lsp_types::{
    CodeDescription, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location, NumberOrString, Range,
    Uri,
};
use matterix_ir::{Code, Diagnostic, Severity, Span, codes};

/// A finding in a text; `place` finds where a span stands, as far as there is an address, `page` the page of a code.
pub fn diagnostic(
    finding: &Diagnostic,
    place: &impl Fn(Span) -> Option<(Uri, Range)>,
    page: &impl Fn(Code) -> Option<Uri>,
) -> lsp_types::Diagnostic {
    let mut labels = finding.labels.iter();
    let cause = labels.clone().find(|label| label.primary);
    let range = place(finding.span()).map(|(_, range)| range).unwrap_or_default();
    let related: Vec<DiagnosticRelatedInformation> = labels
        .by_ref()
        .filter(|label| !label.primary)
        .filter_map(|label| {
            let (uri, range) = place(label.span)?;
            Some(DiagnosticRelatedInformation { location: Location { uri, range }, message: label.text.clone() })
        })
        .collect();
    let mut message = finding.headline.clone();
    for label in cause.iter().filter(|label| !label.text.is_empty()) {
        message.push_str(&format!(" ({})", label.text));
    }
    for help in &finding.help {
        message.push_str(&format!("\nhelp: {help}"));
    }
    lsp_types::Diagnostic {
        range,
        severity: Some(severity(finding.severity)),
        code: Some(NumberOrString::String(finding.code.name.to_string())),
        code_description: page(finding.code).map(|href| CodeDescription { href }),
        source: Some("matterixc".to_string()),
        message,
        related_information: Some(related).filter(|related| !related.is_empty()),
        tags: unused(finding).then(|| vec![DiagnosticTag::UNNECESSARY]),
        data: None,
    }
}

fn severity(severity: Severity) -> DiagnosticSeverity {
    match severity {
        Severity::Error => DiagnosticSeverity::ERROR,
        Severity::Warning => DiagnosticSeverity::WARNING,
        Severity::Advice => DiagnosticSeverity::HINT,
    }
}

/// Whether something stands there that nothing needs.
fn unused(finding: &Diagnostic) -> bool {
    [codes::UNUSED, codes::DEAD_BRANCH].contains(&finding.code)
}
