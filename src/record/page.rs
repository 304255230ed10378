//! A report for people, with room for their signatures.

use matterix_ir::quantity::show_number;
use matterix_runtime::exec::Verdict;

use super::report::Report;

/// The page.
pub fn page(report: &Report) -> String {
    let about = &report.about;
    let workflow = about.workflow.as_deref().unwrap_or("the workflow");
    let mut out = format!("# Deployment of {workflow} of {}\n\n", cell(&about.main));
    let passed = if report.passed { "passed" } else { "did not pass" };
    out += &format!("It {passed} (`{}`): started {}, ended {}, ", cell(&report.status), report.begun, report.ended);
    out += &format!("{} s of lab time, matterixc {}.\n\n", show_number(report.lab_time), cell(&about.tool));
    out += &format!("Program with its bindings: `{}`\n\n", report.program);
    out += &table(
        "Devices",
        &["device", "driver", "place"],
        about.devices.iter().map(|d| {
            vec![
                d.name.clone(),
                d.driver.clone().unwrap_or_else(|| "a person".into()),
                d.place.clone().unwrap_or_default(),
            ]
        }),
    );
    out +=
        &table("Calibration", &["of", "value"], about.calibration.iter().map(|g| vec![g.of.clone(), g.value.clone()]));
    out += &table(
        "Processes",
        &["begun", "by", "lab time, s", "number"],
        report.processes.iter().map(|p| vec![p.at.clone(), p.who.clone(), show_number(p.lab_time), p.pid.to_string()]),
    );
    out += &table(
        "Questions",
        &["question", "asked", "answer", "by", "answered"],
        report.questions.iter().map(|q| {
            let yes = match q.yes {
                Some(true) => "yes",
                Some(false) => "no",
                None => "none",
            };
            let (who, answered) = (q.who.clone().unwrap_or_default(), q.answered.clone().unwrap_or_default());
            vec![q.text.clone(), q.asked.clone(), yes.into(), who, answered]
        }),
    );
    out += &table(
        "Interventions",
        &["what", "by", "at", "lab time, s"],
        report.interventions.iter().map(|i| vec![i.what.clone(), i.who.clone(), i.at.clone(), show_number(i.lab_time)]),
    );
    out += &table(
        "Commands",
        &["lab time, s", "step", "line", "device", "sent", "outcome"],
        report.commands.iter().map(|c| {
            vec![
                show_number(c.lab_time),
                c.step.clone(),
                c.at.clone(),
                c.device.clone(),
                c.sends.join("; "),
                c.outcome.clone(),
            ]
        }),
    );
    out += &table(
        "Readings, SI",
        &["reading", "count", "first", "last", "least", "greatest"],
        report.readings.iter().map(|r| {
            let numbers = [r.first, r.last, r.least, r.greatest].map(show_number);
            [vec![r.name.clone(), r.count.to_string()], numbers.to_vec()].concat()
        }),
    );
    out += &table(
        "Texts of devices",
        &["lab time, s", "device", "name", "text"],
        report.texts.iter().map(|t| vec![show_number(t.lab_time), t.device.clone(), t.name.clone(), t.text.clone()]),
    );
    out += &table(
        "Asked again",
        &["lab time, s", "device", "why"],
        report.again.iter().map(|a| vec![show_number(a.lab_time), a.device.clone(), a.why.clone()]),
    );
    let held_up = report.held_up.iter().map(|h| [h.lab_time, h.seconds].map(show_number).to_vec());
    out += &table("Paused", &["lab time, s", "for, s by the clock"], held_up);
    out += &table(
        "Behind the clock",
        &["times", "altogether, s", "longest, s", "at lab time, s"],
        report
            .behind
            .iter()
            .map(|b| [vec![b.count.to_string()], [b.total, b.longest, b.at].map(show_number).to_vec()].concat()),
    );
    out += &table(
        "Expectations",
        &["expectation", "lab time, s", "verdict"],
        report.expectations.iter().map(|e| {
            let verdict = match e.verdict {
                Verdict::Passed => "met",
                Verdict::Failed => "not met",
                Verdict::NotObserved => "not observed",
            };
            vec![e.text.clone(), show_number(e.lab_time), verdict.into()]
        }),
    );
    out += &table(
        "Failures",
        &["lab time, s", "code", "what"],
        report.faults.iter().map(|f| vec![show_number(f.lab_time), f.code.clone(), f.text.clone()]),
    );
    out += &table(
        "Made safe",
        &["device", "trouble"],
        report.made_safe.iter().map(|m| vec![m.device.clone(), m.trouble.clone().unwrap_or_else(|| "none".into())]),
    );
    out += "## Signatures\n\n`matterixc verify` of this folder checks that it is complete and unchanged, and replays it; it prints the digest to sign.\n\n";
    out + "Digest: ____________________  Name: ____________________  Date: ____________  Signature: ____________________\n"
}

/// A table with a headline; nothing where it has no rows.
fn table(headline: &str, columns: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows: Vec<String> =
        rows.map(|row| format!("| {} |\n", row.iter().map(|c| cell(c)).collect::<Vec<_>>().join(" | "))).collect();
    if rows.is_empty() {
        return String::new();
    }
    let rule = vec!["---"; columns.len()].join(" | ");
    format!("## {headline}\n\n| {} |\n| {rule} |\n{}\n", columns.join(" | "), rows.concat())
}

/// A text that stays in its cell, and is no markup of the page: people and devices may have said anything.
fn cell(text: &str) -> String {
    let plain: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    plain.replace('\\', "\\\\").replace('|', "\\|").replace('<', "\\<")
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn what_somebody_said_is_no_markup() {
        assert_eq!(cell("Ann | <b>\nx"), "Ann \\| \\<b> x");
        assert_eq!(cell("a\\|b"), "a\\\\\\|b");
    }
}
