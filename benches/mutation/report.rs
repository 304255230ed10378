//! The figures, and who survived.

use serde_json::{Value, json};

use crate::judge::Verdict;
use crate::mutants::{Mutant, Operator};

/// A mutant and what became of it.
pub struct Judged {
    /// Its file.
    pub file: String,
    /// What was done.
    pub mutant: Mutant,
    /// What became of it.
    pub verdict: Verdict,
}

/// How many of some mutants came to which end.
#[derive(Clone, Copy, Default)]
struct Count {
    all: usize,
    check: usize,
    warned: usize,
    run: usize,
    equivalent: usize,
    survived: usize,
}

impl Count {
    fn of<'a>(judged: impl Iterator<Item = &'a Judged>) -> Self {
        let mut count = Count::default();
        for j in judged {
            count.all += 1;
            match j.verdict {
                Verdict::Check(_) => count.check += 1,
                Verdict::Warned(_) => count.warned += 1,
                Verdict::Run(_) => count.run += 1,
                Verdict::Equivalent => count.equivalent += 1,
                Verdict::Survived => count.survived += 1,
            }
        }
        count
    }

    /// Caught of those that are not equivalent, %.
    fn score(self) -> f64 {
        let real = self.all - self.equivalent;
        let caught = self.check + self.warned + self.run;
        if real == 0 { 100.0 } else { 100.0 * caught as f64 / real as f64 }
    }

    fn row(self, name: &str) -> String {
        let Count { all, check, warned, run, equivalent, survived } = self;
        let score = self.score();
        format!("| {name} | {all} | {check} | {warned} | {run} | {equivalent} | {survived} | {score:.1} % |")
    }

    fn json(self) -> Value {
        let Count { all, check, warned, run, equivalent, survived } = self;
        json!({ "all": all, "check": check, "warned": warned, "run": run, "equivalent": equivalent,
            "survived": survived, "score": self.score() })
    }
}

/// Rows by file, by operator and in all. Statements that judge are counted apart: what is done is the same without them.
fn rows(judged: &[Judged]) -> Vec<(String, Count)> {
    let acts = || judged.iter().filter(|j| !j.mutant.judges);
    let mut files: Vec<&str> = judged.iter().map(|j| j.file.as_str()).collect();
    files.dedup();
    let by_file = files.iter().map(|f| (f.to_string(), Count::of(acts().filter(|j| j.file == *f))));
    let by_operator =
        Operator::ALL.iter().map(|o| (o.name().to_string(), Count::of(acts().filter(|j| j.mutant.operator == *o))));
    let judges = Count::of(judged.iter().filter(|j| j.mutant.judges));
    let last = [("all".to_string(), Count::of(acts())), ("(statements that judge or tell)".to_string(), judges)];
    by_file.chain(by_operator).chain(last).collect()
}

/// Tables and survivors to read.
pub fn human(judged: &[Judged]) -> String {
    let mut out = String::from("| of | mutants | check | warning | run | equivalent | survived | score |\n");
    out += "| --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (name, count) in rows(judged) {
        out += &count.row(&name);
        out += "\n";
    }
    out += "\nSurvivors:\n";
    for j in survivors(judged) {
        let Mutant { operator, line, before, after, .. } = &j.mutant;
        out += &format!("{}:{line} {}: `{before}` -> `{after}`\n", j.file, operator.name());
    }
    out
}

fn survivors(judged: &[Judged]) -> impl Iterator<Item = &Judged> {
    judged.iter().filter(|j| !j.mutant.judges && j.verdict == Verdict::Survived)
}

/// The same for programs, with every mutant.
pub fn machine(judged: &[Judged]) -> Value {
    let verdict = |v: &Verdict| match v {
        Verdict::Check(code) => ("check", code.clone()),
        Verdict::Warned(code) => ("warned", code.clone()),
        Verdict::Run(why) => ("run", why.clone()),
        Verdict::Equivalent => ("equivalent", String::new()),
        Verdict::Survived => ("survived", String::new()),
    };
    let mutants = judged.iter().map(|j| {
        let Mutant { operator, line, before, after, judges, .. } = &j.mutant;
        let (verdict, by) = verdict(&j.verdict);
        json!({ "file": j.file, "line": line, "operator": operator.name(), "before": before, "after": after,
            "judges": judges, "verdict": verdict, "by": by })
    });
    let mutants: Vec<Value> = mutants.collect();
    let counts: serde_json::Map<String, Value> = rows(judged).into_iter().map(|(n, c)| (n, c.json())).collect();
    json!({ "counts": counts, "mutants": mutants })
}
