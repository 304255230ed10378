//! Figures of a survey: which constructs and codes it has come to, and what it notices.

use std::collections::BTreeMap;
use std::fmt::Write;

use matterix_ir::Severity;

use crate::judge::initial;
use crate::survey::Judged;

/// Letters of the families of checks, as docs/checks.md has them.
const FAMILIES: &[char] = &['V', 'T', 'P', 'C', 'H', 'R', 'D', 'K', 'F', 'S', 'X'];

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
    noticed: BTreeMap<char, usize>,
    /// By signature, how many plans and one seed.
    disagreements: BTreeMap<String, (usize, u64)>,
}

impl Tally {
    /// Takes a plan in.
    pub fn add(&mut self, judged: &Judged) {
        let Judged { seed, plan, verdict } = judged;
        self.plans += 1;
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
                *self.noticed.entry(*family).or_default() += 1;
            }
        }
        for d in &verdict.disagreements {
            let known = self.disagreements.entry(format!("{:?} {}", d.sort, d.code)).or_insert((0, *seed));
            known.0 += 1;
            known.1 = known.1.min(*seed);
        }
    }

    /// Families of checks that are missed when they are switched off, and how many plans show it.
    pub fn noticed(&self) -> &BTreeMap<char, usize> {
        &self.noticed
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
        let noticed = FAMILIES.iter().map(|f| (*f, self.noticed.get(f).copied().unwrap_or(0))).collect();
        table(&mut out, "family switched off", "plans that show it", &noticed);
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
