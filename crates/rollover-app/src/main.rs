//! The `rollover-app` command.

use clap::Parser;
use rollover_app::cli::Cli;
use rollover_app::interrupt::{FAILED_STATUS, INTERRUPTED_STATUS, Interrupt, Interrupted};
use rollover_app::output;

fn main() {
    let cli = Cli::parse();
    output::set_quiet(cli.quiet);
    let result = Interrupt::on_signals()
        .map_err(anyhow::Error::from)
        .and_then(|interrupt| rollover_app::execute(&cli.command, &interrupt));
    if let Err(error) = result {
        output::print_error(&error);
        let interrupted = error
            .chain()
            .any(<dyn std::error::Error>::is::<Interrupted>);
        std::process::exit(if interrupted {
            INTERRUPTED_STATUS
        } else {
            FAILED_STATUS
        });
    }
}
