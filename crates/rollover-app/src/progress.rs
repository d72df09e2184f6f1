//! Progress with time left, on standard error, where that is a terminal and the user wants it.

use std::sync::OnceLock;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output::is_quiet;

/// Narrower than this there is no room for a bar beside the words.
const ROOM_FOR_BAR: u16 = 60;

/// All bars of the process, so that work on several threads does not overwrite each other's lines.
fn all() -> &'static MultiProgress {
    static ALL: OnceLock<MultiProgress> = OnceLock::new();
    ALL.get_or_init(MultiProgress::new)
}

/// A bar of `total` pieces of work. It draws nothing where standard error is no terminal, or with
/// `--quiet`.
#[must_use]
pub fn bar(total: usize, what: &str) -> ProgressBar {
    let template = if narrow() {
        "{percent:>3} % {eta:>4} left {wide_msg}"
    } else {
        "{percent:>3} % {eta:>4} left {bar:20} {wide_msg}"
    };
    shown(ProgressBar::with_draw_target(
        Some(total as u64),
        ProgressDrawTarget::hidden(),
    ))
    .with_style(
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
    )
    .with_message(what.to_owned())
}

/// Begins another kind of work on the same line, whose time left counts from now.
pub fn begin(bar: &ProgressBar, total: usize, what: &str) {
    bar.set_length(total as u64);
    bar.set_position(0);
    bar.reset_eta();
    bar.set_message(what.to_owned());
}

fn shown(bar: ProgressBar) -> ProgressBar {
    if is_quiet() { bar } else { all().add(bar) }
}

/// Whether standard error is a narrow terminal.
fn narrow() -> bool {
    terminal_size::terminal_size_of(std::io::stderr())
        .is_some_and(|(terminal_size::Width(width), _)| width < ROOM_FOR_BAR)
}
