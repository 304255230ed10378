//! Figures of a survey: which constructs and codes it has come to, and what it notices.

use std::collections::BTreeMap;
use std::fmt::Write;

use matterix_ir::Severity;

use crate::judge::initial;
use crate::survey::Judged;

/// Letters of the families of checks, as docs/checks.md has them.
const FAMILIES: &[char] = &['V', 'T', 'P', 'C', 'H', 'M', 'R', 'D', 'K', 'E', 'F', 'S', 'U', 'X'];

/// What was counted.
#[derive(Debug, Default)]
pub struct Tally {
    plans: usize,
    executions: usize,
    exhausted: usize,
    clean: usize,
    faulty: usize,
    ran: usize,
    constructs: BTreeMap<&'static str, usize>,
    codes: BTreeMap<&'static str, usize>,
    violations: BTreeMap<&'static str, usize>,
    /// How many plans, and the first of their seeds.
    noticed: BTreeMap<char, (usize, u64)>,
    /// The first seed of all.
    from: Option<u64>,
    /// By signature, how many plans and one seed.
    disagreements: BTreeMap<String, (usize, u64)>,
}

impl Tally {
    /// Takes a plan in.
    pub fn add(&mut self, judged: &Judged) {
        let Judged { seed, plan, verdict } = judged;
        self.plans += 1;
        self.from = Some(self.from.map_or(*seed, |from| from.min(*seed)));
        self.executions += verdict.summary.executions;
        self.exhausted += usize::from(verdict.summary.complete);
        self.clean += usize::from(verdict.clean_without(""));
        self.faulty += usize::from(!verdict.summary.violations.is_empty());
        self.ran += usize::from(verdict.ran);
        let mut constructs: Vec<&'static str> = Vec::new();
        plan.each(&mut |stmt| constructs.push(stmt.kind.construct()));
        if !plan.finally.is_empty() {
            constructs.push("finally");
        }
        count(&mut self.constructs, constructs);
        let told = verdict.findings.iter().filter(|f| f.severity != Severity::Advice).map(|f| f.code);
        count(&mut self.codes, told.collect());
        count(&mut self.violations, verdict.summary.violations.iter().map(|v| v.code).collect());
        for family in FAMILIES {
            let told = verdict.findings.iter().any(|f| initial(f.family) == *family);
            if told && verdict.clean_without(&family.to_string()) && !verdict.summary.violations.is_empty() {
                let noticed = self.noticed.entry(*family).or_insert((0, *seed));
                *noticed = (noticed.0 + 1, noticed.1.min(*seed));
            }
        }
        for d in &verdict.disagreements {
            let known = self.disagreements.entry(format!("{:?} {}", d.sort, d.code)).or_insert((0, *seed));
            known.0 += 1;
            known.1 = known.1.min(*seed);
        }
    }

    /// Whether a family of checks is missed when it is switched off.
    pub fn notices(&self, family: char) -> bool {
        self.noticed.contains_key(&family)
    }

    /// All of it as tables.
    pub fn tables(&self) -> String {
        let mut out = String::new();
        // Writing to a text cannot fail.
        let _ = writeln!(
            out,
            "{} plans, {} executions ({} plans exhausted), {} clean by `check --strict`, {} with a violation, {} run\n",
            self.plans, self.executions, self.exhausted, self.clean, self.faulty, self.ran
        );
        table(&mut out, "construct", "plans", &self.constructs);
        table(&mut out, "code found by `check`", "plans", &self.codes);
        table(&mut out, "violation seen by the interpreter", "plans", &self.violations);
        let _ = writeln!(out, "| family switched off | plans that show it | noticed after |\n| --- | --- | --- |");
        for family in FAMILIES {
            let _ = match self.noticed.get(family) {
                Some((plans, seed)) => {
                    writeln!(out, "| {family} | {plans} | {} plans |", seed - self.from.unwrap_or(0) + 1)
                }
                None => writeln!(out, "| {family} | 0 | not noticed |"),
            };
        }
        out.push('\n');
        let _ = writeln!(out, "| disagreement | plans | seed |\n| --- | --- | --- |");
        for (signature, (plans, seed)) in &self.disagreements {
            let _ = writeln!(out, "| {signature} | {plans} | {seed} |");
        }
        out
    }
}

/// Counts each name once.
fn count(into: &mut BTreeMap<&'static str, usize>, mut names: Vec<&'static str>) {
    names.sort_unstable();
    names.dedup();
    for name in names {
        *into.entry(name).or_default() += 1;
    }
}

fn table<K: std::fmt::Display>(out: &mut String, what: &str, of: &str, rows: &BTreeMap<K, usize>) {
    let _ = writeln!(out, "| {what} | {of} |\n| --- | --- |");
    for (name, n) in rows {
        let _ = writeln!(out, "| {name} | {n} |");
    }
    out.push('\n');
}
