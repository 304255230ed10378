//! Drivers: what is said to devices.

use matterix_lang::ast::{Exchange, Expr, ExprKind, Path, Wire, WireKind};
use matterix_lang::semantic_index::Sort;

use super::{Found, Walk};
use crate::index::{Kind, Meaning};

impl Walk<'_> {
    pub(super) fn wire(&mut self, wire: &Wire) {
        let depth = self.scope.len();
        self.end = wire.span.end;
        let device = Sort::Thing(self.this.and_then(|k| self.index.decl_of(k)).into_iter().collect(), None);
        match &wire.kind {
            WireKind::Error => {}
            WireKind::Command { sig, exchange } => {
                let command = self.verb_of(&sig.verb, &device);
                let params = command.map(|d| self.index.def(d).inside.clone()).unwrap_or_default();
                for p in sig.all_params() {
                    let param = params.iter().copied().find(|d| self.index.def(*d).name == p.name.text);
                    match param {
                        Some(param) => {
                            self.known(p.name.span, param);
                            self.enter(&p.name.text, param, p.name.span.start);
                        }
                        None => drop(self.bind(Kind::Parameter, &p.name, p.name.span, &Found::nothing())),
                    }
                }
                // What the command takes is seen in what is sent, options too.
                for param in params {
                    let name = self.index.def(param).name.clone();
                    self.scope.push((name, param));
                }
                self.exchange(exchange);
            }
            WireKind::Ignores { .. } => {}
            WireKind::Hears { path, condition, every, .. } => {
                self.told(path, &device);
                self.exprs(condition);
                self.expr(every);
            }
            WireKind::Reading { path, condition, asks, .. } => {
                self.told(path, &device);
                self.exprs(condition);
                self.text(asks);
            }
            WireKind::Reply { fails, .. } => self.failure(fails),
            WireKind::Answers { with, .. } => self.text(with),
            WireKind::Fixed { when, condition, exchange } => {
                self.language(when.span, "when it is sent");
                self.exprs(condition);
                self.exchange(exchange);
            }
            WireKind::Alive { condition, every, within, by, otherwise } => {
                self.exprs([condition, every].into_iter().chain(within));
                self.verb_of(by, &device);
                self.verb_of(otherwise, &device);
            }
        }
        self.scope.truncate(depth);
    }

    /// A member of the device that it tells.
    fn told(&mut self, path: &Path, device: &Sort) {
        let kinds = match device {
            Sort::Thing(kinds, _) => kinds.clone(),
            _ => Vec::new(),
        };
        let mut sort = Sort::Thing(kinds, None);
        for segment in &path.segments {
            let member = self.index.member_of(&sort, &segment.text);
            self.note(segment.span, member.as_ref().map_or(Meaning::Unknown, |m| m.meaning));
            sort = member.map_or(Sort::Any, |m| m.sort);
        }
    }

    /// Parts of frames in a field of a framing, and how a checksum is reckoned.
    pub(super) fn frame_words(&mut self, e: &Expr) {
        match &*e.kind {
            ExprKind::Name(n) => self.language(n.span, "a part of a frame"),
            ExprKind::Call(of, args) => {
                self.frame_words(of);
                for arg in args {
                    if let Some(name) = &arg.name {
                        self.language(name.span, "a parameter of a checksum");
                    }
                    self.frame_words(&arg.value);
                }
            }
            ExprKind::Range(a, b) | ExprKind::Binary(_, a, b) => {
                self.frame_words(a);
                self.frame_words(b);
            }
            _ => drop(self.expr(e)),
        }
    }

    pub(super) fn exchange(&mut self, exchange: &Exchange) {
        exchange.sends.iter().for_each(|t| self.text(t));
        if let Some(until) = &exchange.until {
            self.text(&until.asks);
            self.expr(&until.timeout);
        }
    }
}
