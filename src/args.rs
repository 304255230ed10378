//! What can be typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::report::Format;

/// Checks, runs and explains robotic chemistry protocols written in .mtx.
#[derive(Debug, Parser)]
#[command(name = "matterixc", version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = "Exit status: 0 nothing wrong; 1 findings, a failed run or expectation; 2 usage or files.")]
pub struct Cli {
    /// When to use colours.
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto, value_name = "WHEN")]
    pub color: Color,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// When to use colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set.
    Auto,
    /// In every case.
    Always,
    /// In no case.
    Never,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Report what is wrong with files, without running them.
    Check(CheckArgs),
    /// Rewrite files in the one style.
    Fmt(FmtArgs),
    /// Run a workflow on the digital twin and judge its expectations.
    Run(RunArgs),
    /// Explain a diagnostic code, or list them all.
    Explain(ExplainArgs),
    /// Create a small project that checks, runs and passes.
    New(NewArgs),
    /// Print the versions of the command and the language.
    Version,
}

/// `matterixc check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The files.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Form of the findings.
    #[arg(long, value_enum, default_value_t = Format::Human)]
    pub format: Format,
    /// Take warnings for errors.
    #[arg(long)]
    pub strict: bool,
}

/// `matterixc fmt`.
#[derive(Debug, Args)]
pub struct FmtArgs {
    /// The files; `-` reads standard input and writes standard output.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Write nothing; name the files that are not in the style, and fail if there are any.
    #[arg(long, conflicts_with = "stdout")]
    pub check: bool,
    /// Write to standard output, not to the files.
    #[arg(long)]
    pub stdout: bool,
}

/// `matterixc run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The file.
    pub file: PathBuf,
    /// The workflow, where the file has several.
    #[arg(long, value_name = "NAME")]
    pub workflow: Option<String>,
    /// A parameter of the workflow, as written in the language: `--set "target=40 degC"`.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    pub set: Vec<(String, String)>,
    /// Where all randomness of the run starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Where to write recording, table, plots and report; nothing is written without it.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How closely motions are simulated.
    #[arg(long, value_enum, default_value_t = Fidelity::Process)]
    pub fidelity: Fidelity,
    /// Form of the report.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
    /// Walk through the steps without simulating what they cause.
    #[arg(long)]
    pub dry: bool,
}

/// How closely motions are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Fidelity {
    /// Motions take their declared time.
    Process,
}

/// Form of the report of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RunFormat {
    /// A page to read.
    Human,
    /// The contents of `report.json`.
    Json,
}

/// `matterixc explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A code as in `error[CODE]`, or a family such as `U1`; all codes without it.
    pub code: Option<String>,
    /// Print the index of the pages.
    #[arg(long, hide = true)]
    pub index: bool,
}

/// `matterixc new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// The folder to create; if it exists, it must be empty.
    pub dir: PathBuf,
}

fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_string(), value.trim().to_string()))
        }
        _ => Err("write NAME=VALUE, as in \"target=40 degC\"".to_string()),
    }
}
