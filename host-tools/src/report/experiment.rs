//! The report of a grid of experiments: one page.

use super::{Explorer, Page};

/// The page; `provenance` says how to make it again.
#[must_use]
pub fn experiment_report(explorer: &Explorer<'_>, provenance: &str) -> String {
    let mut page = Page::new(
        &format!("Eigenmark: experiments on {}", explorer.map.title()),
        "What the report of 2004 tried on one aerial map, tried on this one: views at every scale, blur and number of \
         dimensions, landmarks selected in every way, how far each can be trusted, and which of the report's claims hold.",
    );
    explorer.add_to(&mut page);
    page.finish(provenance)
}
