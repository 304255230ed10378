//! Calls: which skill or command a verb means, and its arguments.

use std::collections::BTreeSet;
use std::sync::Arc;

use matterix_ir::plan::{Argument, Step, StepId};
use matterix_ir::scene::InstanceId;
use matterix_ir::{Diagnostic, Span, Text, codes};

use super::{Planner, ResultSlot};
use crate::ast::{
    Block, Call, Clause, ClauseKind, Expr, ExprKind, Handlers, ItemKind, MemberKind, Name, NamedExpr, Param, Sig,
};
use crate::declare::Type;
use crate::eval::lab::verbs::Verb;
use crate::eval::{Scope, Value, known_too_late};
use crate::hints;
use crate::names::{DeclId, names_of, verb_text};
use crate::near;
use crate::syntax::{STEP_WORDS, is_step};

/// So many devices that could do a step are named where none of the lab can.
const DEVICES_SHOWN: usize = 4;

/// The arguments of a call, in the words of its signature.
pub struct Bound {
    /// By parameter name, in order of declaration.
    pub values: Vec<(String, Value)>,
}

impl<'a> Planner<'a, '_> {
    /// Lowers a call; gives its node and, for a skill with a result, the value.
    pub fn call(&mut self, call: &'a Call, span: Span, scope: &mut Scope) -> Option<(StepId, Option<Value>)> {
        let (verbs, count) = self.find_verb(call, scope)?;
        let said = self.said_of_sources(call, scope);
        let object = self.object_of(&verbs, call, count, scope);
        if let Some((Value::Error, _)) = object {
            for (_, e) in &call.labelled {
                self.lab.expr(e, scope);
            }
            return None;
        }
        let verb_span = call.words.first().map_or(call.span, |w| w.span.to(call.words[count - 1].span));
        let verb = self.choose(&verbs, &object, call, verb_span, scope)?;
        if self.is_another_meant(&verb, count, call, &object, verb_span, scope.module) {
            return None;
        }
        self.lab.note_verb(verb_span, &verb);
        self.lab.verbs.insert(call.span, verb.clone());
        self.said = said;
        let before = self.lab.diagnostics.len();
        let step = match &verb {
            Verb::Skill(id) => self.skill(*id, call, object, span, scope),
            Verb::Command(owner, m) => self.command(*owner, *m, call, object, span, scope).map(|s| (s, None)),
        };
        self.blame_call(&verb, call, verb_span, before, scope);
        step
    }

    /// Names the call where what it calls is sound by itself, as the library is, and goes wrong with these arguments: one finding
    /// there, for all that it led to in the library.
    fn blame_call(&mut self, verb: &Verb<'a>, call: &'a Call, verb_span: Span, before: usize, scope: &mut Scope) {
        let modules = &self.lab.tables.names.modules;
        if self.lab.diagnostics.len() <= before || modules[scope.module].is_library() {
            return;
        }
        let inside = |d: &Diagnostic| d.is_error() && modules.iter().any(|m| m.file == d.span().file && m.is_library());
        let Some(first) = self.lab.diagnostics[before..].iter().find(|d| inside(d)).cloned() else { return };
        let found = self.lab.diagnostics.split_off(before);
        self.lab.diagnostics.extend(found.into_iter().filter(|d| !inside(d)));
        let (verb, unknown) = (self.text(verb_span), self.unknown_thing(verb, call, scope));
        let d = match unknown {
            Some(at) => {
                let thing = self.text(at);
                known_too_late(&format!("`{thing}`"), at)
            }
            None => {
                let headline = format!("`{verb}` does not work with these arguments: {}", first.headline);
                Diagnostic::error(first.code, call.span, headline, "called here")
            }
        };
        self.lab.report(d.because(first.span(), "needed here"));
    }

    /// The argument of a call that is a thing known only when running.
    fn unknown_thing(&mut self, verb: &Verb<'a>, call: &'a Call, scope: &mut Scope) -> Option<Span> {
        let (sig, _) = self.signature(verb)?;
        let labelled = call.labelled.iter().filter(|(label, _)| has_label(sig, label)).map(|(_, e)| e);
        let found = call.object.iter().chain(labelled).find(|e| {
            let noted = self.lab.diagnostics.len();
            let value = self.lab.expr(e, scope);
            self.lab.diagnostics.truncate(noted);
            matches!(value, Value::InstanceNode(_))
        });
        found.map(|e| e.span)
    }

    /// What stands behind a verb, where the signatures of the verb may expect words or places.
    fn object_of(
        &mut self,
        verbs: &[Verb<'a>],
        call: &'a Call,
        count: usize,
        scope: &mut Scope,
    ) -> Option<(Value, Span)> {
        match (call.words.get(count), &call.object) {
            (Some(word), None) => {
                let types = self.types_of_object(verbs, std::slice::from_ref(word));
                let value = match types.as_slice() {
                    [ty] => self.lab.hinted_name(word, ty, scope),
                    _ => self.lab.name_of(word, scope),
                };
                self.lab.note_value(word.span, &value);
                Some((value, word.span))
            }
            (None, Some(e)) => {
                let items = match &*e.kind {
                    ExprKind::Tuple(items, None) => items.as_slice(),
                    _ => std::slice::from_ref(e),
                };
                let names: Vec<Name> = items.iter().map(name_or_nothing).collect();
                let types = self.types_of_object(verbs, &names);
                let value = match types.as_slice() {
                    [ty] => self.lab.hinted(items.first().unwrap_or(e), ty, scope),
                    types if types.len() > 1 && types.len() == items.len() => {
                        let values = items.iter().zip(types).map(|(e, ty)| self.lab.hinted(e, ty, scope));
                        Value::Tuple(values.collect())
                    }
                    _ => self.lab.expr(e, scope),
                };
                Some((value, e.span))
            }
            _ => None,
        }
    }

    /// The types of the parameters in front, of the first meaning of a verb that has as many and knows these words; if none
    /// knows them, of the first that has as many.
    fn types_of_object(&mut self, verbs: &[Verb<'a>], names: &[Name]) -> Vec<Type> {
        let mut found: Option<Vec<Type>> = None;
        for verb in verbs {
            let Some((sig, module)) = self.signature(verb) else { continue };
            if sig.params.len() != names.len() {
                continue;
            }
            let types: Vec<Type> = sig
                .params
                .iter()
                .map(|p| p.ty.as_ref().map_or(Type::Any, |ty| self.lab.resolve_parameter_type(ty, module)))
                .collect();
            let knows = |(ty, name): (&Type, &Name)| matches!(ty, Type::Enum(words) if words.contains(&name.text));
            if types.iter().zip(names).any(knows) {
                return types;
            }
            found.get_or_insert(types);
        }
        // A device may be named in its place.
        let other = |verb: &Verb<'a>| self.signature(verb).is_some_and(|(sig, _)| sig.params.len() != names.len());
        found.filter(|_| !verbs.iter().any(other)).unwrap_or_default()
    }

    /// The signature of a verb, and the module whose names it sees.
    fn signature(&self, verb: &Verb<'a>) -> Option<(&'a Sig, usize)> {
        match verb {
            Verb::Skill(id) => {
                let decl = self.lab.tables.names.decl(*id);
                match &decl.item.kind {
                    ItemKind::Skill { sig, .. } => Some((sig, decl.module)),
                    _ => None,
                }
            }
            Verb::Command(_, m) => match &m.member.kind {
                MemberKind::Command { sig, .. } => Some((sig, m.module)),
                _ => None,
            },
        }
    }

    /// The meanings of the longest declared verb that the words begin with, and its number of words.
    fn find_verb(&mut self, call: &'a Call, scope: &Scope) -> Option<(Arc<[Verb<'a>]>, usize)> {
        if let Some(known) = self.meanings.get(&call.span) {
            return Some(known.clone());
        }
        let longest = call.words.len();
        for n in (1..=longest).rev() {
            let rest = longest - n;
            if rest > 1 || (rest == 1 && call.object.is_some()) {
                continue;
            }
            let verbs = self.verbs(&verb_text(&call.words[..n]), scope.module);
            if !verbs.is_empty() {
                let found = (verbs.into(), n);
                self.meanings.insert(call.span, Clone::clone(&found));
                return Some(found);
            }
        }
        self.unknown_verb(call, scope);
        None
    }

    fn verbs(&self, verb: &str, module: usize) -> Vec<Verb<'a>> {
        let names = self.lab.tables.names;
        let mut out = Vec::new();
        if let Some(id) = names.lookup(module, verb)
            && matches!(names.decl(id).item.kind, ItemKind::Skill { .. })
        {
            out.push(Verb::Skill(id));
        }
        // What an import hides is still meant where its words fit.
        if let Some(id) = names.hidden(module, verb)
            && matches!(names.decl(id).item.kind, ItemKind::Skill { .. })
        {
            out.push(Verb::Skill(id));
        }
        out.extend(self.lab.tables.commands(verb).iter().map(|m| Verb::Command(m.owner, *m)));
        out
    }

    fn unknown_verb(&mut self, call: &'a Call, scope: &Scope) {
        if self.label_missing(call, scope) {
            return;
        }
        let names = self.lab.tables.names;
        let device = self.device_named(call, scope);
        // With a device after it, a skill is meant only if it has these labels.
        let is_meant = |id: DeclId| match &names.decl(id).item.kind {
            ItemKind::Skill { sig, .. } => {
                device.is_none() || call.labelled.iter().all(|(label, _)| has_label(sig, label))
            }
            _ => false,
        };
        let skills = names.visible(scope.module).filter(|(_, id)| is_meant(*id));
        let mut all: Vec<String> = skills.map(|(n, _)| n.to_string()).collect();
        // What this device can be told with these very labels.
        let mut able: Vec<String> = Vec::new();
        for kind in self.lab.tables.kinds.values() {
            for m in &kind.members {
                let MemberKind::Command { sig, .. } = &m.member.kind else { continue };
                let fits = device.is_none_or(|id| !sig.params.is_empty() || self.lab.instance_is(id, m.owner));
                if fits {
                    all.push(verb_text(&sig.verb));
                }
                if fits && device.is_some() && sig.params.is_empty() && misfit(sig, call, false) == 0 {
                    able.push(verb_text(&sig.verb));
                }
            }
        }
        able.sort();
        able.dedup();
        let words = if call.object.is_none() && call.words.len() > 1 {
            &call.words[..call.words.len() - 1]
        } else {
            &call.words[..]
        };
        let text = verb_text(words);
        let steps = self.step_words(&text, call);
        all.extend(steps.iter().cloned());
        let span = words.first().map_or(call.span, |w| w.span.to(words[words.len() - 1].span));
        let mut d = Diagnostic::about(
            &text,
            codes::UNKNOWN_VERB,
            span,
            format!("no skill or command is called `{text}`"),
            "not a known verb",
        );
        if let Some(import) = names.import_of(scope.module, &text, |k| matches!(k, ItemKind::Skill { .. })) {
            self.lab.report(import.offered(d));
            return;
        }
        // The second word may read as a label: `switch on plate`.
        let said = call.words.iter().chain(call.labelled.first().map(|(label, _)| label));
        let said: Vec<&str> = said.map(|word| word.text.as_str()).collect();
        if let Some(hint) = hints::of_verb(&said) {
            let hint = self.with_devices(hint);
            self.lab.report(d.help(hint));
            return;
        }
        let mut near = near::nearest(&text, &all);
        // With a word of the language the step can be read as it stands.
        near.sort_by_key(|word| !steps.contains(word));
        if near.is_empty() && !call.labelled.is_empty() && able.len() <= 3 {
            near = able;
        }
        d = near::proposed(d, &near, span);
        self.lab.report(d);
    }

    /// A hint with the devices of the lab that it may be about; where the lab has none, it says so.
    fn with_devices(&self, hint: &str) -> String {
        let mut out = hint.to_owned();
        for (word, verb) in hints::STANDS_FOR.iter().filter(|(word, _)| hint.contains(word)) {
            let owners = self.lab.tables.commands(verb).iter().map(|m| m.owner);
            let mut able = owners.flat_map(|owner| self.lab.instances_of(owner).to_vec());
            match able.next() {
                Some(id) => out = out.replace(word, &self.lab.spoken_name(id)),
                None => out.push_str(&format!("; this lab has no device with the command `{verb}`")),
            }
        }
        out
    }

    /// The device that stands after a verb which is not known.
    fn device_named(&self, call: &Call, scope: &Scope) -> Option<InstanceId> {
        let name = call.words.last().filter(|_| call.words.len() > 1 && call.object.is_none())?;
        match scope.var(&name.text).cloned().or_else(|| self.lab.of_lab(&name.text, scope))? {
            Value::Instance(id) | Value::Qualified(id, _) => Some(id),
            _ => None,
        }
    }

    /// `heat plate 60 degC`: the verb is known with the word after it, and what follows has no label.
    fn label_missing(&mut self, call: &Call, scope: &Scope) -> bool {
        let (Some(object), Some(count)) = (&call.object, call.words.len().checked_sub(1).filter(|n| *n > 0)) else {
            return false;
        };
        let text = verb_text(&call.words[..count]);
        let mut missing: Vec<String> = Vec::new();
        for verb in self.verbs(&text, scope.module) {
            let Some((sig, _)) = self.signature(&verb) else { continue };
            let given = |label: &Name| call.labelled.iter().any(|(l, _)| l.text == label.text);
            missing.extend(sig.labelled.iter().map(|(l, _)| l).find(|l| !given(l)).map(|l| l.text.clone()));
        }
        missing.sort();
        missing.dedup();
        let Some(first) = missing.first().cloned() else { return false };
        let value = self.text(object.span);
        let words: Vec<String> = missing.iter().map(|label| format!("`{label}`")).collect();
        let at = Span { end: object.span.start, ..object.span };
        let headline = format!("{} is missing before `{value}`", words.join(" or "));
        let d = Diagnostic::about(&first, codes::WRONG_ARGUMENTS, object.span, headline, "which argument is this?");
        self.lab.report(d.guess(format!("add `{first}`"), at, format!("{first} ")));
        true
    }

    /// Words of the language near to an unknown verb with which the step can be read.
    fn step_words(&self, verb: &str, call: &Call) -> Vec<String> {
        let written = self.sources.get(call.span.file).map_or("", |source| source.text.as_str());
        let step = written.get(call.span.start as usize..call.span.end as usize).unwrap_or_default();
        let Some(rest) = step.strip_prefix(verb) else { return Vec::new() };
        let mut near = near::nearest(verb, STEP_WORDS);
        near.retain(|word| is_step(&format!("{word}{rest}")));
        near
    }

    /// The meaning that fits the object and the labels.
    fn choose(
        &mut self,
        verbs: &[Verb<'a>],
        object: &Option<(Value, Span)>,
        call: &'a Call,
        verb_span: Span,
        scope: &mut Scope,
    ) -> Option<Verb<'a>> {
        let mut lacking = Vec::new();
        let mut fitting: Vec<(Verb<'a>, (usize, bool))> = Vec::new();
        for verb in verbs {
            match verb {
                Verb::Skill(id) => {
                    let decl = self.lab.tables.names.decl(*id);
                    let ItemKind::Skill { sig, .. } = &decl.item.kind else { continue };
                    let other = self.is_of_other_kind(sig, decl.module, object);
                    fitting.push((verb.clone(), (misfit(sig, call, false), other)));
                }
                Verb::Command(owner, m) => {
                    let MemberKind::Command { sig, .. } = &m.member.kind else { continue };
                    match self.device(sig, object, call, scope) {
                        Some(id) if self.lab.instance_is(id, *owner) => {
                            let by = !sig.params.is_empty() || object.is_none();
                            fitting.push((verb.clone(), (misfit(sig, call, by), false)));
                        }
                        device => lacking.push((*owner, device)),
                    }
                }
            }
        }
        let commands = fitting.iter().filter_map(|(verb, _)| match verb {
            Verb::Command(_, m) => Some(*m),
            Verb::Skill(_) => None,
        });
        let visible = self.lab.tables.visible(commands.collect());
        fitting.retain(|(verb, _)| match verb {
            Verb::Command(_, m) => visible.iter().any(|v| std::ptr::eq(v.member, m.member)),
            Verb::Skill(_) => true,
        });
        let best = fitting.iter().map(|f| f.1).min();
        let chosen: Vec<_> = fitting.iter().filter(|f| Some(f.1) == best).map(|f| f.0.clone()).collect();
        if let Some(one) = chosen.first() {
            return Some(one.clone());
        }
        let by = call.labelled.iter().find(|(label, _)| label.text == "by").map(|(_, e)| e);
        let named = match object {
            Some((value @ (Value::InstanceNode(_) | Value::Error), at)) => Some((value.clone(), *at)),
            _ => by.map(|e| (self.lab.expr(e, scope), e.span)),
        };
        match named {
            // What is wrong with it has been said, or it is not known yet.
            Some((Value::Error, _)) => {}
            Some((Value::InstanceNode(_), at)) => {
                let device = self.text(at);
                self.lab.report(known_too_late(&format!("`{device}`"), at));
            }
            _ => self.no_such_device(&lacking, verb_span, call),
        }
        None
    }

    /// Reports the import that is missing where a visible skill does not fit a call and one of the same name does that the
    /// file does not import.
    fn is_another_meant(
        &mut self,
        verb: &Verb<'a>,
        count: usize,
        call: &Call,
        object: &Option<(Value, Span)>,
        span: Span,
        module: usize,
    ) -> bool {
        let Verb::Skill(id) = verb else { return false };
        let names = self.lab.tables.names;
        let decl = names.decl(*id);
        let ItemKind::Skill { sig, .. } = &decl.item.kind else { return false };
        let here = misfit(sig, call, false) + self.misfit_of_object(sig, decl.module, object);
        // Of a skill of the file itself the mistake is in the call.
        if here == 0 || !names.modules[decl.module].is_library() {
            return false;
        }
        let text = verb_text(&call.words[..count]);
        let fits = |kind: &ItemKind| match kind {
            ItemKind::Skill { sig: other, .. } => !std::ptr::eq(sig, other) && misfit(other, call, false) < here,
            _ => false,
        };
        let Some(import) = names.import_of(module, &text, fits) else { return false };
        let headline = format!("this call needs another `{text}`, which is not imported");
        let place = format!("`{}` does not fit here", self.form(sig));
        self.lab.report(import.offered(Diagnostic::about(&text, codes::UNKNOWN_VERB, span, headline, place)));
        true
    }

    /// Whether a verb is about things of another kind than the one named.
    fn is_of_other_kind(&mut self, sig: &'a Sig, module: usize, object: &Option<(Value, Span)>) -> bool {
        let (Some(param), Some((Value::Instance(id) | Value::Qualified(id, _), _))) = (sig.params.first(), object)
        else {
            return false;
        };
        match param.ty.as_ref().map(|ty| self.lab.resolve_parameter_type(ty, module)) {
            Some(Type::Instance { kinds, .. }) => !kinds.iter().all(|kind| self.lab.instance_is(*id, *kind)),
            _ => false,
        }
    }

    /// How badly what a verb is about fits: a quantity where a thing is expected says more than a word that is missing.
    fn misfit_of_object(&mut self, sig: &'a Sig, module: usize, object: &Option<(Value, Span)>) -> usize {
        let (Some(param), Some((value, _))) = (sig.params.first(), object) else { return 0 };
        let Some(ty) = &param.ty else { return 0 };
        let quantity = matches!(self.lab.resolve_parameter_type(ty, module), Type::Quantity { .. });
        match value {
            Value::Num(_) if !quantity => 2,
            Value::Instance(_) | Value::Qualified(..) if quantity => 2,
            _ => 0,
        }
    }

    fn no_such_device(
        &mut self,
        lacking: &[(DeclId, Option<matterix_ir::scene::InstanceId>)],
        verb: Span,
        call: &Call,
    ) {
        let Some(&(owner, device)) = lacking.first() else { return };
        let capability = self.lab.tables.kind_name(owner).to_string();
        let able: Vec<String> = lacking
            .iter()
            .flat_map(|(o, _)| self.lab.instances_of(*o).to_vec())
            .map(|i| self.lab.instances[i.0 as usize].name.clone())
            .take(3)
            .collect();
        let kinds = self.lab.tables.kinds.values().filter(|k| k.is_asset && k.ancestors.contains(&owner));
        let mut kinds: Vec<String> = kinds.map(|k| format!("`{}`", k.name)).collect();
        kinds.sort();
        kinds.truncate(DEVICES_SHOWN);
        let text = self.text(verb);
        let mut d = match device {
            Some(id) => {
                let inst = &self.lab.instances[id.0 as usize];
                let (name, span) = (inst.name.clone(), inst.span);
                let kind = self.lab.kind_names(id);
                Diagnostic::error(
                    codes::WRONG_DEVICE,
                    call.span,
                    format!("`{name}` ({kind}) cannot `{text}`: it is not a {capability}"),
                    format!("needs a {capability}"),
                )
                .because(span, format!("`{name}` is declared here"))
            }
            None => Diagnostic::error(
                codes::WRONG_DEVICE,
                call.span,
                format!("`{text}` needs a device of the kind {capability}"),
                "which device?",
            ),
        };
        d.help.extend(near::question(&able));
        if able.is_empty() && !kinds.is_empty() {
            d = d.help(format!("devices that can: {}", kinds.join(", ")));
        }
        self.lab.report(d);
    }

    /// The device a command is for: the object where the verb takes no first argument and there is one, else the one
    /// after `by`.
    pub(super) fn device(
        &mut self,
        sig: &Sig,
        object: &Option<(Value, Span)>,
        call: &'a Call,
        scope: &mut Scope,
    ) -> Option<matterix_ir::scene::InstanceId> {
        let value = if sig.params.is_empty() && object.is_some() {
            object.as_ref().map(|o| o.0.clone())
        } else {
            let by = call.labelled.iter().find(|(l, _)| l.text == "by")?;
            Some(self.lab.expr(&by.1, scope))
        };
        match value {
            Some(Value::Instance(i) | Value::Qualified(i, _)) => Some(i),
            _ => None,
        }
    }

    /// Arguments in the words of a signature. `device` stands for a command, whose `by` may name the device.
    #[allow(clippy::too_many_arguments)]
    pub fn bind_arguments(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        module: usize,
        call: &'a Call,
        object: Option<(Value, Span)>,
        device: bool,
        scope: &mut Scope,
    ) -> Option<Bound> {
        let mut values = Vec::new();
        let mut good = true;
        let what = verb_text(&sig.verb);
        let by = !sig.params.is_empty() || object.is_none();
        match (sig.params.first(), object) {
            (Some(_), Some((v, span))) => good &= self.group(&what, &sig.params, v, span, module, &mut values),
            (Some(p), None) => {
                let ty = p.ty.as_ref().map(|t| self.lab.resolve_parameter_type(t, module));
                let wanted = ty.map_or_else(|| p.name.text.clone(), |t| self.lab.tables.type_name(&t));
                self.lab.report(Diagnostic::about(
                    &what,
                    codes::WRONG_ARGUMENTS,
                    call.span,
                    format!("`{what}` needs {wanted} after it"),
                    format!("`{}` is missing", p.name.text),
                ));
                good = false;
            }
            (None, Some((_, span))) if !device => {
                self.lab.report(Diagnostic::about(
                    &what,
                    codes::WRONG_ARGUMENTS,
                    span,
                    format!("`{what}` takes no arguments"),
                    "not expected",
                ));
                good = false;
            }
            _ => {}
        }
        let mut unknown = false;
        for (i, (label, e)) in call.labelled.iter().enumerate() {
            if call.labelled[..i].iter().any(|(l, _)| l.text == label.text) {
                self.lab.report(Diagnostic::about(
                    &label.text,
                    codes::WRONG_ARGUMENTS,
                    label.span.to(e.span),
                    format!("`{}` is given twice", label.text),
                    "given again here",
                ));
                good = false;
                continue;
            }
            let group = sig.labelled.iter().find(|(l, _)| l.text == label.text);
            match group.map(|(_, params)| params.as_slice()) {
                Some([p]) if p.of.is_some() => {}
                Some([p]) => good &= self.argument_of(p, e, module, scope, &mut values),
                Some(params) => match &*e.kind {
                    ExprKind::Tuple(items, None) if items.len() == params.len() => {
                        for (p, e) in params.iter().zip(items) {
                            good &= self.argument_of(p, e, module, scope, &mut values);
                        }
                    }
                    _ => {
                        let v = self.lab.expr(e, scope);
                        good &= self.group(&what, params, v, e.span, module, &mut values);
                    }
                },
                None if device && label.text == "by" && by => {}
                None => {
                    let v = self.lab.expr(e, scope);
                    unknown = true;
                    good = false;
                    if v != Value::Error {
                        let missing = missing_label(sig, call, device && by);
                        self.unknown_label(sig, label, e.span, missing);
                    }
                }
            }
        }
        for (label, params) in &sig.labelled {
            let Some(p) = params.first() else { continue };
            // A label that is not known may be meant for the one that is missing.
            if unknown || call.labelled.iter().any(|(l, _)| l.text == label.text) {
                continue;
            }
            match &p.default {
                Some(_) if p.of.is_some() => {}
                Some(_) if params.iter().all(|p| p.default.is_some()) => {
                    for (p, e) in params.iter().filter_map(|p| Some((p, p.default.as_ref()?))) {
                        good &= self.argument_of(p, e, module, &mut Scope::module(module), &mut values);
                    }
                }
                _ => {
                    let ty = p.ty.as_ref().map(|t| self.lab.resolve_parameter_type(t, module));
                    let wanted = ty.map_or_else(|| p.name.text.clone(), |t| self.lab.tables.type_name(&t));
                    self.lab.report(
                        Diagnostic::about(
                            &what,
                            codes::WRONG_ARGUMENTS,
                            call.span,
                            format!("`{what}` needs `{} ...`: {wanted}", label.text),
                            format!("`{}` is missing", label.text),
                        )
                        .help(format!("its form is `{}`", self.form(sig))),
                    );
                    good = false;
                }
            }
        }
        // Behind the others, as they may name functions of what another argument is.
        for (label, params) in &sig.labelled {
            let [p @ Param { of: Some(of), .. }] = params.as_slice() else { continue };
            let given = call.labelled.iter().find(|(l, _)| l.text == label.text).map(|(_, e)| e);
            let thing = values.iter().find(|(name, _)| *name == of.text).map(|(_, value)| value.clone());
            good &= match (given, &p.default) {
                (Some(e), _) => self.argument_about(p, e, module, thing, scope, &mut values),
                (None, Some(e)) => self.argument_about(p, e, module, thing, &mut Scope::module(module), &mut values),
                (None, None) => true,
            };
        }
        good &= self.options(&what, clauses, module, &call.options, call.span, scope, &mut values);
        // In the order of declaration, whatever the call's: what has been worked out for one call is known again by where arguments stand.
        let options = clauses.iter().filter_map(|c| match &c.kind {
            ClauseKind::Option(p) => Some(p.name.text.as_str()),
            _ => None,
        });
        let declared: Vec<&str> = sig.all_params().map(|p| p.name.text.as_str()).chain(options).collect();
        values.sort_by_key(|(name, _)| declared.iter().position(|known| known == name));
        good.then_some(Bound { values })
    }

    /// An argument in which the names of functions of one thing stand for what they are of that: `bottom + 2 mm` of a well.
    fn argument_about(
        &mut self,
        p: &'a Param,
        e: &'a Expr,
        module: usize,
        thing: Option<Value>,
        scope: &mut Scope,
        out: &mut Vec<(String, Value)>,
    ) -> bool {
        let mut inner = scope.clone();
        let first = match thing {
            Some(Value::List(all)) => all.first().cloned(),
            other => other,
        };
        for name in names_of(e).into_iter().collect::<BTreeSet<_>>() {
            let Some(id) = self.lab.tables.names.lookup(module, name) else { continue };
            let is_of_one =
                matches!(&self.lab.tables.names.decl(id).item.kind, ItemKind::Fn { params, .. } if params.len() == 1);
            if let Some(thing) = first.clone().filter(|_| is_of_one)
                && let Some(value) = self.lab.call_with(id, vec![thing])
            {
                inner.bind(name, value);
            }
        }
        let good = self.argument_of(p, e, module, &mut inner, out);
        scope.note_reads_of(&inner);
        good
    }

    /// The value of a pair of brackets of a signature: for several parameters a tuple of as many.
    fn group(
        &mut self,
        what: &str,
        params: &'a [Param],
        v: Value,
        span: Span,
        module: usize,
        out: &mut Vec<(String, Value)>,
    ) -> bool {
        match (params, v) {
            ([p], v) => self.argument(p, v, span, module, out),
            (_, Value::Error) => false,
            (many, Value::Tuple(items)) if items.len() == many.len() => {
                let mut good = true;
                for (p, v) in many.iter().zip(items) {
                    good &= self.argument(p, v, span, module, out);
                }
                good
            }
            (many, v) => {
                let names: Vec<&str> = many.iter().map(|p| p.name.text.as_str()).collect();
                let found = match &v {
                    Value::Tuple(items) => format!("{} values", items.len()),
                    other => other.what().to_string(),
                };
                let headline = format!("`{what}` takes {} values here, found {found}", many.len());
                let d = Diagnostic::about(what, codes::WRONG_ARGUMENTS, span, headline, format!("this is {found}"));
                self.lab.report(d.help(format!("write them in brackets: `({})`", names.join(", "))));
                false
            }
        }
    }

    fn argument(&mut self, p: &'a Param, v: Value, span: Span, module: usize, out: &mut Vec<(String, Value)>) -> bool {
        let v = match &p.ty {
            Some(ty) => {
                let ty = self.lab.resolve_parameter_type(ty, module);
                self.lab.coerce(v, &ty, span, &p.name.text)
            }
            None => v,
        };
        let good = v != Value::Error;
        out.push((p.name.text.clone(), v));
        good
    }

    /// An argument as it is written in the call or in the declaration.
    fn argument_of(
        &mut self,
        p: &'a Param,
        e: &'a Expr,
        module: usize,
        scope: &mut Scope,
        out: &mut Vec<(String, Value)>,
    ) -> bool {
        let ty = p.ty.as_ref().map_or(Type::Any, |ty| self.lab.resolve_parameter_type(ty, module));
        let v = self.lab.hinted(e, &ty, scope);
        self.argument(p, v, e.span, module, out)
    }

    fn unknown_label(&mut self, sig: &Sig, label: &Name, span: Span, missing: Option<&str>) {
        let headline = format!("`{}` does not take `{}`", verb_text(&sig.verb), label.text);
        let mut d = Diagnostic::about(
            &verb_text(&sig.verb),
            codes::WRONG_ARGUMENTS,
            label.span.to(span),
            headline,
            "not expected",
        );
        if let Some(missing) = missing {
            d.help.push(format!("did you mean `{missing}`?"));
            d = d.guess(format!("replace with `{missing}`"), label.span, missing);
        }
        self.lab.report(d.help(format!("its form is `{}`", self.form(sig))));
    }

    /// The call form of a signature: `place ITEM on TARGET by ARM`.
    pub fn form(&self, sig: &Sig) -> String {
        let mut out = verb_text(&sig.verb);
        let mut add = |text: String| {
            out.push(' ');
            out.push_str(&text);
        };
        let shown = |params: &[Param]| {
            let names: Vec<String> = params.iter().map(|p| p.name.text.to_uppercase()).collect();
            if names.len() > 1 { format!("({})", names.join(", ")) } else { names.concat() }
        };
        if !sig.params.is_empty() {
            add(shown(&sig.params));
        }
        for (label, params) in &sig.labelled {
            add(label.text.clone());
            add(shown(params));
        }
        out
    }

    #[allow(clippy::too_many_arguments)]
    fn options(
        &mut self,
        what: &str,
        clauses: &'a [Clause],
        module: usize,
        given: &'a [NamedExpr],
        span: Span,
        scope: &mut Scope,
        out: &mut Vec<(String, Value)>,
    ) -> bool {
        let declared: Vec<&'a Param> = clauses
            .iter()
            .filter_map(|c| match &c.kind {
                crate::ast::ClauseKind::Option(p) => Some(p),
                _ => None,
            })
            .collect();
        let mut good = true;
        for o in given {
            match declared.iter().find(|p| p.name.text == o.name.text) {
                Some(p) => good &= self.argument_of(p, &o.value, module, scope, out),
                None => {
                    let near = near::nearest(&o.name.text, declared.iter().map(|p| &p.name.text));
                    let mut d = Diagnostic::about(
                        what,
                        codes::WRONG_ARGUMENTS,
                        o.name.span,
                        format!("`{what}` has no option `{}`", o.name.text),
                        "not an option",
                    );
                    d = near::proposed(d, &near, o.name.span);
                    self.lab.report(d);
                    good = false;
                }
            }
        }
        let misspelt = given.iter().any(|o| !declared.iter().any(|p| p.name.text == o.name.text));
        for p in declared {
            if misspelt || given.iter().any(|o| o.name.text == p.name.text) {
                continue;
            }
            match &p.default {
                Some(e) => good &= self.argument_of(p, e, module, &mut Scope::module(module), out),
                None => {
                    self.lab.report(
                        Diagnostic::about(
                            what,
                            codes::WRONG_ARGUMENTS,
                            span,
                            format!("`{what}` needs the option `{}`", p.name.text),
                            "no default",
                        )
                        .help(format!("add `{{ {}: ... }}` at the end of the call", p.name.text)),
                    );
                    good = false;
                }
            }
        }
        good
    }

    fn skill(
        &mut self,
        id: DeclId,
        call: &'a Call,
        object: Option<(Value, Span)>,
        span: Span,
        scope: &mut Scope,
    ) -> Option<(StepId, Option<Value>)> {
        let decl = self.lab.tables.names.decl(id);
        let ItemKind::Skill { sig, clauses, body, handlers, .. } = &decl.item.kind else { return None };
        let mut bound = self.bind_arguments(sig, clauses, decl.module, call, object, false, scope)?;
        // An argument is what it is when the skill is called, whatever the skill changes.
        let kept = self.keep_arguments(&mut bound, span, |this, value| body.is_some() || this.asks_a_device(value));
        let mut inner = Scope::module(decl.module);
        for (name, v) in &bound.values {
            inner.bind(name.clone(), v.clone());
        }
        let label = self.call_label((sig, &bound), (call, scope), None).unwrap_or_else(|| self.text(span));
        let Some(body) = body else {
            let step = self.primitive(sig, clauses, &bound, &label, span, &mut inner)?;
            return Some((self.after(kept, label, span, step), None));
        };
        if let Some((verb, at)) = self.lab.ring(&self.open, id) {
            self.lab.report(
                Diagnostic::error(
                    codes::CIRCULAR,
                    at,
                    format!("the skill `{verb}` calls itself"),
                    "this calls the same skill again",
                )
                .help("use `repeat` to repeat steps"),
            );
            return None;
        }
        if self.lab.prototype && !self.written.insert(id) {
            return Some(self.stood_in(sig, clauses, decl.module, label, span));
        }
        self.open.push(id);
        self.lab.calls.push(call.span);
        let result = self.skill_body(sig, clauses, body, handlers, &label, span, &mut inner);
        self.lab.calls.pop();
        self.open.pop();
        let (step, value) = result?;
        Some((self.after(kept, label, span, step), value))
    }

    /// Takes those arguments that `when` names as they are when the call begins.
    pub(super) fn keep_arguments(
        &mut self,
        bound: &mut Bound,
        span: Span,
        when: impl Fn(&Self, &Value) -> bool,
    ) -> Vec<StepId> {
        let mut kept = Vec::new();
        for (name, value) in &mut bound.values {
            if self.is_kept(value) || !when(self, value) {
                continue;
            }
            let (now, steps) = self.keep(name, std::mem::replace(value, Value::Error), span);
            *value = now;
            kept.extend(steps);
        }
        kept
    }

    /// A step after those that keep its arguments.
    pub(super) fn after(&mut self, mut kept: Vec<StepId>, label: String, span: Span, step: StepId) -> StepId {
        if kept.is_empty() {
            return step;
        }
        kept.push(step);
        self.add(label, span, Step::Sequence(kept))
    }

    /// What stands for the steps of a skill that is called again while another one is checked by itself: the failures that it declares, and
    /// any result of its type. Its steps were written out at the first call, which is enough to find a skill that calls itself.
    fn stood_in(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        module: usize,
        label: String,
        span: Span,
    ) -> (StepId, Option<Value>) {
        let mut raised = Vec::new();
        for clause in clauses {
            let ClauseKind::Fails(names) = &clause.kind else { continue };
            for name in names {
                let fail = Step::Fail { name: name.text.clone(), text: Text::default() };
                raised.push(self.add(label.clone(), span, fail));
            }
        }
        let value = sig.result.as_ref().map(|ty| {
            let ty = self.lab.resolve_type(ty, module);
            self.lab.placeholder(&ty, "result")
        });
        (self.add(label, span, Step::Sequence(raised)), value)
    }

    #[allow(clippy::too_many_arguments)]
    pub(super) fn skill_body(
        &mut self,
        sig: &'a Sig,
        clauses: &'a [Clause],
        body: &'a Block,
        handlers: &'a Handlers,
        label: &str,
        span: Span,
        inner: &mut Scope,
    ) -> Option<(StepId, Option<Value>)> {
        let slot = sig.result.as_ref().map(|ty| {
            let ty = self.lab.resolve_type(ty, inner.module);
            let unit = self.lab.type_unit(&ty);
            let local = self.local(label, unit);
            ResultSlot { ty, local, value: None }
        });
        let declares = slot.is_some();
        self.results.push(slot);
        let outer_handlers = std::mem::take(&mut self.handlers);
        let said = std::mem::take(&mut self.said);
        let asked = self.asked(sig, clauses, inner);
        let (needs, invariants, promises, takes) = self.contract(clauses, inner);
        let needs: Vec<_> = asked.into_iter().chain(needs).collect();
        // What can never begin is written out in silence: its steps may make no sense, but what they would change is not known
        // behind it. What is in the sources is known only once all steps are.
        let never = !self.lab.prototype && needs.iter().any(|n| self.lab.graph.constant(n.node) == Some(0.0));
        let sound = never.then_some(self.lab.diagnostics.len());
        let steps = self.block(body, inner);
        if let Some(sound) = sound {
            self.lab.diagnostics.truncate(sound);
        }
        let needs: Vec<_> = said.into_iter().map(Arc::new).chain(needs).collect();
        let verb = verb_text(&sig.verb);
        let step = Step::Skill { verb: verb.clone(), needs, invariants, promises, takes, body: steps };
        let id = self.add(label, span, step);
        // Outside the skill's node, so that a retry looks at its needs again.
        let id = self.with_handlers(label, span, id, handlers, inner);
        self.handlers = outer_handlers;
        let slot = self.results.pop().flatten();
        let value = slot.and_then(|s| s.value);
        if declares && value.is_none() {
            self.lab.report(Diagnostic::error(
                codes::MISPLACED,
                sig.span,
                format!("the skill `{verb}` declares a result but does not `return` one"),
                "returns no result",
            ));
        }
        Some((id, value))
    }

    /// Arguments as a driver sees them.
    pub fn driver_arguments(&mut self, bound: &Bound) -> Vec<(String, Argument)> {
        if self.draft {
            return Vec::new();
        }
        bound
            .values
            .iter()
            .filter_map(|(name, v)| {
                let argument = match v {
                    Value::Num(n) => Argument::Quantity(n.node, self.lab.unit_of(n)),
                    Value::Instance(i) | Value::Qualified(i, _) => Argument::Instance(*i),
                    Value::Frame(i, frame) if frame.is_empty() => Argument::Instance(*i),
                    Value::Frame(i, frame) => {
                        Argument::Text(format!("{}.{frame}", self.lab.instances[i.0 as usize].name))
                    }
                    Value::List(items) => {
                        let one = |v: &Value| match v {
                            Value::Instance(i) | Value::Qualified(i, _) => Some(*i),
                            _ => None,
                        };
                        Argument::Instances(items.iter().map(one).collect::<Option<_>>()?)
                    }
                    Value::Text(t) => Argument::Text(t.clone()),
                    Value::Enum(node, words) => Argument::Word(*node, words.to_vec()),
                    _ => return None,
                };
                Some((name.clone(), argument))
            })
            .collect()
    }
}

/// The name that an expression is, if it is nothing more.
fn name_or_nothing(e: &Expr) -> Name {
    match &*e.kind {
        ExprKind::Name(n) => n.clone(),
        _ => Name { text: String::new(), span: e.span },
    }
}

fn has_label(sig: &Sig, label: &Name) -> bool {
    sig.labelled.iter().any(|(own, _)| own.text == label.text)
}

/// How badly a call's labels fit a signature; `by` may name the device.
fn misfit(sig: &Sig, call: &Call, by: bool) -> usize {
    let named = |l: &str| sig.labelled.iter().any(|(s, _)| s.text == l) || (by && l == "by");
    let unknown = call.labelled.iter().filter(|(l, _)| !named(&l.text)).count();
    let missing = sig
        .labelled
        .iter()
        .filter(|(l, p)| {
            !call.labelled.iter().any(|(c, _)| c.text == l.text) && p.first().is_some_and(|p| p.default.is_none())
        })
        .count();
    unknown + missing
}

/// What the one word of a call that its form does not have is meant for: the one label that is missing.
fn missing_label<'s>(sig: &'s Sig, call: &Call, by: bool) -> Option<&'s str> {
    let known = |label: &str| sig.labelled.iter().any(|(l, _)| l.text == label) || by && label == "by";
    let given = |label: &str| call.labelled.iter().any(|(l, _)| l.text == label);
    let mut missing =
        sig.labelled.iter().filter(|(l, params)| !given(&l.text) && params.iter().any(|p| p.default.is_none()));
    let (label, _) = missing.next()?;
    let alone = missing.next().is_none() && call.labelled.iter().filter(|(l, _)| !known(&l.text)).count() == 1;
    alone.then_some(label.text.as_str())
}
