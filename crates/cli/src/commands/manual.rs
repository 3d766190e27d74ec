//! `twolight completions` and `twolight man`: what the command line says of itself, for shells and for `man`.

use super::print;
use crate::args::Cli;
use anyhow::Result;
use clap::CommandFactory;
use clap_complete::Shell;
use std::process::ExitCode;

/// Prints the completions for a shell.
pub fn completions(shell: Shell) -> Result<ExitCode> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "twolight", &mut text);
    print(&String::from_utf8_lossy(&text))?;
    Ok(ExitCode::SUCCESS)
}

/// Prints the manual page: one for the whole, with a section for each subcommand.
pub fn page() -> Result<ExitCode> {
    let mut command = Cli::command();
    command.build();
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help") {
        let man = clap_mangen::Man::new(sub.clone());
        let mut part = Vec::new();
        man.render_synopsis_section(&mut part)?;
        man.render_description_section(&mut part)?;
        man.render_options_section(&mut part)?;
        let name = sub.get_name().to_uppercase();
        let titled = String::from_utf8_lossy(&part).replace(".SH SYNOPSIS", &format!(".SH {name}"));
        // Within a subcommand's own section the rest are paragraphs of it.
        page.extend(
            titled.replace(".SH DESCRIPTION", ".PP").replace(".SH OPTIONS", ".SS OPTIONS").into_bytes(),
        );
    }
    print(&String::from_utf8_lossy(&page))?;
    Ok(ExitCode::SUCCESS)
}
