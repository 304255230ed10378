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
#[command(
    after_help = "Exit status: 0 success; 1 findings, a failed run or a failed expectation; 2 wrong usage or unreadable files."
)]
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
    /// Always.
    Always,
    /// Never.
    Never,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Find faults in files without running them.
    Check(CheckArgs),
    /// Format files.
    Fmt(FmtArgs),
    /// Run a workflow on the digital twin and judge its expectations.
    Run(RunArgs),
    /// Run the tests of files and judge their expectations.
    Test(TestArgs),
    /// List the materials that a run consumes and occupies: reagents, tips, vessels, waste, device time.
    Bill(BillArgs),
    /// Run a workflow many times with the variations of a study, and report the results.
    Study(StudyArgs),
    /// Estimate parameters of a workflow's model from data.
    Fit(FitArgs),
    /// Write a workflow as a protocol that a person can follow by hand.
    Doc(DocArgs),
    /// Schedule a workflow: which step uses which instance when, so that it ends early.
    Plan(PlanArgs),
    /// Carry out a workflow on devices, or print the messages that would be sent.
    Deploy(DeployArgs),
    /// Emulate a device: answer on a line like the device.
    Emulate(EmulateArgs),
    /// Serve the devices of a lab as SiLA 2 features: on the digital twin, or with `--bind` on devices.
    #[cfg(feature = "sila")]
    Serve(ServeArgs),
    /// List the SiLA 2 servers on the network.
    #[cfg(feature = "sila")]
    Discover(DiscoverArgs),
    /// Export a workflow as a file that another program runs.
    Emit(EmitArgs),
    /// Import a file of another program as a module of the language.
    Import(ImportArgs),
    /// Judge the robot motions of a recording: limits, kinematics, contacts of their true shapes, grips.
    Verify(VerifyArgs),
    /// Show a lab, or play a recording, on a 3D page.
    View(ViewArgs),
    /// Run a language server on standard input and output, for editors.
    Lsp(LspArgs),
    /// Explain a diagnostic code, or list them all.
    Explain(ExplainArgs),
    /// Show the library's data of a substance, with the source of each number.
    Substance(SubstanceArgs),
    /// List the definitions of labware in the library, or print one.
    Labware(LabwareArgs),
    /// Serve check, fix, run and other tools to an assistant, over the Model Context Protocol on standard input and output.
    Mcp(McpArgs),
    /// Create a small project that checks, runs and passes.
    New(NewArgs),
    /// Print shell completions for commands and options.
    Completions(CompletionsArgs),
    /// Write pages for `man`: one for the command and one for each subcommand.
    Man(ManArgs),
    /// Print the versions of the command and the language, and the commit that it was built from.
    Version,
}

/// `matterixc completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: clap_complete::Shell,
}

/// `matterixc man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// The target folder; it is created if needed.
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
    /// Treat warnings as errors, and show advice as warnings.
    #[arg(long)]
    pub strict: bool,
    /// How motions are checked: `motion` also checks reach and collisions; `process` skips both.
    #[arg(long, value_enum, default_value_t = Fidelity::Motion)]
    pub fidelity: Fidelity,
    /// Plan all motions again instead of using the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
    /// Apply the safe fixes of findings; with `--fix=all` also the probable ones.
    #[arg(long, value_enum, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "sure")]
    pub fix: Option<Fixes>,
    /// Check again whenever a file changes, until Ctrl-C.
    #[arg(long, conflicts_with_all = ["fix", "at"])]
    pub watch: bool,
    /// Print the known state at every statement: contents of vessels, states of devices, elapsed time.
    #[arg(long)]
    pub contents: bool,
    /// Print everything that is known after the statement at this place.
    #[arg(long, value_name = "LINE[:COLUMN]", requires = "contents")]
    pub at: Option<Place>,
}

/// `matterixc lsp`.
#[derive(Debug, Args)]
pub struct LspArgs {
    /// Use standard input and output (the default); accepted because some editors pass it.
    #[arg(long)]
    pub stdio: bool,
}

/// `matterixc fmt`.
#[derive(Debug, Args)]
pub struct FmtArgs {
    /// The files; `-` reads standard input and writes standard output.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Write nothing; list unformatted files, and fail if there are any.
    #[arg(long, conflicts_with = "stdout")]
    pub check: bool,
    /// Write to standard output, not to the files.
    #[arg(long)]
    pub stdout: bool,
}

/// A workflow of a file, with its given parameters.
#[derive(Debug, Args)]
pub struct Subject {
    /// The file.
    pub file: PathBuf,
    /// The workflow, if the file has several.
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
    /// The seed of the run.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The folder for recording, tables, plots and report; without it nothing is written.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Also write the tables as CSV, one column for each quantity.
    #[arg(long, requires = "out")]
    pub csv: bool,
    /// The fidelity of the simulation.
    #[command(flatten)]
    pub reality: Reality,
    /// Plan all motions again instead of using the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
    /// The file that keeps how far tip racks are used up: read before, and written after. A new one begins with full racks.
    #[arg(long, value_name = "FILE")]
    pub tips: Option<PathBuf>,
    /// The format of the report.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
    /// Go through the steps without simulating their effects.
    #[arg(long)]
    pub dry: bool,
    /// Order claims by a schedule: one made before the run, or a file of `plan --format json`.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    pub plan: Option<Option<PathBuf>>,
}

/// How closely motions are simulated, and how the lab really is.
#[derive(Clone, Copy, Debug, Args)]
pub struct Reality {
    /// How motions are simulated; `motion` and `contact` check them before the run.
    #[arg(long, value_enum, default_value_t = RunFidelity::Process)]
    pub fidelity: RunFidelity,
    /// Move freely standing things by a random distance up to this limit in each direction: `--perturb 20mm,10deg`.
    #[arg(long, value_name = "LENGTH[,ANGLE]", value_parser = perturbation)]
    pub perturb: Option<Perturbation>,
    /// Put things this far from the places that robots assume: `--unseen 2mm,1deg`, with `--fidelity motion` or `contact`.
    #[arg(long, value_name = "LENGTH[,ANGLE]", value_parser = perturbation)]
    pub unseen: Option<Perturbation>,
    /// Scale real friction and grip force against the declared values: `--really friction=0.2,grip=0.5`, with `--fidelity contact`.
    #[arg(long, value_name = "WHAT=SHARE[,..]", value_parser = really)]
    pub really: Option<Really>,
}

/// `matterixc plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// The format of the schedule.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
    /// The file for a picture of it.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// How long to search for a shorter schedule, in wall-clock time.
    #[arg(long, value_name = "TIME", default_value = "30 s", value_parser = time)]
    pub time_limit: Duration,
    /// The seed of the search.
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
    /// Robots move around obstacles, in the time that their joints need.
    Motion,
}

/// How closely a run simulates motions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(crate = "rmcp::schemars", inline)]
pub enum RunFidelity {
    /// Motions take their declared time.
    Process,
    /// Robots move around obstacles, in the time that their joints need.
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
    /// Files, or folders to search for files.
    #[arg(default_value = ".", value_name = "FILE|DIR")]
    pub paths: Vec<PathBuf>,
    /// Run only tests whose name contains this.
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// The seed of each run.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The fidelity of the simulation.
    #[command(flatten)]
    pub reality: Reality,
    /// The format of the results.
    #[arg(long, value_enum, default_value_t = TestFormat::Human)]
    pub format: TestFormat,
}

/// Form of the results of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TestFormat {
    /// One line for each test, then the counts.
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
    /// The number of runs.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub runs: u64,
    /// The seed of the run.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Prices, as a CSV table with the columns item,price,currency,quantity,unit.
    #[arg(long, value_name = "FILE")]
    pub prices: Option<PathBuf>,
    /// The format of the bill.
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
    /// The study or fit, if the file has several.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// A fixed parameter of the workflow, as written in the language: `--set "target=40 degC"`.
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    pub set: Vec<(String, String)>,
    /// The lab, for a workflow that runs in any.
    #[arg(long, value_name = "NAME")]
    pub lab: Option<String>,
    /// The seed.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The folder for tables and figures; without it nothing is written.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The number of threads; the default is all processors. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// The format of the figures.
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
    /// The number of runs, instead of that in the study.
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
    /// The output file; without it, standard output.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `matterixc deploy`.
#[derive(Debug, Args)]
pub struct DeployArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// The bindings: where the devices of the lab are.
    #[arg(long, value_name = "FILE")]
    pub bind: PathBuf,
    /// How to use the devices.
    #[arg(long, value_enum, default_value_t = DeployMode::Dry)]
    pub mode: DeployMode,
    /// The file of the journal; required if anything is sent.
    #[arg(long, value_name = "FILE")]
    pub journal: Option<PathBuf>,
    /// The folder for the journal with program, bindings and report; `matterixc verify` checks it.
    #[arg(long, value_name = "FOLDER", conflicts_with = "journal")]
    pub record: Option<PathBuf>,
    /// Resume an interrupted deployment from its journal.
    #[arg(long)]
    pub resume: bool,
    /// With `--resume`, confirm that the journal is the newest, if this computer has no record of its last line.
    #[arg(long, requires = "resume")]
    pub vouch: bool,
    /// Serve a page on this computer to follow, pause, continue and stop the deployment and to answer questions; its address is printed.
    #[arg(long)]
    pub view: bool,
    /// The port of that page; 0 takes any free port.
    #[arg(long, value_name = "PORT", default_value_t = 0, requires = "view")]
    pub port: u16,
    /// Show all sent and received bytes.
    #[arg(long)]
    pub trace: bool,
    /// Confirm every question and every manual step automatically.
    #[arg(long)]
    pub yes: bool,
    /// Speed up lab time by this factor: only if all devices are emulators at the same speed.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// The seed of the simulation.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// What a deployment does with devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DeployMode {
    /// Send nothing, and print every byte that would be sent.
    Dry,
    /// Run on the digital twin first, and on devices only if that passes.
    SimFirst,
    /// Run on devices, and stop if they differ from the twin.
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
    /// A workflow of the lab, if the file has several labs.
    #[arg(long, value_name = "NAME", requires = "file")]
    pub workflow: Option<String>,
    /// The driver, if the device has several.
    #[arg(long, value_name = "NAME")]
    pub driver: Option<String>,
    /// Answer on a pseudo-terminal; its path is printed.
    #[arg(long)]
    pub pty: bool,
    /// The path of a link to the pseudo-terminal.
    #[arg(long, value_name = "PATH", requires = "pty")]
    pub link: Option<PathBuf>,
    /// Answer on a port of this computer; 0 takes any free port.
    #[arg(long, value_name = "PORT")]
    pub tcp: Option<u16>,
    /// Speed up lab time by this factor.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// The seed of the noise of readings.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// `matterixc discover`.
#[cfg(feature = "sila")]
#[derive(Debug, Args)]
pub struct DiscoverArgs {
    /// How long to wait for replies, s.
    #[arg(long = "for", value_name = "SECONDS", default_value_t = 3.0, value_parser = waiting)]
    pub time: f64,
}

/// A time to wait, s.
#[cfg(feature = "sila")]
fn waiting(text: &str) -> Result<f64, String> {
    let time = text.parse::<f64>().ok().filter(|time| (0.1..=600.0).contains(time));
    time.ok_or_else(|| format!("`{text}` is not a time from 0.1 s to 600 s"))
}

/// `matterixc serve`.
#[cfg(feature = "sila")]
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// The file of the lab.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// A workflow of the lab, if the file has several labs.
    #[arg(long, value_name = "NAME")]
    pub workflow: Option<String>,
    /// The port; 0 takes any free port.
    #[arg(long, value_name = "PORT")]
    pub tcp: u16,
    /// The address of this computer to listen on; 0.0.0.0 means all of them.
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub host: String,
    /// Do not encrypt connections: anyone on the network can read and change messages.
    #[arg(long, conflicts_with_all = ["certificate", "users"])]
    pub insecure: bool,
    /// The certificate in PEM, followed by those that signed it; without it, the server makes its own.
    #[arg(long, value_name = "FILE", requires = "key")]
    pub certificate: Option<PathBuf>,
    /// The private key of the certificate, in PEM.
    #[arg(long, value_name = "FILE", requires = "certificate")]
    pub key: Option<PathBuf>,
    /// A file of users who must log in: names and passwords as written by `htpasswd -B`.
    #[arg(long, value_name = "FILE")]
    pub users: Option<PathBuf>,
    /// Do not announce the server on the network.
    #[arg(long)]
    pub no_discovery: bool,
    /// The identifier of the server; the default stays the same for this lab of this file on this computer.
    #[arg(long, value_name = "UUID")]
    pub uuid: Option<String>,
    /// The bindings: where the devices of the lab are; without it the digital twin answers.
    #[arg(long, value_name = "FILE")]
    pub bind: Option<PathBuf>,
    /// The file of the journal; required with devices.
    #[arg(long, value_name = "FILE", requires = "bind")]
    pub journal: Option<PathBuf>,
    /// Show all bytes sent to devices and received from them.
    #[arg(long, requires = "bind")]
    pub trace: bool,
    /// Speed up lab time by this factor.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed)]
    pub speed: f64,
    /// The seed of the noise of readings.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

/// `matterixc emit`.
#[derive(Debug, Args)]
pub struct EmitArgs {
    /// What is compiled.
    #[command(flatten)]
    pub subject: Subject,
    /// The format of the file.
    #[arg(long, value_enum, value_name = "KIND")]
    pub target: Target,
    /// The output file; without it, standard output.
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Send it to the device in these bindings, and wait until the device has run it.
    #[arg(long, value_name = "BINDINGS", conflicts_with = "out")]
    pub play: Option<PathBuf>,
    /// The file that keeps how far tip racks are used up: read before, and written after. A new one begins with full racks.
    #[arg(long, value_name = "FILE")]
    pub tips: Option<PathBuf>,
    /// The seed of the written run.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Plan all motions again instead of using the cache of earlier checks.
    #[arg(long)]
    pub no_cache: bool,
}

/// What can be imported.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Foreign {
    /// A database of PHREEQC, as `phreeqc.dat` or `wateq4f.dat`: equilibria in water, with activity coefficients.
    Phreeqc,
    /// The analysis of a protocol for the OT-2 or the Flex (`opentrons analyze --json-output`), or a JSON protocol: a lab, and a workflow with loops.
    Opentrons,
}

/// `matterixc import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// The format of the file.
    #[arg(value_enum, value_name = "KIND")]
    pub kind: Foreign,
    /// The file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Import only species of these elements, besides hydrogen and oxygen: `Ca,C,Cl`.
    #[arg(long, value_name = "ELEMENTS", value_delimiter = ',')]
    pub elements: Vec<String>,
    /// Import these solid phases, by their names in the database: `Calcite,Gypsum`. Without it no solid is imported, and nothing precipitates.
    #[arg(long, value_name = "PHASES", value_delimiter = ',')]
    pub phases: Vec<String>,
    /// The file of the module; without it, standard output.
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `matterixc verify`.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The recording of a run, its folder, or the record of a deployment.
    #[arg(value_name = "RUN")]
    pub recording: PathBuf,
    /// The format of the verdict.
    #[arg(long, value_enum, default_value_t = RunFormat::Human)]
    pub format: RunFormat,
}

/// `matterixc view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// A program, or the recording of a run (or its folder).
    #[command(flatten)]
    pub subject: Subject,
    /// The port of the page on this computer; 0 takes any free port.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub port: u16,
    /// Write the page to a self-contained file instead of serving it.
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    pub export: Option<PathBuf>,
}

/// `matterixc mcp`.
#[derive(Debug, Args)]
pub struct McpArgs {
    /// The folder of the protocols; nothing outside of it is read or written.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub root: PathBuf,
}

/// `matterixc explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A code as in `error[CODE]`, the name of a failure, or a family such as `U1`; without it, all codes.
    pub code: Option<String>,
    /// Files that declare the name, for your own failures and hazards.
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
    /// Also search the species of this file.
    #[arg(long, value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// Show all equilibria of the substance and its ions, not only the first of each kind.
    #[arg(long)]
    pub all: bool,
    /// The format of the answer.
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
