//! `matterixc verify`.

use matterix_judge::{Looked, Verdict};

use crate::args::{RunFormat, VerifyArgs};
use crate::terminal::{Stream, print};
use crate::{Exit, files, record};

/// Judges what a recording says robots did.
pub fn verify(args: &VerifyArgs) -> Exit {
    super::or_complain(attempt(args))
}

/// The verdict; `Err` says in words what is wrong with usage or files.
fn attempt(args: &VerifyArgs) -> Result<Exit, String> {
    if args.recording.join(record::MANIFEST).is_file() {
        return deployed(args);
    }
    if args.recording.join(record::JOURNAL).is_file() {
        let folder = args.recording.display();
        return Err(format!("the record in `{folder}` is not sealed: it has a journal but no `{}`", record::MANIFEST));
    }
    let file = if args.recording.is_dir() { &args.recording.join("recording.mcap") } else { &args.recording };
    let verdict = matterix_judge::judge(&files::read_recording(file)?)
        .map_err(|why| format!("cannot judge `{}`: {why}", file.display()))?;
    let text = match args.format {
        RunFormat::Human => page(&verdict),
        RunFormat::Json => {
            let json = serde_json::to_string_pretty(&verdict).map_err(|e| format!("cannot write the verdict: {e}"))?;
            json + "\n"
        }
    };
    print(Stream::Out, &text);
    Ok(if verdict.wrong.is_empty() { Exit::Fine } else { Exit::Findings })
}

/// Checks the record of a deployment.
fn deployed(args: &VerifyArgs) -> Result<Exit, String> {
    let checked = record::verify(&args.recording)?;
    let text = match args.format {
        RunFormat::Human => {
            let holds = checked.holds.iter().map(|line| format!("{line}\n"));
            let wrong = checked.wrong.iter().map(|line| format!("wrong: {line}\n"));
            holds.chain(wrong).collect::<String>() + &format!("digest {}\n", checked.digest)
        }
        RunFormat::Json => {
            let json = serde_json::to_string_pretty(&checked).map_err(|e| format!("cannot write the verdict: {e}"))?;
            json + "\n"
        }
    };
    print(Stream::Out, &text);
    Ok(if checked.wrong.is_empty() { Exit::Fine } else { Exit::Findings })
}

fn page(verdict: &Verdict) -> String {
    let mut out = String::new();
    for looked in &verdict.looked {
        out += &line(looked);
    }
    for wrong in &verdict.wrong {
        out += &format!("{:>8.2} s  {}\n", wrong.time(), wrong.text());
    }
    let count = verdict.wrong.len();
    out + &match (verdict.looked.len(), count) {
        (0, _) => "no robot motions to judge\n".to_string(),
        (_, 0) => "nothing wrong\n".to_string(),
        (_, 1) => "1 thing wrong\n".to_string(),
        _ => format!("{count} things wrong\n"),
    }
}

fn line(looked: &Looked) -> String {
    let share = |v: f64| format!("{:.0} %", v * 100.0);
    let mut out = format!(
        "{}: moved {:.2} m in {:.1} s, {} configurations; joints at most at {} of their speed",
        looked.robot,
        looked.way,
        looked.moving,
        looked.configurations,
        share(looked.speed)
    );
    if let Some(acceleration) = looked.acceleration {
        out += &format!(", {} of their acceleration", share(acceleration));
    }
    if let Some(jerk) = looked.jerk {
        out += &format!(", {} of their jerk", share(jerk));
    }
    out += &format!("; links off by {:.0e} m", looked.astray);
    if looked.grips > 0 {
        out += &format!("; {} grips, off by {:.2} mm", looked.grips, looked.off * 1e3);
    }
    out + "\n"
}
