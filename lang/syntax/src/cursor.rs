//! Walking over what pest found, without trusting it to be there.

use std::iter::Peekable;

use pest::iterators::{Pair, Pairs};

use super::grammar::Rule;

/// One match of a rule.
pub(super) type Node<'i> = Pair<'i, Rule>;

/// The parts of a node in order, without punctuation and words that carry no choice.
pub(super) struct Kids<'i> {
    pairs: Peekable<Pairs<'i, Rule>>,
}

impl<'i> Kids<'i> {
    /// The parts of `node`.
    pub(super) fn of(node: Node<'i>) -> Self {
        Kids { pairs: node.into_inner().peekable() }
    }

    /// The rule of the next part.
    pub(super) fn peek(&mut self) -> Option<Rule> {
        while self.pairs.next_if(|p| is_noise(p.as_rule())).is_some() {}
        self.pairs.peek().map(Pair::as_rule)
    }

    /// Where the next part begins and ends.
    pub(super) fn peek_span(&mut self) -> Option<(usize, usize)> {
        self.peek()?;
        self.pairs.peek().map(|p| (p.as_span().start(), p.as_span().end()))
    }

    /// The next part.
    pub(super) fn take(&mut self) -> Option<Node<'i>> {
        self.peek()?;
        self.pairs.next()
    }

    /// The next part, if it is a `rule`.
    pub(super) fn eat(&mut self, rule: Rule) -> Option<Node<'i>> {
        if self.peek() == Some(rule) { self.pairs.next() } else { None }
    }

    /// The next part, if `fits` accepts its text.
    pub(super) fn take_if(&mut self, fits: impl FnOnce(&str) -> bool) -> Option<Node<'i>> {
        self.peek()?;
        self.pairs.next_if(|p| fits(p.as_str()))
    }

    /// Whether the next part is a `rule`, which is then consumed.
    pub(super) fn has(&mut self, rule: Rule) -> bool {
        self.eat(rule).is_some()
    }

    /// The first part that is a `rule`, if there is one.
    pub(super) fn find(&mut self, rule: Rule) -> Option<Node<'i>> {
        std::iter::from_fn(|| self.take()).find(|part| part.as_rule() == rule)
    }

    /// The parts that are left.
    pub(super) fn rest(&mut self) -> Vec<Node<'i>> {
        std::iter::from_fn(|| self.take()).collect()
    }

    /// The parts while they are of this `rule`.
    pub(super) fn all(&mut self, rule: Rule) -> Vec<Node<'i>> {
        std::iter::from_fn(|| self.eat(rule)).collect()
    }
}

/// Where the last token of a node ends; the blanks that pest may have skipped after it do not count.
pub(super) fn token_end(node: &Node) -> usize {
    match node.clone().into_inner().next_back() {
        Some(last) => token_end(&last),
        None => node.as_span().end(),
    }
}

/// Punctuation, and keywords that only introduce what follows.
fn is_noise(rule: Rule) -> bool {
    use Rule::*;
    matches!(
        rule,
        lbrace
            | rbrace
            | lparen
            | rparen
            | lbracket
            | rbracket
            | comma
            | colon
            | scope
            | eq
            | rangle
            | amp
            | bar
            | larrow
            | plus
            | pm
            | arrow
            | dots
            | kw_mtx
            | kw_use
            | kw_dimension
            | kw_unit
            | kw_species
            | kw_solution
            | kw_reaction
            | kw_equilibrium
            | kw_interaction
            | kw_reactive_group
            | kw_material
            | kw_incompatible
            | kw_allow
            | kw_caution
            | kw_capability
            | kw_asset
            | kw_process
            | kw_event
            | kw_relation
            | kw_fn
            | kw_const
            | kw_framing
            | kw_driver
            | kw_lab
            | kw_skill
            | kw_workflow
            | kw_study
            | kw_fit
            | kw_test
            | kw_let
            | kw_table
            | kw_var
            | kw_wait
            | kw_sequence
            | kw_parallel
            | kw_start
            | kw_await
            | kw_repeat
            | kw_for
            | kw_if
            | kw_else
            | kw_retry
            | kw_try
            | kw_finally
            | kw_hold
            | kw_keep
            | kw_within
            | kw_expect
            | kw_record
            | kw_note
            | kw_ask
            | kw_step
            | kw_claim
            | kw_fail
            | kw_return
            | kw_timeout
            | kw_after
            | kw_needs
            | kw_presumes
            | kw_warns
            | kw_effect
            | kw_takes
            | kw_fails
            | kw_max
            | kw_every
            | kw_times
            | kw_sends
            | kw_asks
            | kw_expects
            | kw_when
            | kw_view
            | kw_command
            | kw_frame
            | kw_option
            | kw_says
            | kw_moves
            | kw_grips
            | kw_frees
            | kw_leads
            | kw_joint
            | kw_solid
            | kw_per
            | kw_also
            | kw_prefixes
            | kw_labelled
            | kw_over
            | kw_where
            | kw_pitch
            | kw_alive
            | kw_answers
            | kw_hears
            | kw_ignores
            | kw_reply
            | kw_reading
            | kw_include
            | kw_between
            | kw_vary
            | kw_runs
            | kw_report
            | kw_data
            | kw_estimate
            | kw_match
            | kw_noise
            | kw_on
            | kw_at
            | kw_from
            | kw_in
            | kw_by
            | kw_with
            | kw_and
            | kw_as
            | kw_any
            | kw_holding
            | kw_dissolves
            | EOI
    )
}
