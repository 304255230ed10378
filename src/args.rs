//! What can be typed.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use matterix_runtime::contact::Really;
use matterix_runtime::motion::Perturbation;
use rmcp::schemars::JsonSchema;
use serde::Deserialize;

use crate::pipeline::{Fixes, Options, Target};

use crate::report::Format;
use crate::report::points::Place;

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
    /// Run the tests of files and judge their expectations.
    Test(TestArgs),
    /// Say what a run uses up and occupies: reagents, tips, vessels, waste, device time.
    Bill(BillArgs),
    /// Run a workflow many times, with what a study varies, and report what becomes of it.
    Study(StudyArgs),
    /// Estimate parameters of a workflow's model from data.
    Fit(FitArgs),
    /// Write a workflow as a protocol that a person can follow by hand.
    Doc(DocArgs),
    /// Schedule a workflow: who has which instance when, so that the whole ends early.
    Plan(PlanArgs),
    /// Carry a workflow out on devices, or say what would be sent to them.
    Deploy(DeployArgs),
    /// Stand in for a device: answer on a line as it would.
    Emulate(EmulateArgs),
    /// Offer the devices of a lab to others, as features of SiLA 2: on the digital twin, or with `--bind` on devices.
    #[cfg(feature = "sila")]
    Serve(ServeArgs),
    /// List the servers of SiLA 2 on the network.
    #[cfg(feature = "sila")]
    Discover(DiscoverArgs),
    /// Write a workflow as a file that another program runs.
    Emit(EmitArgs),
    /// Write a file of another program as a module of the language.
    Import(ImportArgs),
    /// Judge what a recording says robots did: limits, kinematics, contacts of their true shapes, grips.
    Verify(VerifyArgs),
    /// Show a lab, or play a recording, on a page in three dimensions.
    View(ViewArgs),
    /// Answer an editor: a language server on standard input and output.
    Lsp(LspArgs),
    /// Explain a diagnostic code, or list them all.
    Explain(ExplainArgs),
    /// Say what the library knows of a substance, and where each number comes from.
    Substance(SubstanceArgs),
    /// List the definitions of labware in the library, or print one.
    Labware(LabwareArgs),
    /// Offer check, fix, run and the rest to an assistant, over the Model Context Protocol on standard input and output.
    Mcp(McpArgs),
    /// Create a small project that checks, runs and passes.
    New(NewArgs),
    /// Print what completes commands and options in a shell.
    Completions(CompletionsArgs),
    /// Write pages for `man`: one for the command and one for each subcommand.
    Man(ManArgs),
    /// Print the versions of the command and the language, and the commit that it was built from.
    Version,
}

/// `matterixc completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// For which shell.
    pub shell: clap_complete::Shell,
}

/// `matterixc man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// The folder that they go to; it is made where it is not there.
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,
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
    /// Take warnings for errors, and show advice as warnings.
    #[arg(long)]
    pub strict: bool,
    /// How closely motions are looked at: with `process` not what is out of reach of robots and what they run into.
    #[arg(long, value_enum, default_value_t = Fidelity::Motion)]
    pub fidelity: Fidelity,
    /// Plan all motions anew instead of taking them from the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
    /// Make the corrections that findings offer, those that leave no doubt; with `--fix=all` also what is probably meant.
    #[arg(long, value_enum, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "sure")]
    pub fix: Option<Fixes>,
    /// Look again whenever a file changes, until Ctrl-C.
    #[arg(long, conflicts_with_all = ["fix", "at"])]
    pub watch: bool,
    /// Say what is known at every statement: what vessels hold, how devices stand, how much time has passed.
    #[arg(long)]
    pub contents: bool,
    /// Say everything that is known after the statement at this place.
    #[arg(long, value_name = "LINE[:COLUMN]", requires = "contents")]
    pub at: Option<Place>,
}

/// `matterixc lsp`.
#[derive(Debug, Args)]
pub struct LspArgs {
    /// Speak on standard input and output, as is done without it too: what some editors add.
    #[arg(long)]
    pub stdio: bool,
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

/// A workflow of a file, with what it is given from outside.
#[derive(Debug, Args)]
pub struct Subject {
    /// The file.
    pub file: PathBuf,
    /// The workflow, where the file has several.
    #[arg(long, value_name = "NAME")]
    pub workflow: Option<String>,
    /// A parameter of the workflow, as written in the language: `--set "target=40 degC"`.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    pub set: Vec<(String, String)>,
    /// The lab, for a workflow that runs in any.
    #[arg(long, value_name = "NAME")]
    pub lab: Option<String>,
}

impl Subject {
    /// The same, as the compiler takes it.
    pub fn options(&self) -> Options {
        Options { workflow: self.workflow.clone(), set: self.set.clone(), lab: self.lab.clone(), ..Options::default() }
    }
}

/// `matterixc run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// Where all randomness of the run starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Where to write recording, tables, plots and report; nothing is written without it.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write the tables as CSV too, one column a quantity.
    #[arg(long, requires = "out")]
    pub csv: bool,
    /// How closely it is simulated.
    #[command(flatten)]
    pub reality: Reality,
    /// Plan all motions anew instead of taking them from the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
    /// Form of the report.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
    /// Walk through the steps without simulating what they cause.
    #[arg(long)]
    pub dry: bool,
    /// Let claims take turns as in a schedule: one made before the run, or one that `plan --format json` has written.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    pub plan: Option<Option<PathBuf>>,
}

/// How closely motions are simulated, and how the lab really is.
#[derive(Clone, Copy, Debug, Args)]
pub struct Reality {
    /// How closely motions are simulated; with `motion` and `contact` they are looked at before the run begins.
    #[arg(long, value_enum, default_value_t = RunFidelity::Process)]
    pub fidelity: RunFidelity,
    /// Move what can be gripped and stands freely by up to so much each way, as the seed has it: `--perturb 20mm,10deg`.
    #[arg(long, value_name = "LENGTH[,ANGLE]", value_parser = perturbation)]
    pub perturb: Option<Perturbation>,
    /// Let the same things really be so far from where robots take them to be: `--unseen 2mm,1deg`, with `--fidelity motion` or `contact`.
    #[arg(long, value_name = "LENGTH[,ANGLE]", value_parser = perturbation)]
    pub unseen: Option<Perturbation>,
    /// Let friction and the force of grips really be such a share of what is said: `--really friction=0.2,grip=0.5`, with `--fidelity contact`.
    #[arg(long, value_name = "WHAT=SHARE[,..]", value_parser = really)]
    pub really: Option<Really>,
}

/// `matterixc plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// Form of the schedule.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
    /// Where to write a picture of it.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// How long to look for a shorter schedule, by the clock.
    #[arg(long, value_name = "TIME", default_value = "30 s", value_parser = time)]
    pub time_limit: Duration,
    /// Where all randomness of the search starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// How closely motions are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(crate = "rmcp::schemars", inline)]
pub enum Fidelity {
    /// Motions take their declared time.
    Process,
    /// Robots move through space, around what stands there, in the time their joints need.
    Motion,
}

/// How closely a run simulates motions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(crate = "rmcp::schemars", inline)]
pub enum RunFidelity {
    /// Motions take their declared time.
    Process,
    /// Robots move through space, around what stands there, in the time their joints need.
    Motion,
    /// The same, and grips hold by force and friction: things slip, fall and topple.
    Contact,
}

/// Form of the report of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RunFormat {
    /// A page to read.
    Human,
    /// The contents of `report.json`.
    Json,
}

/// `matterixc test`.
#[derive(Debug, Args)]
pub struct TestArgs {
    /// Files, and folders that are searched for them.
    #[arg(default_value = ".", value_name = "FILE|DIR")]
    pub paths: Vec<PathBuf>,
    /// Only tests whose name contains this.
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Where all randomness of each run starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// How closely they are simulated.
    #[command(flatten)]
    pub reality: Reality,
    /// Form of the results.
    #[arg(long, value_enum, default_value_t = TestFormat::Human)]
    pub format: TestFormat,
}

/// Form of the results of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TestFormat {
    /// A line each, then the counts.
    Human,
    /// One JSON object per line.
    Json,
}

/// `matterixc bill`.
#[derive(Debug, Args)]
pub struct BillArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// For so many runs.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub runs: u64,
    /// Where all randomness of the run starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Prices, as a CSV table with the columns item,price,currency,quantity,unit.
    #[arg(long, value_name = "FILE")]
    pub prices: Option<PathBuf>,
    /// Form of the bill.
    #[arg(long, value_enum, default_value_t = BillFormat::Human)]
    pub format: BillFormat,
}

/// Form of a bill.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BillFormat {
    /// A page to read.
    Human,
    /// One JSON object, described in docs/bill.md.
    Json,
    /// One row per number.
    Csv,
}

/// Many runs of a workflow of a file.
#[derive(Debug, Args)]
pub struct Many {
    /// The file.
    pub file: PathBuf,
    /// Which study or fit, where the file has several.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// A parameter of the workflow that is not left open, as written in the language: `--set "target=40 degC"`.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    pub set: Vec<(String, String)>,
    /// The lab, for a workflow that runs in any.
    #[arg(long, value_name = "NAME")]
    pub lab: Option<String>,
    /// Where all randomness starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Where to write tables and figures; nothing is written without it.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// On how many threads; on all processors without it. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Form of the figures.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
}

impl Many {
    /// The same, as the compiler takes it.
    pub fn options(&self) -> Options {
        Options { workflow: self.name.clone(), set: self.set.clone(), lab: self.lab.clone(), ..Options::default() }
    }

    /// How many threads.
    pub fn threads(&self) -> usize {
        self.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
    }
}

/// `matterixc study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// What is run.
    #[command(flatten)]
    pub many: Many,
    /// How many runs, in place of what the study says.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=matterix_ir::study::MOST_RUNS))]
    pub runs: Option<u64>,
}

/// `matterixc fit`.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// What is run.
    #[command(flatten)]
    pub many: Many,
}

/// `matterixc doc`.
#[derive(Debug, Args)]
pub struct DocArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// Where to write it; to standard output without it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `matterixc deploy`.
#[derive(Debug, Args)]
pub struct DeployArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// Where the devices of the lab are.
    #[arg(long, value_name = "FILE")]
    pub bind: PathBuf,
    /// What is done with them.
    #[arg(long, value_enum, default_value_t = DeployMode::Dry)]
    pub mode: DeployMode,
    /// Where to keep the journal; needed unless nothing is sent.
    #[arg(long, value_name = "FILE")]
    pub journal: Option<PathBuf>,
    /// Where to keep the journal with program, bindings and report: a folder that `matterixc verify` checks.
    #[arg(long, value_name = "FOLDER", conflicts_with = "journal")]
    pub record: Option<PathBuf>,
    /// Go on with a deployment that was cut off, from its journal.
    #[arg(long)]
    pub resume: bool,
    /// With `--resume`, vouch that the journal is the newest: nothing on this machine says how far it got.
    #[arg(long, requires = "resume")]
    pub vouch: bool,
    /// Serve a page on this machine that shows what goes on, and where people answer, pause, go on and stop; its address is printed.
    #[arg(long)]
    pub view: bool,
    /// The port of that page; 0 takes any that is free.
    #[arg(long, value_name = "PORT", default_value_t = 0, requires = "view")]
    pub port: u16,
    /// Show all bytes that go out and come in.
    #[arg(long)]
    pub trace: bool,
    /// Take every question and every step by hand for confirmed.
    #[arg(long)]
    pub yes: bool,
    /// Let lab time pass so many times as fast: only where all devices are emulators that do the same.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// Where all randomness of the simulation starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// What a deployment does with devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeployMode {
    /// Send nothing, and print every byte that would be sent.
    Dry,
    /// Run on the digital twin first, and on devices only where that passes.
    SimFirst,
    /// Run on devices, and stop where they are not where the twin is.
    Shadow,
    /// Run on devices.
    Real,
}

/// `matterixc emulate`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("line").required(true).args(["pty", "tcp"]))]
pub struct EmulateArgs {
    /// An asset of the library with a driver, or with `--file` an instance of its lab; several instances, each with its address as
    /// in `pump@2`, answer at one line.
    #[arg(required = true)]
    pub device: Vec<String>,
    /// The lab the device stands in, with what is around it.
    #[arg(long, value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// A workflow of the lab, where the file has several labs.
    #[arg(long, value_name = "NAME", requires = "file")]
    pub workflow: Option<String>,
    /// The driver, where the device has several.
    #[arg(long, value_name = "NAME")]
    pub driver: Option<String>,
    /// Answer at a pseudo-terminal; its path is printed.
    #[arg(long)]
    pub pty: bool,
    /// Where to put a link to the pseudo-terminal.
    #[arg(long, value_name = "PATH", requires = "pty")]
    pub link: Option<PathBuf>,
    /// Answer at a port of this machine; 0 takes any that is free.
    #[arg(long, value_name = "PORT")]
    pub tcp: Option<u16>,
    /// Let lab time pass so many times as fast.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// Where the noise of readings starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// `matterixc discover`.
#[cfg(feature = "sila")]
#[derive(Debug, Args)]
pub struct DiscoverArgs {
    /// How long to wait for answers, s.
    #[arg(long = "for", value_name = "SECONDS", default_value_t = 3.0, value_parser = waiting)]
    pub time: f64,
}

/// A time to wait, s.
#[cfg(feature = "sila")]
fn waiting(text: &str) -> Result<f64, String> {
    let time = text.parse::<f64>().ok().filter(|time| (0.1..=600.0).contains(time));
    time.ok_or_else(|| format!("`{text}` is no time from 0.1 s to 600 s"))
}

/// `matterixc serve`.
#[cfg(feature = "sila")]
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// The file of the lab.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// A workflow of the lab, where the file has several labs.
    #[arg(long, value_name = "NAME")]
    pub workflow: Option<String>,
    /// The port; 0 takes any that is free.
    #[arg(long, value_name = "PORT")]
    pub tcp: u16,
    /// The address of this machine to answer at; 0.0.0.0 is every one it has.
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub host: String,
    /// Do not encrypt connections: whoever is on the network can read and change what is said.
    #[arg(long, conflicts_with_all = ["certificate", "users"])]
    pub insecure: bool,
    /// The certificate to show, in PEM, with those that signed it behind it; the server's own without it.
    #[arg(long, value_name = "FILE", requires = "key")]
    pub certificate: Option<PathBuf>,
    /// The private key of the certificate, in PEM.
    #[arg(long, value_name = "FILE", requires = "certificate")]
    pub key: Option<PathBuf>,
    /// Who must log in before they call: names and passwords as `htpasswd -B` writes them.
    #[arg(long, value_name = "FILE")]
    pub users: Option<PathBuf>,
    /// Do not say to the network that the server is there.
    #[arg(long)]
    pub no_discovery: bool,
    /// The identifier of the server; without it, the same whenever this lab of this file is served on this machine.
    #[arg(long, value_name = "UUID")]
    pub uuid: Option<String>,
    /// Where the devices of the lab are; the digital twin answers without it.
    #[arg(long, value_name = "FILE")]
    pub bind: Option<PathBuf>,
    /// Where to keep the journal of what is said to devices; needed where there are some.
    #[arg(long, value_name = "FILE", requires = "bind")]
    pub journal: Option<PathBuf>,
    /// Show all bytes that go to devices and come from them.
    #[arg(long, requires = "bind")]
    pub trace: bool,
    /// Let lab time pass so many times as fast.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// Where the noise of readings starts.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// `matterixc emit`.
#[derive(Debug, Args)]
pub struct EmitArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// What kind of file.
    #[arg(long, value_enum, value_name = "KIND")]
    pub target: Target,
    /// Where to write it; to standard output without it.
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Give it to the device that these bindings say, and wait until that has run it.
    #[arg(long, value_name = "BINDINGS", conflicts_with = "out")]
    pub play: Option<PathBuf>,
    /// Where all randomness of the performance starts that is written down.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Plan all motions anew instead of taking them from the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
}

/// What can be imported.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Foreign {
    /// A database of PHREEQC, as `phreeqc.dat` or `wateq4f.dat`: equilibria in water, with activity coefficients.
    Phreeqc,
    /// The analysis of a protocol for the OT-2 (`opentrons analyze --json-output`), or a JSON protocol: a lab, and a workflow with loops.
    Opentrons,
}

/// `matterixc import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// What kind of file it is.
    #[arg(value_enum, value_name = "KIND")]
    pub kind: Foreign,
    /// The file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Take species of these elements only, beside hydrogen and oxygen: `Ca,C,Cl`.
    #[arg(long, value_name = "ELEMENTS", value_delimiter = ',')]
    pub elements: Vec<String>,
    /// Take these solid phases, as the database calls them: `Calcite,Gypsum`. Without it no solid is taken, so that nothing precipitates.
    #[arg(long, value_name = "PHASES", value_delimiter = ',')]
    pub phases: Vec<String>,
    /// Where to write the module; to standard output without it.
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `matterixc verify`.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The recording that a run has written, the folder it is in, or the record of a deployment.
    #[arg(value_name = "RUN")]
    pub recording: PathBuf,
    /// Form of the verdict.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
}

/// `matterixc view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// What is shown: a program, or the recording that a run has written (or the folder it is in).
    #[command(flatten)]
    pub subject: Subject,
    /// Port on this machine to serve the page at; 0 takes any that is free.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub port: u16,
    /// Write the page to a file that opens by itself, and serve nothing.
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    pub export: Option<PathBuf>,
}

/// `matterixc mcp`.
#[derive(Debug, Args)]
pub struct McpArgs {
    /// The folder whose protocols it works on; nothing outside of it is read or written.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub root: PathBuf,
}

/// `matterixc explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A code as in `error[CODE]`, the name of a failure, or a family such as `U1`; all codes without it.
    pub code: Option<String>,
    /// Files that give the name, for failures and hazards of your own.
    pub files: Vec<PathBuf>,
    /// Print the index of the pages.
    #[arg(long, hide = true)]
    pub index: bool,
}

/// `matterixc substance`.
#[derive(Debug, Args)]
pub struct SubstanceArgs {
    /// A name, a formula, a CAS number or a SMILES: `acetone`, `C3H6O`, `67-64-1`, `CC(C)=O`.
    pub name: String,
    /// Also look among the species of this file.
    #[arg(long, value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// Form of the answer.
    #[arg(long, value_enum, default_value_t = SubstanceFormat::Human)]
    pub format: SubstanceFormat,
}

/// Form of what is known of a substance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SubstanceFormat {
    /// A page to read.
    Human,
    /// One JSON object, described in docs/substances.md.
    Json,
}

/// `matterixc labware`.
#[derive(Debug, Args)]
pub struct LabwareArgs {
    /// Words that stand in the name, the title or the kind: `nest 96`, `TubeRack`; or a name, `NAME/VERSION` for a version of it.
    #[arg(value_name = "WORD")]
    pub words: Vec<String>,
    /// Form of the answer.
    #[arg(long, value_enum, default_value_t = LabwareFormat::Human)]
    pub format: LabwareFormat,
}

/// Form of what is known of labware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LabwareFormat {
    /// A list to read, or a page on the only one.
    Human,
    /// A list of JSON objects, described in docs/labware.md.
    Json,
    /// The definition of a name, as a file of your own that you can change.
    Definition,
}

/// `matterixc new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// The folder to create; if it exists, it must be empty.
    pub dir: PathBuf,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "write a number, as in 20".to_string())?;
    if (1e-3..=1e4).contains(&speed) { Ok(speed) } else { Err("write a number from 0.001 to 10000".to_string()) }
}

fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_string(), value.trim().to_string()))
        }
        _ => Err("write NAME=VALUE, as in \"target=40 degC\"".to_string()),
    }
}

/// Sizes of units.
type Units = [(&'static str, f64)];

/// A number with one of these units; nothing where the unit is none of them.
fn measure(text: &str, units: &Units) -> Result<Option<f64>, String> {
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let Some((_, size)) = units.iter().find(|(name, _)| *name == unit.trim()) else { return Ok(None) };
    let number: f64 = number.parse().map_err(|_| format!("`{number}` is not a number"))?;
    Ok(Some(number * size))
}

/// A length, an angle, or both.
pub fn perturbation(text: &str) -> Result<Perturbation, String> {
    let wrong = || "write a length, an angle, or both, as in \"20mm,10deg\"".to_string();
    let (mut shift, mut turn) = (None, None);
    for part in text.split(',').map(str::trim) {
        let length = measure(part, &[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])?;
        let angle = measure(part, &[("deg", std::f64::consts::PI / 180.0), ("rad", 1.0)])?;
        let (slot, value) = match (length, angle) {
            (Some(length), _) => (&mut shift, length),
            (_, Some(angle)) => (&mut turn, angle),
            (None, None) => return Err(wrong()),
        };
        if slot.replace(value).is_some() {
            return Err(wrong());
        }
    }
    Ok(Perturbation { shift: shift.unwrap_or_default(), turn: turn.unwrap_or_default() })
}

/// Shares of friction and of the force of grips.
pub fn really(text: &str) -> Result<Really, String> {
    let wrong = || "write shares from 0 to 10, as in \"friction=0.2,grip=0.5\"".to_string();
    let mut really = Really::default();
    for part in text.split(',') {
        let (name, share) = part.split_once('=').ok_or_else(wrong)?;
        let share: f64 = share.trim().parse().map_err(|_| wrong())?;
        if !(0.0..=10.0).contains(&share) {
            return Err(wrong());
        }
        match name.trim() {
            "friction" => really.friction = share,
            "grip" => really.grip = share,
            _ => return Err(wrong()),
        }
    }
    Ok(really)
}

fn time(text: &str) -> Result<Duration, String> {
    let seconds = measure(text, &[("ms", 1e-3), ("s", 1.0), ("min", 60.0), ("h", 3600.0)])?
        .ok_or("write a time with its unit, as in \"30 s\" or \"5 min\"")?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "this time is too long".to_string())
}
