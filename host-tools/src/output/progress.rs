//! Progress on stderr: a bar when that is a terminal, silence otherwise.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Where progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Bars on stderr when it is a terminal.
    Stderr,
    /// Nowhere.
    Hidden,
}

/// The progress of one long step.
#[derive(Clone, Debug)]
pub struct Bar(ProgressBar);

impl Progress {
    /// Shows that a step without countable parts has begun; the next step or bar replaces it.
    pub fn step(&self, what: &'static str) {
        if *self == Self::Stderr && std::io::IsTerminal::is_terminal(&std::io::stderr()) {
            eprint!("\r\x1b[K{what} …");
        }
    }

    /// A bar of `length` parts.
    ///
    /// # Panics
    /// Never: the template is a constant that tests draw.
    #[must_use]
    pub fn bar(&self, what: &'static str, length: u64) -> Bar {
        let target = match self {
            Self::Stderr => ProgressDrawTarget::stderr(),
            Self::Hidden => ProgressDrawTarget::hidden(),
        };
        let style = ProgressStyle::with_template("{msg:<12} {wide_bar} {pos}/{len} {eta}")
            .expect("valid template");
        self.step("");
        Bar(ProgressBar::with_draw_target(Some(length), target)
            .with_style(style)
            .with_message(what))
    }
}

impl Bar {
    /// Counts `parts` more as done.
    pub fn inc(&self, parts: u64) {
        self.0.inc(parts);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
