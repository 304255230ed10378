//! Schedules: what `plan` promises and what `run --plan` keeps.

use serde_json::Value;

use crate::harness::{Ended, folder, matterixc, root, write};

/// A shop of three machines; each job is a list of machine and seconds.
fn shop(jobs: &[&[(usize, u32)]]) -> String {
    let mut text = "mtx 1\nasset Machine: Body { mass: 1 kg }\nlab shop {\n    ambient: 20 degC\n".to_string();
    (0..3).for_each(|m| text += &format!("    m{m} = Machine at ({m}, 0, 0) m\n"));
    text += "}\nworkflow jobs in shop {\n    parallel {\n";
    for job in jobs {
        text += "        sequence {\n";
        job.iter().for_each(|(m, t)| text += &format!("            claim m{m} {{ wait {t} s }}\n"));
        text += "        }\n";
    }
    text + "    }\n}\n"
}

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.out).unwrap_or_else(|e| panic!("{e}: {} {}", ended.out, ended.err))
}

fn plan(path: &str) -> Value {
    json(&matterixc(&["plan", path, "--format", "json"]))
}

fn end(path: &str, more: &[&str]) -> f64 {
    let report = json(&matterixc(&[&["run", path, "--format", "json"], more].concat()));
    report["end"].as_f64().unwrap_or_else(|| panic!("{report:#}"))
}

/// The shortest schedule, by trying every order of operations.
fn shortest(jobs: &[&[(usize, u32)]]) -> u32 {
    fn go(jobs: &[&[(usize, u32)]], next: &mut [usize], ready: &mut [u32], free: &mut [u32], best: &mut u32) {
        if (0..jobs.len()).all(|j| next[j] == jobs[j].len()) {
            *best = (*best).min(ready.iter().copied().max().unwrap_or(0));
            return;
        }
        for j in 0..jobs.len() {
            let Some(&(machine, time)) = jobs[j].get(next[j]) else { continue };
            let (was_ready, was_free) = (ready[j], free[machine]);
            let end = was_ready.max(was_free) + time;
            if end >= *best {
                continue;
            }
            (ready[j], free[machine]) = (end, end);
            next[j] += 1;
            go(jobs, next, ready, free, best);
            next[j] -= 1;
            (ready[j], free[machine]) = (was_ready, was_free);
        }
    }
    let mut best = u32::MAX;
    go(jobs, &mut vec![0; jobs.len()], &mut vec![0; jobs.len()], &mut [0; 3], &mut best);
    best
}

#[test]
fn small_shops_get_their_shortest_schedule_and_a_run_keeps_it() {
    let dir = folder("plan_shops");
    let shops: [&[&[(usize, u32)]]; 4] = [
        &[&[(0, 3), (1, 2), (2, 2)], &[(0, 2), (2, 1), (1, 4)], &[(1, 4), (2, 3)]],
        &[&[(0, 7), (1, 1)], &[(1, 6), (0, 2), (2, 5)], &[(2, 4), (0, 4), (1, 3)]],
        &[&[(2, 5), (1, 5), (0, 5)], &[(2, 1), (0, 9)], &[(1, 8), (2, 8)], &[(0, 2)]],
        &[&[(0, 1)], &[(0, 1)], &[(0, 1)]],
    ];
    for (index, jobs) in shops.iter().enumerate() {
        let path = write(&dir, &format!("shop{index}.mtx"), shop(jobs));
        let schedule = plan(&path);
        let best = f64::from(shortest(jobs));
        assert_eq!(schedule["makespan"], best, "shop {index}");
        assert_eq!(schedule["optimal"], true);
        assert!(schedule["list"].as_f64().is_some_and(|l| l >= best));
        assert_eq!(end(&path, &["--plan"]), best, "shop {index}");
        let file = write(&dir, &format!("shop{index}.json"), schedule.to_string());
        assert_eq!(end(&path, &[&format!("--plan={file}")]), best, "shop {index}");
    }
}

#[test]
fn samples_that_share_an_arm_and_a_balance_end_when_the_schedule_says() {
    let path = root().join("examples/two_plates.mtx");
    let path = path.to_str().expect("the path is text");
    let schedule = plan(path);
    assert_eq!((&schedule["optimal"], &schedule["trial"]), (&Value::Bool(true), &Value::Bool(true)));
    let makespan = schedule["makespan"].as_f64().expect("a number");
    assert!((end(path, &["--plan"]) - makespan).abs() < 1e-6);
    assert!(end(path, &[]) > makespan + 60.0, "taken as they come, the samples take longer");
}

#[test]
fn a_window_that_asks_for_a_pause_is_kept_by_waiting() {
    let dir = folder("plan_pause");
    // Begun at once, the short step would be over long before the long one frees what it needs next.
    let body = "parallel {
        claim m0 { wait 100 s }
        sequence {
            claim m1 { step short { wait 10 s } }
            claim m0 { within 20 s after short.end { wait 5 s } }
        }
        sequence { claim m2 { wait 1 s }; claim m0 { wait 1 s } }
    }";
    let text = shop(&[]).replace("    parallel {\n    }\n", &format!("    {body}\n"));
    let path = write(&dir, "pause.mtx", text);
    let schedule = plan(&path);
    assert_eq!(end(&path, &["--plan"]), schedule["makespan"].as_f64().expect("a number"));
}

#[test]
fn what_has_no_schedule_and_what_is_none_is_said() {
    let dir = folder("plan_none");
    let body = "step ready { wait 1 s }\n    parallel {
        claim m0 { within 5 min after ready.end { wait 10 min } }
        claim m0 { within 5 min after ready.end { wait 10 min } }
    }";
    let text = shop(&[]).replace("    parallel {\n    }\n", &format!("    {body}\n"));
    let path = write(&dir, "none.mtx", text);
    let ended = matterixc(&["plan", &path]);
    assert_eq!(ended.code, 1);
    assert!(
        ended.err.contains("error[unschedulable]: no schedule of `jobs` keeps all of its time windows"),
        "{}",
        ended.err
    );
    let other = write(&dir, "other.mtx", shop(&[&[(0, 1)], &[(0, 2)]]));
    let schedule = write(&dir, "other.json", matterixc(&["plan", &other, "--format", "json"]).out);
    let path = write(&dir, "third.mtx", shop(&[&[(1, 1), (0, 2)]]).replace("workflow jobs", "workflow others"));
    let ended = matterixc(&["run", &path, &format!("--plan={schedule}")]);
    assert_eq!(ended.code, 2);
    assert!(ended.err.contains("cannot be scheduled: the schedule belongs to another workflow"), "{}", ended.err);
    let broken = write(&dir, "broken.json", "{}");
    assert!(matterixc(&["run", &path, &format!("--plan={broken}")]).err.contains("is not a schedule"));
    assert!(matterixc(&["plan", &path, "--time-limit", "30"]).err.contains("write a time with its unit"));
}

#[test]
fn the_chart_fits_its_width_and_the_picture_is_written() {
    let dir = folder("plan_chart");
    let path = write(&dir, "shop.mtx", shop(&[&[(0, 3), (1, 2)], &[(1, 2), (0, 4)]]));
    let svg = dir.join("shop.svg");
    let ended = matterixc(&["plan", &path, "--svg", svg.to_str().expect("the path is text")]);
    assert_eq!(ended.code, 0, "{}", ended.err);
    assert!(ended.out.lines().all(|l| l.chars().count() <= 100), "{}", ended.out);
    assert!(ended.out.contains("m0  A━") && ended.out.contains("A  branch 1"), "{}", ended.out);
    assert!(std::fs::read_to_string(svg).is_ok_and(|t| t.starts_with("<svg") && t.contains("branch 2")));
}

/// Every field of a JSON object and of the objects in its lists, as in `blocks[].label`.
fn fields(value: &Value, prefix: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                out.push(name.clone());
                fields(value, &name, out);
            }
        }
        Value::Array(list) => list.iter().take(1).for_each(|v| fields(v, &format!("{prefix}[]"), out)),
        _ => {}
    }
}

#[test]
fn every_field_of_a_schedule_is_described_and_none_besides() {
    let path = root().join("examples/two_plates.mtx");
    let mut found = Vec::new();
    fields(&plan(path.to_str().expect("the path is text")), "", &mut found);
    let page = std::fs::read_to_string(root().join("docs/schedule.md")).expect("the page is there");
    let described: Vec<&str> = page
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split('`').next())
        .filter(|f| !f.starts_with("--"))
        .collect();
    assert_eq!(described, found);
}
