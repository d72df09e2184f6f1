//! The `rollover-app` command.

use std::process::ExitCode;

use clap::Parser;
use rollover_app::cli::Cli;
use rollover_app::interrupt::{Interrupt, Interrupted};

/// Exit status of a program stopped by Ctrl-C, as shells report it.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = Interrupt::on_signals()
        .map_err(anyhow::Error::from)
        .and_then(|interrupt| rollover_app::execute(&cli.command, &interrupt));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            let interrupted = error
                .chain()
                .any(<dyn std::error::Error>::is::<Interrupted>);
            if interrupted {
                ExitCode::from(INTERRUPTED)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}
