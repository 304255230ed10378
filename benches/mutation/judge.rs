//! What becomes of a mutant.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use matterix_ir::{FileId, Severity, Sources};
use matterix_lang::{Loader, Options};

use crate::behaviour::Behaviour;

/// What became of a mutant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// `check` has an error: its name.
    Check(String),
    /// `check` has a warning that the unchanged text does not have: its name.
    Warned(String),
    /// The run fails, or an expectation does.
    Run(String),
    /// Does what the unchanged text does, at the same times.
    Equivalent,
    /// None of these.
    Survived,
}

/// An unchanged file.
pub struct Original {
    name: String,
    dir: PathBuf,
    workflows: Vec<String>,
    warnings: BTreeMap<&'static str, usize>,
    runs: Vec<Behaviour>,
}

impl Original {
    /// A file that checks without errors and whose workflows pass, or why it is not one.
    pub fn new(path: &Path, text: &str, workflows: &[&str]) -> Result<Self, String> {
        let mut file = Original {
            name: path.display().to_string(),
            dir: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            workflows: workflows.iter().map(ToString::to_string).collect(),
            warnings: BTreeMap::new(),
            runs: Vec::new(),
        };
        if workflows.is_empty() {
            return Err("it has no workflow".to_string());
        }
        file.warnings = file.check(text).map_err(|code| format!("it has an error: {code}"))?;
        file.runs = file.run(text).map_err(|why| format!("it does not pass: {why}"))?;
        Ok(file)
    }

    /// What becomes of a changed text.
    pub fn judge(&self, text: &str) -> Verdict {
        let warnings = match self.check(text) {
            Ok(warnings) => warnings,
            Err(code) => return Verdict::Check(code),
        };
        let runs = match self.run(text) {
            Ok(runs) => runs,
            Err(why) => return Verdict::Run(why),
        };
        if runs.len() == self.runs.len() && runs.iter().zip(&self.runs).all(|(a, b)| a.same(b) && b.same(a)) {
            return Verdict::Equivalent;
        }
        let more = |(code, n): &(&&'static str, &usize)| self.warnings.get(**code).is_none_or(|m| m < n);
        match warnings.iter().find(more) {
            Some((code, _)) => Verdict::Warned(code.to_string()),
            None => Verdict::Survived,
        }
    }

    /// How many warnings of each kind there are, or the first error.
    fn check(&self, text: &str) -> Result<BTreeMap<&'static str, usize>, String> {
        let mut sources = Sources::default();
        let file = sources.add(&self.name, text);
        let mut warnings = BTreeMap::new();
        for d in matterix_lang::check(&mut sources, file, self) {
            match d.severity {
                Severity::Error => return Err(d.code.name.to_string()),
                // Said whether there is a mistake or not.
                Severity::Advice => {}
                Severity::Warning => *warnings.entry(d.code.name).or_default() += 1,
            }
        }
        Ok(warnings)
    }

    /// What each workflow does, or why one does not pass.
    fn run(&self, text: &str) -> Result<Vec<Behaviour>, String> {
        let run = |name: &String| {
            let mut sources = Sources::default();
            let file = sources.add(&self.name, text);
            let options = Options { workflow: Some(name.clone()), ..Options::default() };
            let (program, found) = matterix_lang::compile(&mut sources, file, self, &options);
            let program = program.ok_or_else(|| found.first().map_or("no program", |d| d.code.name).to_string())?;
            let behaviour = Behaviour::of(&program);
            match behaviour.failure.clone() {
                Some(why) => Err(why),
                None => Ok(behaviour),
            }
        };
        self.workflows.iter().map(run).collect()
    }
}

/// Modules and data files next to the file.
impl Loader for Original {
    fn load(&self, _: FileId, module: &str) -> Option<(String, String)> {
        let path = self.dir.join(module.replace("::", "/")).with_extension("mtx");
        std::fs::read_to_string(&path).ok().map(|text| (path.display().to_string(), text))
    }

    fn bytes(&self, _: FileId, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.dir.join(path)).map_err(|e| e.to_string())
    }

    fn file(&self, _: FileId, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.dir.join(path)).map_err(|e| e.to_string())
    }
}
