//! `matterixc test`.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use matterix_ir::{Diagnostic, Sources};
use serde_json::{Value, json};

use crate::args::{Color, Reality, TestArgs, TestFormat};
use crate::cache;
use crate::pipeline::{self, Input, Test};
use crate::progress::{Kind, Progress};
use crate::report::{Format, Look, Reporter};
use crate::terminal::{self, Stream, paint, print, print_error};
use crate::{Exit, cancel, files};

/// Runs every test of the files, a line each, and counts them; what failed is shown below its line.
pub fn test(args: &TestArgs, color: Color) -> Exit {
    let cancel = match args.reality.agrees(false).and_then(|()| cancel::on_interrupt()) {
        Ok(cancel) => cancel,
        Err(message) => {
            print_error(&message);
            return Exit::Usage;
        }
    };
    let mut exit = Exit::Fine;
    let mut trial = Trial {
        format: args.format,
        look: terminal::look(Stream::Out, color),
        seed: args.seed,
        reality: args.reality,
        cancel,
        passed: 0,
        failed: 0,
        files: 0,
    };
    let found = files::with_extension(&args.paths, "mtx");
    for message in &found.missing {
        print_error(message);
        exit = Exit::Usage;
    }
    for path in &found.files {
        if cancel.load(Ordering::Relaxed) {
            break;
        }
        if let Err(message) = trial.file(path, args.only.as_deref().unwrap_or_default()) {
            print_error(&message);
            exit = Exit::Usage;
        }
    }
    trial.close(found.files.len());
    if cancel.load(Ordering::Relaxed) {
        print_error("stopped before all tests had run");
        return exit.max(Exit::Findings);
    }
    if trial.failed > 0 { exit.max(Exit::Findings) } else { exit }
}

/// How the tests went so far.
struct Trial {
    format: TestFormat,
    look: Look,
    seed: u64,
    reality: Reality,
    /// Set when the user has had enough.
    cancel: &'static AtomicBool,
    passed: usize,
    failed: usize,
    /// Files with tests.
    files: usize,
}

impl Trial {
    fn file(&mut self, path: &Path, wanted: &str) -> Result<(), String> {
        let input = Input::file(path, files::read(path)?);
        let (sources, tests, found) = pipeline::tests(&input, wanted);
        let broken = found.iter().any(Diagnostic::is_error);
        // What cannot be read may have been a test.
        let unread = broken && tests.is_empty() && input.mentions_tests();
        if tests.is_empty() && !unread {
            return Ok(());
        }
        self.files += 1;
        if broken {
            self.failed += usize::from(unread);
            self.show(&sources, found);
        }
        for test in tests {
            if self.cancel.load(Ordering::Relaxed) {
                return Ok(());
            }
            self.run(&input.name, &sources, &test, broken)?;
        }
        Ok(())
    }

    fn run(&mut self, file: &str, sources: &Sources, test: &Test, broken: bool) -> Result<(), String> {
        let Some(mut program) = test.program.clone().filter(|_| !broken) else {
            // What is wrong with the file has been shown; the rest may follow from it.
            let found = if broken { Vec::new() } else { test.diagnostics.clone() };
            self.tell(file, sources, test, None, found);
            return Ok(());
        };
        let choices = self.reality.draw(&mut program, self.seed)?;
        let found = self.reality.look(&program, &*cache::of(false));
        if found.iter().any(Diagnostic::is_error) {
            self.tell(file, sources, test, None, found);
            return Ok(());
        }
        let mut progress = Progress::new(&program.plan, Kind::Quiet);
        let ran = pipeline::run(&program, sources, &choices, self.cancel, &mut progress);
        progress.finish();
        let own = if ran.passed { &test.diagnostics } else { &ran.diagnostics };
        let found = found.into_iter().chain(own.iter().cloned()).collect();
        self.tell(file, sources, test, Some((ran.passed, ran.end_time())), found);
        Ok(())
    }

    /// Counts a test and shows it: whether it passed, with the lab time at its end, and what was found.
    fn tell(&mut self, file: &str, sources: &Sources, test: &Test, ran: Option<(bool, f64)>, found: Vec<Diagnostic>) {
        let passed = ran.is_some_and(|(passed, _)| passed);
        if passed {
            self.passed += 1;
        } else {
            self.failed += 1;
        }
        let line = sources.line_column(test.span).0;
        match self.format {
            TestFormat::Human => {
                let word = if passed { "ok    " } else { "failed" };
                let time = ran.map_or_else(|| "not run".to_string(), |(_, time)| format!("{time:.2} s"));
                print(Stream::Out, &format!("{word}  {file}:{line}: {} ({time})\n", test.name));
                if !found.is_empty() {
                    self.show(sources, found);
                }
            }
            TestFormat::Json => {
                let findings = self.findings(sources, found);
                let time = ran.map(|(_, time)| time);
                let object = json!({ "file": file, "line": line, "test": test.name, "passed": passed, "time": time, "findings": findings });
                print(Stream::Out, &format!("{object}\n"));
            }
        }
    }

    fn show(&self, sources: &Sources, found: Vec<Diagnostic>) {
        if self.format == TestFormat::Human {
            let text = Reporter::new(Format::Human, self.look).render(sources, found);
            paint(Stream::Out, &format!("\n{text}"));
        } else {
            for finding in self.findings(sources, found) {
                print(Stream::Out, &format!("{finding}\n"));
            }
        }
    }

    fn findings(&self, sources: &Sources, found: Vec<Diagnostic>) -> Vec<Value> {
        let text = Reporter::new(Format::Json, self.look).render(sources, found);
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    /// The last line.
    fn close(&self, looked_at: usize) {
        let (passed, failed, files) = (self.passed, self.failed, self.files);
        let count = |n: usize| format!("{n} file{}", if n == 1 { "" } else { "s" });
        let text = match self.format {
            TestFormat::Json => format!("{}\n", json!({ "passed": passed, "failed": failed, "files": files })),
            TestFormat::Human if passed + failed == 0 => format!("no tests in {}\n", count(looked_at)),
            TestFormat::Human => format!("{passed} passed, {failed} failed in {}\n", count(files)),
        };
        print(Stream::Out, &text);
    }
}
