//! The command line as people see it: subcommands in groups by what they are for.

use clap::{CommandFactory, FromArgMatches};

use crate::args::Cli;

/// Subcommands by what they are for; some stand only in some builds.
const GROUPS: [(&str, &[&str]); 4] = [
    ("Write", &["new", "check", "fmt", "test", "explain", "substance", "labware", "doc", "bill", "import"]),
    ("Run on the digital twin", &["run", "study", "fit", "plan", "verify", "view"]),
    ("Work with devices", &["deploy", "emulate", "serve", "discover", "emit"]),
    ("Editors, assistants, shells", &["lsp", "mcp", "completions", "man", "version", "help"]),
];

/// What `help` does, which clap says once it has parsed.
const HELP: &str = "Print this message or the help of a command";

/// The command line.
pub fn cli() -> clap::Command {
    let cli = Cli::command();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{}\nOptions:\n{{options}}{{after-help}}",
        grouped(&cli)
    );
    cli.help_template(template)
}

/// What was typed; in words what is wrong with it, or the help that was asked for.
pub fn parse() -> Result<Cli, clap::Error> {
    Cli::from_arg_matches(&cli().try_get_matches()?)
}

/// The subcommands under their headings.
fn grouped(cli: &clap::Command) -> String {
    let mut out = String::new();
    for (heading, names) in GROUPS {
        out.push_str(&format!("\n{heading}:\n"));
        for name in names {
            let about = cli.find_subcommand(name).map(|command| command.get_about().map(ToString::to_string));
            let about = if *name == "help" { Some(Some(HELP.to_owned())) } else { about };
            if let Some(about) = about {
                out.push_str(&format!("  {name:12} {}\n", about.unwrap_or_default()));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subcommand_stands_in_one_group() {
        let listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        for command in Cli::command().get_subcommands() {
            let times = listed.iter().filter(|name| **name == command.get_name()).count();
            assert_eq!(times, 1, "{}", command.get_name());
        }
        cli().debug_assert();
    }
}
