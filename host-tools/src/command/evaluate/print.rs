//! An evaluation for people.

use std::{fmt, io::Write};

use eigenmark::evaluate::{
    Criterion, EvaluatedTable, JudgeDifference, Plan, Score,
    reliability::{End, Measure, Reliability},
};

use super::localize::Named;

/// Landmarks that are listed; JSON has all.
const LISTED: usize = 100;

/// Every landmark and their means, by both criteria.
pub fn print(out: &mut impl Write, plan: &Plan, table: &EvaluatedTable) -> anyhow::Result<()> {
    for (criterion, what) in [
        (
            Criterion::Nearest,
            "nearest: the landmark is the nearest one",
        ),
        (
            Criterion::Guaranteed,
            "guaranteed: the landmark is nearer than its radius",
        ),
    ] {
        writeln!(out, "{what}")?;
        writeln!(
            out,
            "{:>8}{:>7}{:>16}{:>16}{:>18}{:>16}{:>8}  score, 95 %",
            "landmark", "view", "orientation, °", "altitude", "gamma", "catchment, px", "of map"
        )?;
        for landmark in table.landmarks.iter().take(LISTED) {
            let one = landmark.evaluated.by(criterion);
            let range = |measure, digits| range(one, measure, digits);
            writeln!(
                out,
                "{:>8}{:>7}{:>16}{:>16}{:>18}{:>15}{}{:>6.2} %  {}",
                landmark.evaluated.landmark,
                landmark.evaluated.view,
                range(Measure::Orientation, 0),
                range(Measure::Altitude, 2),
                range(Measure::Gamma, 2),
                one.catchment_px,
                mark(one.catchment_end),
                100.0 * one.catchment_share,
                Shown(landmark.score, criterion)
            )?;
        }
        if table.landmarks.len() > LISTED {
            let more = table.landmarks.len() - LISTED;
            writeln!(out, "{:>8} {more} more; --json lists all", "…")?;
        }
        let mean = table.mean.by(criterion);
        let range = |measure: Measure, digits: usize| {
            let [low, high] = mean.limits[&measure];
            let [low_mark, high_mark] =
                mean.counted[&measure].map(|count| if count == 0 { "+" } else { "" });
            format!("{low:.digits$}{low_mark} … {high:.digits$}{high_mark:<1}")
        };
        writeln!(
            out,
            "{:>8}{:>7}{:>16}{:>16}{:>18}{:>15.0} {:>6.2} %  {}",
            "mean",
            "",
            range(Measure::Orientation, 1),
            range(Measure::Altitude, 3),
            range(Measure::Gamma, 2),
            mean.catchment_px,
            100.0 * mean.catchment_share,
            Shown(table.mean.score, criterion)
        )?;
        for (measure, name, digits) in [
            (Measure::Roll, "roll, °", 1),
            (Measure::Pitch, "pitch, °", 1),
            (Measure::Noise, "noise, gray levels", 1),
            (Measure::Motion, "motion, share of the footprint", 3),
            (Measure::Occlusion, "occlusion, share of the frame", 3),
        ] {
            if plan.measures.contains(&measure) {
                writeln!(
                    out,
                    "{:>8}  {name}: {}",
                    "",
                    range(measure, digits).trim_end()
                )?;
            }
        }
        writeln!(out)?;
    }
    writeln!(
        out,
        "+ at least: the next step would show what lies beyond the map, or is not tried; limits that end at the map are left out of their mean."
    )?;
    Ok(())
}

/// How the core and f64 differ.
pub fn print_difference(
    out: &mut impl Write,
    difference: &JudgeDifference,
    landmarks: usize,
) -> anyhow::Result<()> {
    writeln!(
        out,
        "\nthe core with the atlas against f64: what quantization changes, and calibration of radii; mean differences, regardless of sign"
    )?;
    for (name, by) in [
        ("nearest", &difference.nearest),
        ("guaranteed", &difference.guaranteed),
    ] {
        let range = |measure: Measure, digits: usize| {
            let show = |difference: Option<f64>| {
                difference.map_or("-".to_owned(), |difference| {
                    format!("{difference:.digits$}")
                })
            };
            let [low, high] = by.mean[&measure].map(show);
            format!("{low} and {high}")
        };
        writeln!(
            out,
            "  {name:<10} {} of {landmarks} landmarks equal; orientation by {}°, altitude by {}, gamma by {}, catchment by {:.1} px",
            by.equal,
            range(Measure::Orientation, 2),
            range(Measure::Altitude, 4),
            range(Measure::Gamma, 3),
            by.catchment_px
        )?;
    }
    if let Some(score) = difference.score {
        writeln!(out, "  score      {:+.2} %", 100.0 * score)?;
    }
    Ok(())
}

/// The places that views could be taken for.
pub fn print_distinctness(
    out: &mut impl Write,
    distinctness: &[Named],
    footprint_px: u32,
) -> anyhow::Result<()> {
    writeln!(
        out,
        "\nhow distinct on the whole map, in f64; landmarks are in that order"
    )?;
    writeln!(
        out,
        "{:>16}{:>7}{:>8}{:>12}{:>12}{:>20}{:>12}",
        "", "view", "peaks", "slope, /px", "contrast", "most like it at", "by"
    )?;
    for Named {
        name,
        distinctness: one,
    } in distinctness.iter().take(LISTED)
    {
        let half = f64::from(footprint_px) / 2.0;
        let (rival, by) = one.rival.map_or(("-".to_owned(), "-".to_owned()), |peak| {
            let [x, y] = peak.corner.map(|at| f64::from(at) + half);
            (format!("{x}, {y}"), format!("{:.4}", peak.value))
        });
        let view = if one.view == 0 {
            "-".to_owned()
        } else {
            one.view.to_string()
        };
        let slope = one
            .own
            .map_or("-".to_owned(), |peak| format!("{:.5}", peak.slope));
        writeln!(
            out,
            "{name:>16}{view:>7}{:>8}{slope:>12}{:>12.4}{rival:>20}{by:>12}{}",
            one.peaks,
            one.contrast,
            if one.is_global || one.own.is_none() {
                ""
            } else {
                "  not the global minimum"
            }
        )?;
    }
    Ok(())
}

/// "-12 … 30+".
fn range(one: &Reliability, measure: Measure, digits: usize) -> String {
    let [low, high] = one.limits[&measure];
    let [low_mark, high_mark] = one.ends[&measure].map(mark);
    format!(
        "{low:.digits$}{} … {high:.digits$}{high_mark}",
        low_mark.trim_end()
    )
}

fn mark(end: End) -> &'static str {
    match end {
        End::Failed => " ",
        End::Map | End::Range => "+",
    }
}

/// A score by a criterion, for people.
struct Shown(Option<Score>, Criterion);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(score) = self.0 else {
            return write!(f, "-");
        };
        let (share, [low, high]) = match self.1 {
            Criterion::Nearest => (score.right, score.right_interval),
            Criterion::Guaranteed => (score.guaranteed, score.guaranteed_interval),
        };
        let [share, low, high] = [share, low, high].map(|share| 100.0 * share);
        write!(f, "{share:.1} % ({low:.1} to {high:.1})")
    }
}
