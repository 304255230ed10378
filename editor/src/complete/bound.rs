//! Names that the text around a cursor binds: loops, folds and named steps. Where something is being written, the last analysis does not
//! know them.

use matterix_lang::semantic_index::Sort;

use super::context::{Context, Token};
use super::steps::FOLDS;
use super::values::Place;

impl<'t> Place<'_> {
    /// The same place, with what the text before the cursor binds there.
    pub(crate) fn bind(mut self, context: &Context<'t>) -> Self {
        for step in &context.steps {
            self.bound.push(((*step).to_string(), Sort::Step));
        }
        for (i, open) in context.open.iter().enumerate() {
            let each: &[Token<'t>] = match open.bracket {
                '{' if open.head.first().is_some_and(|t| t.text == "for") => &open.head[1..],
                '(' if open.head.last().is_some_and(|t| FOLDS.contains(&t.text) && t.end() == open.at) => {
                    context.open.get(i + 1).map_or(&context.before, |inner| &inner.head)
                }
                _ => continue,
            };
            let [name, word, set @ ..] = each else { continue };
            if !name.is_word() || word.text != "in" {
                continue;
            }
            let end = set.iter().position(|t| t.text == ":").unwrap_or(set.len());
            let sort = self.value(&set[..end]).map_or(Sort::Any, |(_, sort)| match sort {
                Sort::Kind(kind) => Sort::Thing(vec![kind], None),
                set => self.index.element_of(&set).unwrap_or(Sort::Any),
            });
            self.bound.push((name.text.to_string(), sort));
        }
        self
    }
}
