//! Where in the user's text a node of the plan comes from.

use std::path::Path;

use matterix_ir::plan::{Plan, StepId};
use matterix_ir::{Sources, Span};

/// By node: its statement, or that of the innermost step around it that does not stand in the library.
pub(crate) fn origins(plan: &Plan, sources: &Sources) -> Vec<Span> {
    let mut origins: Vec<Span> = plan.steps.iter().map(|s| s.span).collect();
    let mut todo: Vec<(StepId, Span)> = vec![(plan.root, plan.get(plan.root).span)];
    while let Some((step, around)) = todo.pop() {
        let own = plan.get(step).span;
        let library = sources.get(own.file).is_none_or(|f| f.name.contains("::"));
        let span = if library || own.is_empty() { around } else { own };
        origins[step.0 as usize] = span;
        todo.extend(plan.get(step).step.children().into_iter().map(|child| (child, span)));
    }
    origins
}

/// A line of a text: the name of its file without folders, its number, and what stands there.
pub(crate) fn line(sources: &Sources, span: Span) -> (String, usize, String) {
    let (number, _) = sources.line_column(span);
    let Some(source) = sources.get(span.file) else { return (String::new(), number, String::new()) };
    let name =
        Path::new(&source.name).file_name().map_or_else(|| source.name.clone(), |n| n.to_string_lossy().into_owned());
    let text = source.text.lines().nth(number.saturating_sub(1)).unwrap_or("").trim().to_owned();
    (name, number, text)
}
