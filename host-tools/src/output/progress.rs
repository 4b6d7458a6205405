//! Progress on stderr: shown when that is a terminal, silence otherwise.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often it is drawn.
const TICK: Duration = Duration::from_millis(120);

/// Where progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// On stderr, when it is a terminal.
    Stderr,
    /// Nowhere.
    Hidden,
}

/// The progress of one step; it disappears when this is dropped.
#[derive(Debug)]
pub struct Bar(ProgressBar);

impl Progress {
    /// Shows a step without countable parts.
    #[must_use = "the step is shown until this is dropped"]
    pub fn step(&self, what: &'static str) -> Bar {
        self.shown(ProgressBar::new_spinner(), "{spinner} {msg}", what)
    }

    /// A bar of `length` parts.
    #[must_use = "the bar is shown until this is dropped"]
    pub fn bar(&self, what: &'static str, length: u64) -> Bar {
        self.shown(
            ProgressBar::new(length),
            "{msg:<12} {wide_bar} {pos}/{len} {eta}",
            what,
        )
    }

    fn shown(self, bar: ProgressBar, template: &str, what: &'static str) -> Bar {
        bar.set_draw_target(match self {
            Self::Stderr => ProgressDrawTarget::stderr(),
            Self::Hidden => ProgressDrawTarget::hidden(),
        });
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what);
        bar.enable_steady_tick(TICK);
        Bar(bar)
    }
}

impl Bar {
    /// Says what is being done now.
    pub fn say(&self, what: String) {
        self.0.set_message(what);
    }

    /// Counts `parts` more as done.
    pub fn inc(&self, parts: u64) {
        self.0.inc(parts);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
