//! Job shops with published optima, as workflows, through `matterixc plan`.
//!
//! `cargo bench --bench jobshop` prints makespans and times; `-- FT10` takes one instance, `-- --write DIR` writes the
//! workflows only.

mod instances;

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use instances::{ALL, Instance};

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds `--bench`.
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let [flag, dir] = args.as_slice()
        && flag == "--write"
    {
        for instance in ALL {
            file(instance, Path::new(dir))?;
        }
        return Ok(());
    }
    let dir = std::env::temp_dir().join("matterix-jobshop");
    println!("| instance | jobs x machines | list | makespan | optimum | proven | time, s |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for instance in ALL.iter().filter(|i| args.is_empty() || args.iter().any(|a| a == i.name)) {
        let path = file(instance, &dir)?;
        #[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
        let start = Instant::now();
        let limit = ["--time-limit", "300 s", "--format", "json"];
        let out = Command::new(env!("CARGO_BIN_EXE_matterixc")).arg("plan").arg(&path).args(limit).output()?;
        let time = start.elapsed().as_secs_f64();
        let schedule: serde_json::Value = serde_json::from_slice(&out.stdout)?;
        let seconds = |field: &str| schedule[field].as_f64().map_or_else(|| "-".to_owned(), |s| s.to_string());
        println!(
            "| {} | {} x {} | {} | {} | {} | {} | {time:.2} |",
            instance.name,
            instance.jobs.lines().count(),
            instance.machines,
            seconds("list"),
            seconds("makespan"),
            instance.optimum,
            if schedule["optimal"] == true { "yes" } else { "no" },
        );
    }
    Ok(())
}

/// Writes an instance as a workflow.
fn file(instance: &Instance, dir: &Path) -> Result<PathBuf, Box<dyn Error>> {
    fs::create_dir_all(dir)?;
    let path = dir.join(format!("{}.mtx", instance.name.to_lowercase()));
    fs::write(&path, workflow(instance)?)?;
    Ok(path)
}

/// A job is a branch of `parallel`, an operation a claim of its machine.
fn workflow(instance: &Instance) -> Result<String, Box<dyn Error>> {
    let mut out = format!(
        "mtx 1\n//! {}, a job shop of the literature; the shortest schedule takes {} s.\n\n",
        instance.name, instance.optimum
    );
    out.push_str(
        "/// Does one thing at a time.\nasset Machine: Body { mass: 100 kg }\n\nlab shop {\n    ambient: 20 degC\n",
    );
    for machine in 0..instance.machines {
        writeln!(out, "    m{machine} = Machine at ({machine}, 0, 0) m")?;
    }
    out.push_str("}\n\nworkflow jobs in shop {\n    parallel {\n");
    for (job, line) in instance.jobs.lines().enumerate() {
        writeln!(out, "        step job{job} {{")?;
        let words: Vec<&str> = line.split_whitespace().collect();
        for pair in words.chunks_exact(2) {
            writeln!(out, "            claim m{} {{ wait {} s }}", pair[0], pair[1])?;
        }
        out.push_str("        }\n");
    }
    out.push_str("    }\n}\n");
    Ok(out)
}
