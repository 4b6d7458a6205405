//! The report's claims, checked on a grid of cells: what holds on this map, with the numbers.
//!
//! The claims are those that the corrections of the report list. Each is split into parts that a number decides; the
//! thresholds stand in the parts' words, and counts are of the cells that are computed. A claim holds when all of its parts do;
//! it is open while cells are missing without which nothing can be said. "Grows with" over more than four values means that Spearman's rank correlation is at least 0.8; over fewer, that
//! every step goes up. Reliability is judged by both criteria: `guaranteed` is the report's (2.39), reconstructed.

mod clusters;
mod localization;
mod profiles;
mod selections;
mod statistics;
mod tolerance;
mod variance;

use serde::Serialize;

pub use statistics::rank_correlation;

use super::{Cell, Grid};
use eigenmark_core::atlas::Blur;

/// The setting that the report shows most: figures 3.3, 3.7, 3.8.
const FIGURE_SCALE: f64 = 10.0;

/// Its blur.
const FIGURE_BLUR: Blur = Blur::Gauss1;

/// A claim, and whether it holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Its number, 1 to 10.
    pub claim: u32,
    /// What the report says, and where.
    pub statement: String,
    /// Whether all parts hold; `None` while one is open.
    pub holds: Option<bool>,
    /// What decides it.
    pub parts: Vec<Part>,
    /// What the numbers were read off.
    pub plots: Vec<Plot>,
}

/// A part of a claim that a number decides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// When it holds.
    pub what: String,
    /// What was found.
    pub numbers: String,
    /// Whether it holds; `None` when nothing could be found.
    pub holds: Option<bool>,
}

/// Curves over one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plot {
    /// What is shown.
    pub title: String,
    /// The horizontal axis, with its unit.
    pub x: String,
    /// The vertical axis, with its unit.
    pub y: String,
    /// One or more.
    pub curves: Vec<Curve>,
}

/// A named curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// Its points, by x.
    pub points: Vec<(f64, f64)>,
}

/// All claims, judged by the cells of a grid.
#[must_use]
pub fn judge(grid: &Grid) -> Vec<Claim> {
    let mut claims = vec![
        variance::grows(grid),
        profiles::dissimilarity_tends_to_a_half(grid),
        profiles::rankings_form_groups(grid),
    ];
    claims.extend(tolerance::claims(grid));
    claims.push(selections::none_is_better(grid));
    claims.extend(clusters::claims(grid));
    claims.push(localization::minima(grid));
    claims
}

/// The claims as a Markdown table: one row per part.
#[must_use]
pub fn markdown(claims: &[Claim]) -> String {
    let mut out = String::from("| claim | part | found | |\n| --- | --- | --- | --- |\n");
    for claim in claims {
        let Claim {
            claim,
            statement,
            holds,
            parts,
            ..
        } = claim;
        out += &format!(
            "| **{claim}** | **{statement}** | | **{}** |\n",
            verdict(*holds)
        );
        for part in parts {
            out += &format!(
                "| {claim} | {} | {} | {} |\n",
                part.what,
                part.numbers,
                verdict(part.holds)
            );
        }
    }
    out
}

/// What a person reads.
#[must_use]
pub fn verdict(holds: Option<bool>) -> &'static str {
    match holds {
        Some(true) => "holds",
        Some(false) => "does not hold",
        None => "open",
    }
}

impl Claim {
    fn new(claim: u32, statement: &str, parts: Vec<Part>, plots: Vec<Plot>) -> Self {
        let all = |parts: &[Part]| {
            parts
                .iter()
                .map(|part| part.holds)
                .collect::<Option<Vec<bool>>>()
        };
        let is_refuted = parts.iter().any(|part| part.holds == Some(false));
        Self {
            claim,
            statement: statement.to_owned(),
            // One part that does not hold is enough.
            holds: if is_refuted {
                Some(false)
            } else {
                all(&parts).filter(|all| !all.is_empty()).map(|_| true)
            },
            parts,
            plots: plots
                .into_iter()
                .filter(|plot| !plot.curves.is_empty())
                .collect(),
        }
    }
}

impl Part {
    fn new(what: impl Into<String>, numbers: impl Into<String>, holds: bool) -> Self {
        Self {
            what: what.into(),
            numbers: numbers.into(),
            holds: Some(holds),
        }
    }

    /// The same, open when one of the numbers that decide is none: of means over nothing.
    fn decided_by(self, numbers: &[f64]) -> Self {
        if numbers.iter().all(|number| number.is_finite()) {
            return self;
        }
        Self::open(self.what, "too few views or dimensions")
    }

    /// What cannot be decided, and why.
    fn open(what: impl Into<String>, why: &str) -> Self {
        Self {
            what: what.into(),
            numbers: why.to_owned(),
            holds: None,
        }
    }
}

impl Plot {
    fn new(title: &str, x: &str, y: &str, curves: Vec<Curve>) -> Self {
        let has_points = |curve: &Curve| !curve.points.is_empty();
        Self {
            title: title.to_owned(),
            x: x.to_owned(),
            y: y.to_owned(),
            curves: curves.into_iter().filter(has_points).collect(),
        }
    }
}

impl Curve {
    fn new(name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().filter(|(_, y)| y.is_finite()).collect(),
        }
    }
}

/// The setting that the report shows most.
fn figure(grid: &Grid) -> Option<&Cell> {
    grid.cell(FIGURE_SCALE, FIGURE_BLUR)
}

/// What is said when cells are missing.
const MISSING: &str = "not all cells are computed";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_holds_when_all_parts_do() {
        let part = |holds| Part {
            what: String::new(),
            numbers: String::new(),
            holds,
        };
        let holds = |parts: &[Option<bool>]| {
            Claim::new(
                1,
                "",
                parts.iter().map(|&holds| part(holds)).collect(),
                vec![],
            )
            .holds
        };
        assert_eq!(holds(&[Some(true), Some(true)]), Some(true));
        assert_eq!(holds(&[Some(true), None]), None);
        assert_eq!(holds(&[Some(false), None]), Some(false));
        assert_eq!(holds(&[]), None);
    }

    #[test]
    fn parts_are_rows() {
        let claim = Claim::new(
            7,
            "no method is better",
            vec![Part::new("range", "0.4", true)],
            vec![],
        );
        let expected = "| claim | part | found | |\n| --- | --- | --- | --- |\n\
                        | **7** | **no method is better** | | **holds** |\n| 7 | range | 0.4 | holds |\n";
        assert_eq!(markdown(&[claim]), expected);
    }
}
