//! The `rollover-app` command.

use clap::Parser;
use rollover_app::cli::Cli;
use rollover_app::interrupt::{INTERRUPTED_STATUS, Interrupt, Interrupted};

fn main() {
    let cli = Cli::parse();
    let result = Interrupt::on_signals()
        .map_err(anyhow::Error::from)
        .and_then(|interrupt| rollover_app::execute(&cli.command, &interrupt));
    if let Err(error) = result {
        eprintln!("error: {error:#}");
        let interrupted = error
            .chain()
            .any(<dyn std::error::Error>::is::<Interrupted>);
        std::process::exit(if interrupted { INTERRUPTED_STATUS } else { 1 });
    }
}
