//! Progress with time left, on standard error, where that is a terminal and the user wants it.

use std::fmt::Write;
use std::sync::OnceLock;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

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
        "{percent:>3} % {left:>11} {wide_msg}"
    } else {
        "{percent:>3} % {left:>11} {bar:20} {wide_msg}"
    };
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("left", |state: &ProgressState, text: &mut dyn Write| {
            let left = left(state.elapsed(), state.pos(), state.len().unwrap_or(0));
            // Text in memory takes everything.
            let _ = text.write_str(&left);
        });
    shown(ProgressBar::with_draw_target(
        Some(total as u64),
        ProgressDrawTarget::hidden(),
    ))
    .with_style(style)
    .with_message(what.to_owned())
}

/// Begins another kind of work on the same line, whose time left counts from now.
pub fn begin(bar: &ProgressBar, total: usize, what: &str) {
    bar.set_length(total as u64);
    bar.set_position(0);
    bar.reset_elapsed();
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

/// Time left if the rest goes as what is done, in words; nothing before there is something to go by.
fn left(elapsed: Duration, done: u64, total: u64) -> String {
    const SOMETHING: Duration = Duration::from_millis(500);
    if done == 0 || elapsed < SOMETHING {
        return String::new();
    }
    let share = total.saturating_sub(done) as f64 / done as f64;
    let seconds = elapsed.as_secs_f64() * share;
    match seconds {
        short if short < 99.5 => format!("{short:.0} s left"),
        long if long < 99.5 * 60.0 => format!("{:.0} min left", long / 60.0),
        days => format!("{:.0} h left", days / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::left;

    #[test]
    fn time_left_is_told_in_words() {
        let after = |seconds, done, total| left(Duration::from_secs(seconds), done, total);
        assert_eq!(after(10, 0, 100), "");
        assert_eq!(left(Duration::from_millis(100), 1, 1000), "");
        assert_eq!(after(10, 25, 100), "30 s left");
        assert_eq!(after(10, 100, 100), "0 s left");
        assert_eq!(after(60, 1, 11), "10 min left");
        assert_eq!(after(3600, 1, 10), "9 h left");
        // More was done than expected.
        assert_eq!(after(10, 12, 10), "0 s left");
    }
}
