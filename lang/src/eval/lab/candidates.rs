//! Who a condition can hold for, read off its form, before it is written out for anybody: `touching(a, b)` holds for what stands on `a`
//! or bears it, and there are few of these among a thousand.
//!
//! What is found may be too many, never too few: for all others the condition is false whatever the run does. A form that says nothing
//! of it leaves all.

use std::collections::BTreeSet;

use matterix_ir::scene::InstanceId;

use crate::ast::{Arg, Binary, Expr, ExprKind, ItemKind, Param};
use crate::eval::lab::Elaborator;
use crate::eval::{Scope, Value};
use crate::names::DeclId;

/// Instances that a condition can hold for.
pub type Candidates = BTreeSet<InstanceId>;

/// Calls in calls that are looked into.
const DEEPEST: usize = 8;

/// What the name that is asked about is called where an expression stands, and what the other names there mean.
struct Place<'s> {
    variable: &'s str,
    scope: &'s Scope,
    depth: usize,
}

/// What an expression is to the name that is asked about.
enum Side<'a> {
    /// The name.
    Variable,
    /// A member of it.
    Member(&'a str),
    /// These, whatever the name stands for; -1 is `nothing`.
    Targets(BTreeSet<i64>),
    /// Anything else.
    FreeParameters,
}

impl<'a> Elaborator<'a> {
    /// Who a condition can hold for as `variable`; nothing where its form does not say.
    pub(crate) fn candidates(&mut self, condition: &'a Expr, variable: &str, scope: &Scope) -> Option<Candidates> {
        if self.prototype || self.mode().at_start {
            return None;
        }
        #[cfg(test)]
        if tests::asks_everybody() {
            return None;
        }
        self.can_hold(condition, &Place { variable, scope, depth: 0 })
    }

    /// Who what is folded can come out for in another way than for anybody else, where the form says so: a sum over all bodies of what is
    /// zero for those that stand elsewhere asks those that stand here.
    pub(crate) fn folded(&mut self, fold: &str, body: &'a Expr, variable: &str, scope: &Scope) -> Option<Candidates> {
        let ExprKind::Call(callee, args) = &*body.kind else {
            return if fold == "any" { self.candidates(body, variable, scope) } else { None };
        };
        match (fold, args.as_slice()) {
            ("sum" | "max" | "min", [condition, _, otherwise]) if self.is_external(callee, "choose", scope) => {
                if args.iter().any(|a| a.name.is_some()) {
                    return None;
                }
                let neutral = match &*otherwise.value.kind {
                    ExprKind::Quantity(v, _) | ExprKind::Number(v) => fold != "sum" || *v == 0.0,
                    _ => false,
                };
                if neutral { self.candidates(&condition.value, variable, scope) } else { None }
            }
            ("any", _) => self.candidates(body, variable, scope),
            _ => None,
        }
    }

    fn can_hold(&mut self, e: &'a Expr, place: &Place<'_>) -> Option<Candidates> {
        match &*e.kind {
            ExprKind::Binary(Binary::And, a, b) => match (self.can_hold(a, place), self.can_hold(b, place)) {
                (Some(a), Some(b)) => Some(a.intersection(&b).copied().collect()),
                (a, b) => a.or(b),
            },
            ExprKind::Binary(Binary::Or, a, b) => {
                let mut all = self.can_hold(a, place)?;
                all.extend(self.can_hold(b, place)?);
                Some(all)
            }
            ExprKind::Binary(Binary::Eq, a, b) => match (self.side(a, place), self.side(b, place)) {
                (Side::Variable, Side::Targets(all)) | (Side::Targets(all), Side::Variable) => {
                    Some(all.iter().filter_map(|n| u32::try_from(*n).ok()).map(InstanceId).collect())
                }
                (Side::Member(name), Side::Targets(all)) | (Side::Targets(all), Side::Member(name)) => {
                    let pointing = self.pointing(name);
                    let those = all.iter().filter_map(|n| pointing.at.get(n)).flatten();
                    Some(those.chain(&pointing.anywhere).copied().collect())
                }
                _ => None,
            },
            ExprKind::Call(callee, args) => self.call_can_hold(callee, args, place),
            ExprKind::Fold { fold, var, set, body } if fold.text == "any" && var.text != place.variable => {
                self.any_can_hold(&var.text, set, body, place)
            }
            _ => None,
        }
    }

    /// Who `f(a, b)` can hold for, by what stands in its definition and by what a lab gives for pairs.
    fn call_can_hold(&mut self, callee: &'a Expr, args: &'a [Arg], place: &Place<'_>) -> Option<Candidates> {
        let (id, params, body) = self.definition(callee, place)?;
        if place.depth >= DEEPEST || args.len() > params.len() {
            return None;
        }
        let mut scope = Scope::module(self.tables.names.decl(id).module);
        let mut variable = None;
        for (position, arg) in args.iter().enumerate() {
            let param = match &arg.name {
                Some(name) => params.iter().find(|p| p.name.text == name.text)?,
                None => params.get(position)?,
            };
            match self.side(&arg.value, place) {
                Side::Variable if variable.is_none() => variable = Some(param.name.text.as_str()),
                Side::Variable => return None,
                Side::Targets(one) if one.len() == 1 => {
                    let one = one.first().and_then(|n| u32::try_from(*n).ok());
                    scope.bind(param.name.text.clone(), one.map_or(Value::Nothing, |i| Value::Instance(InstanceId(i))));
                }
                // Whatever it is, it hides what the name means elsewhere.
                _ => scope.bind(param.name.text.clone(), Value::Error),
            }
        }
        let variable = variable?;
        let mut found = match body {
            Some(body) => self.can_hold(body, &Place { variable, scope: &scope, depth: place.depth + 1 })?,
            None => Candidates::new(),
        };
        let name = crate::names::item_name(self.tables.names.decl(id).item).map(|(name, _)| name)?;
        let others: Vec<InstanceId> = scope.vars.iter().filter_map(|(_, v)| v.instance()).collect();
        let ends = self.pairs.iter().filter(|p| p.name == name).flat_map(|p| [(p.a, p.b), (p.b, p.a)]);
        found.extend(ends.filter(|(other, _)| others.is_empty() || others.contains(other)).map(|(_, end)| end));
        Some(found)
    }

    /// What a relation or a function that is written in the language is defined by; no definition where only labs say of what it holds.
    fn definition(&mut self, callee: &'a Expr, place: &Place<'_>) -> Option<(DeclId, &'a [Param], Option<&'a Expr>)> {
        let ExprKind::Name(name) = &*callee.kind else { return None };
        if name.text == place.variable || place.scope.var(&name.text).is_some() {
            return None;
        }
        let id = self.lookup(place.scope.module, &name.text)?;
        match &self.tables.names.decl(id).item.kind {
            ItemKind::Relation { params, definition, .. } => Some((id, params, definition.as_ref())),
            ItemKind::Fn { external: false, params, body: Some(body), .. } => Some((id, params, Some(body))),
            _ => None,
        }
    }

    /// Who `any(v in set: body)` can hold for: by each of a set that does not depend on who it is, or by way of their parts and wholes.
    fn any_can_hold(&mut self, var: &str, set: &'a Expr, body: &'a Expr, place: &Place<'_>) -> Option<Candidates> {
        let ExprKind::Call(callee, args) = &*set.kind else { return None };
        let [of, _] = args.as_slice() else { return None };
        let wholes = self.is_external(callee, "wholes", place.scope);
        if !wholes && !self.is_external(callee, "parts", place.scope) {
            return None;
        }
        match self.side(&of.value, place) {
            Side::Targets(_) => {
                let mut scope = place.scope.clone();
                let items = self.set(set, &mut scope)?;
                let mut all = Candidates::new();
                for item in items {
                    scope.bind(var, item);
                    let found = self.can_hold(body, &Place { scope: &scope, ..*place });
                    scope.vars.pop();
                    all.extend(found?);
                }
                Some(all)
            }
            Side::Variable => {
                let inner = self.can_hold(body, &Place { variable: var, ..*place })?;
                let mut all = Candidates::new();
                for i in inner {
                    if wholes {
                        all.insert(i);
                        self.all_parts(i, &mut all);
                    } else {
                        all.extend(std::iter::successors(Some(i), |i| self.instances[i.0 as usize].owner));
                    }
                }
                Some(all)
            }
            _ => None,
        }
    }

    /// Whether a callee is the function of this name that the compiler provides.
    fn is_external(&mut self, callee: &Expr, called: &str, scope: &Scope) -> bool {
        let ExprKind::Name(name) = &*callee.kind else { return false };
        if name.text != called || scope.var(called).is_some() {
            return false;
        }
        let id = self.lookup(scope.module, called);
        id.is_some_and(|id| matches!(self.tables.names.decl(id).item.kind, ItemKind::Fn { external: true, .. }))
    }

    /// An instance's parts, and theirs.
    fn all_parts(&self, of: InstanceId, out: &mut Candidates) {
        for part in self.instances[of.0 as usize].children() {
            if out.insert(part) {
                self.all_parts(part, out);
            }
        }
    }

    fn side(&mut self, e: &'a Expr, place: &Place<'_>) -> Side<'a> {
        match &*e.kind {
            ExprKind::Name(name) if name.text == place.variable => Side::Variable,
            ExprKind::Name(name) => match place.scope.var(&name.text) {
                Some(Value::Instance(i) | Value::Qualified(i, _)) => Side::Targets([i64::from(i.0)].into()),
                Some(Value::Nothing) => Side::Targets([-1].into()),
                Some(_) => Side::FreeParameters,
                None => match (name.text.as_str(), place.scope.this) {
                    ("nothing", _) => Side::Targets([-1].into()),
                    ("self", Some(this)) => Side::Targets([i64::from(this.0)].into()),
                    (member, Some(this)) => self.member_side(this, member),
                    _ => Side::FreeParameters,
                },
            },
            ExprKind::Member(base, name) => match self.side(base, place) {
                Side::Variable => Side::Member(&name.text),
                Side::Targets(one) if one.len() == 1 => {
                    let of = one.first().and_then(|n| u32::try_from(*n).ok());
                    of.map_or(Side::FreeParameters, |i| self.member_side(InstanceId(i), &name.text))
                }
                _ => Side::FreeParameters,
            },
            _ => Side::FreeParameters,
        }
    }

    /// What a member of an instance may point at.
    fn member_side(&mut self, id: InstanceId, name: &str) -> Side<'a> {
        let members = self.members_of(id, name);
        let [m] = *members else { return Side::FreeParameters };
        self.points_at(id, m).map_or(Side::FreeParameters, Side::Targets)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::atomic::{AtomicBool, Ordering};

    use matterix_ir::Sources;

    use crate::{LibraryOnly, Options, compile};

    /// Nobody is left out: what everything here is compared with. Threads of a compilation see it, so one test alone sets it.
    static EVERYBODY: AtomicBool = AtomicBool::new(false);

    pub(super) fn asks_everybody() -> bool {
        EVERYBODY.load(Ordering::SeqCst)
    }

    /// What comes of a text, as far as who is asked could change it.
    fn outcome(text: &str, everybody: bool) -> (Vec<String>, Vec<String>) {
        EVERYBODY.store(everybody, Ordering::SeqCst);
        let mut sources = Sources::default();
        let file = sources.add("lab.mtx", text);
        let (program, found) = compile(&mut sources, file, &LibraryOnly, &Options::default());
        EVERYBODY.store(false, Ordering::SeqCst);
        let mut model = Vec::new();
        if let Some(program) = program {
            model.extend(program.model.processes.iter().map(|p| p.name.clone()));
            model.extend(program.model.events.iter().map(|e| e.name.clone()));
            model.extend(program.model.dangers.iter().map(|d| d.headline.clone()));
            model.extend(program.model.states.iter().map(|s| s.name.clone()));
            let limits = program.plan.limits.iter().chain(&program.plan.ends);
            model.extend(limits.map(|l| format!("{:?} {}", l.instance, l.condition.text)));
            let started = program.model.states.iter().map(|s| program.model.graph.constant(s.initial));
            model.extend(started.map(|v| format!("{v:?}")));
        }
        (model, found.iter().map(|d| format!("{d:?}")).collect())
    }

    /// Laws between two, asked for in every way that is looked into, and in some that are not.
    const KINDS: &str = "
use std::glassware::Beaker250mL
use std::heating::IkaRetControl
capability Tank { state level: Ratio = 1; param feeds: Tank? = nothing; state joined: Tank? = nothing
    command join to(other: Tank) effect joined = other
    command leave effect joined = nothing }
asset T: Tank { }
capability Rack: Tank { }
asset Twin: Rack { left = T { }, right = T { } }
relation piped(a: Tank, b: Tank)
relation beside(a: Tank, b: Tank) symmetric
relation linked(a: Tank, b: Tank) = a.joined == b or b.joined == a
fn feeding(a, b) -> Bool = a.feeds == b
fn reach(first, second) -> Bool = feeding(second, first) or piped(first, second)
fn holds(a, b) -> Bool = any(p in parts(b, Tank): p == a or p.joined == a)
fn under(a, b) -> Bool = any(w in wholes(a, Rack): w.joined == b)
";

    #[test]
    fn nobody_who_matters_is_left_out() {
        let guards = [
            "piped(a, b)",
            "piped(b, a)",
            "piped(b: a, a: b)",
            "beside(a, b)",
            "linked(a, b)",
            "linked(b, a) and a.level > 0",
            "feeding(a, b)",
            "reach(a, b)",
            "reach(b, a)",
            "holds(a, b)",
            "holds(b, a)",
            "under(a, b)",
            "under(b, a)",
            "a.joined == b",
            "b == a.joined",
            "a.feeds == b or beside(a, b)",
            "not linked(a, b)",
            "a.joined == nothing and b.joined == a",
            "a.joined == b.joined",
            "a.joined != b",
            "any(t in Tank: t.joined == a and t.feeds == b)",
            "any(t in Tank: piped(t, a) and linked(t, b))",
        ];
        let lab = "lab bench {
    ambient: 22 degC
    one = T { feeds: two }
    two = T { joined: three }
    three = T { }
    pair = Twin { joined: one }
    other = Twin { }
    between one and three { piped: true, beside: true }
    between pair.left and two { piped: true }
}
";
        let sums = "capability Sum: Tank { derived heads: Ratio = sum(t in Tank: choose(t.joined == self, t.level, 0)) + max(t in Tank: choose(linked(t, self), 2, 1))
    derived low: Ratio = min(t in Tank: choose(t.feeds == self, t.level, 7)) + choose(any(t in Tank: t.joined == self), 1, 0)
    keeps heads < 100
    process grow { level' += (heads + low) * 0.001 Hz } }
asset S: Sum { }
";
        let mut texts: Vec<String> = Vec::new();
        for guard in guards {
            let law = format!(
                "process law(a: Tank, b: Tank) while {guard} {{ a.level' -= 0.1 Hz * a.level; b.level' += 0.1 Hz * a.level }}"
            );
            let moves = "workflow go in bench { wait 1 s; join two to pair.right; let t = two.joined; join three to one; wait 1 s; leave two; expect one.level > 0 }";
            texts.push(format!("mtx 1\n{KINDS}{law}\n{lab}{moves}\n"));
        }
        let turns =
            "event turn(a: Tank, b: Tank) when a.level < 0.5 and piped(a, b) { a.joined = b.joined; b.joined = a }";
        let summed = lab.replace("three = T { }", "three = S { joined: one }").replace("one = T", "one = S");
        texts.push(format!(
            "mtx 1\n{KINDS}{turns}\n{sums}{summed}workflow go in bench {{ wait 1 s; join one to two }}\n"
        ));
        let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests");
        for folder in ["../examples", "cases", "faults"] {
            let files = std::fs::read_dir(tests.join(folder)).expect("a folder");
            let mut files: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
            files.sort();
            let all = files.iter().filter(|f| f.extension().is_some_and(|e| e == "mtx"));
            let read: Vec<String> = all.map(|f| std::fs::read_to_string(f).expect("text")).collect();
            let between_two = |text: &&String| text.contains("relation ") || text.contains(".support");
            texts.extend(read.iter().filter(|text| folder != "faults" || between_two(text)).cloned());
        }
        let mut processes = 0;
        for text in &texts {
            let (model, found) = outcome(text, false);
            let (expected, expected_found) = outcome(text, true);
            processes += model.iter().filter(|line| line.starts_with("law(")).count();
            assert_eq!(found, expected_found, "{text}");
            assert_eq!(model, expected, "{text}");
        }
        assert!(texts.len() > 50 && processes > 60, "{processes} processes in {} texts", texts.len());
    }
}
