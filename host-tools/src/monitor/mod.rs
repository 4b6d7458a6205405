//! A live board: what it says over its link, shown, served and logged.
//!
//! ```text
//!   board ─► link ─► watch ─► BoardState ─► terminal, JSON lines
//!                      │           └──────► web page (polls state.json)
//!                      └─► FlightLog ─► a recording that `simulate --replay` shows to the vehicle's software
//! ```
//!
//! | room | does |
//! | --- | --- |
//! | `board` | the state model: replies and times go in, everything that is shown comes out |
//! | `rates` | what the last ten seconds come down to |
//! | `trail` | where the vehicle was, and what its fixes were worth |
//! | `picture` | frames from parts |
//! | `watch` | the loop over the link: asks, listens, opens again what closed or went silent |
//! | `log` | reports and pictures as a recording |
//! | `terminal`, `json`, `words` | the state as lines, as JSON, and its parts in words |
//! | `screen` | lines that are drawn again in place |
//! | `web` | the state as a page on this machine |
//!
//! Times are since the monitor's start unless they are the board's (`time_ms`, since the board's start).
//!
//! **Limits.** Memory is bounded: [`MAX_TRAIL`] positions, ten seconds of reports, a picture and one in parts. The
//! page is served in plain HTTP without a password: by default to this machine only.

mod board;
mod json;
mod log;
mod picture;
mod rates;
mod screen;
mod terminal;
mod trail;
mod watch;
mod web;
mod words;

pub use board::{BoardState, Event, LinkState, News};
pub use json::report_json;
pub use log::FlightLog;
pub use picture::Picture;
pub use rates::Rates;
pub use screen::Screen;
pub use terminal::{line, view};
pub use trail::{Judgement, MAX_TRAIL, Sample, Trail};
pub use watch::{Ended, WatchError, WatchSettings, watch};
pub use web::{Terrain, WebError, WebServer};

#[cfg(test)]
mod tests;
