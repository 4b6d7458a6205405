//! Claim 1: covered variance at fixed k grows with smoothing and with down-scaling (report 3.2).

use super::{Claim, Curve, FIGURE_BLUR, MISSING, Part, Plot};
use crate::experiment::{Cell, Grid, REPORT_BLURS, REPORT_SCALES};

/// Share of comparisons that must grow.
const ENOUGH: f64 = 0.95;

/// Scales that are drawn.
const DRAWN: [f64; 4] = [1.0, 5.0, 10.0, 20.0];

pub fn grows(grid: &Grid) -> Claim {
    let with_smoothing = pairs(REPORT_SCALES.into_iter().flat_map(|scale| {
        let neighbors = REPORT_BLURS.windows(2);
        neighbors.map(move |pair| (grid.cell(scale, pair[0]), grid.cell(scale, pair[1])))
    }));
    let with_scaling = pairs(REPORT_BLURS.into_iter().flat_map(|blur| {
        let neighbors = REPORT_SCALES.windows(2);
        neighbors.map(move |pair| (grid.cell(pair[0], blur), grid.cell(pair[1], blur)))
    }));
    let part = |what: &str, counted: Option<(usize, usize)>| match counted {
        Some((grew, of)) => Part::new(
            format!(
                "grows with {what} in {:.0} % of comparisons of neighbors at least",
                100.0 * ENOUGH
            ),
            format!("{grew} of {of}"),
            grew as f64 >= ENOUGH * of as f64,
        ),
        None => Part::open(format!("grows with {what}"), MISSING),
    };
    let of_scale = |scale: f64| {
        let cell = grid.cell(scale, FIGURE_BLUR)?;
        Some(Curve::new(format!("1/{scale}"), covered(cell)))
    };
    let of_blur = |blur| {
        let cell = grid.cell(super::FIGURE_SCALE, blur)?;
        Some(Curve::new(cell.blur.clone(), covered(cell)))
    };
    let plot = |title, curves| Plot::new(title, "dimensions k", "covered variance, %", curves);
    Claim::new(
        1,
        "Covered variance at fixed k grows with smoothing and with down-scaling (3.2)",
        vec![
            part("smoothing", with_smoothing),
            part("down-scaling", with_scaling),
        ],
        vec![
            plot(
                "Covered variance by scale, gauss1",
                DRAWN.into_iter().filter_map(of_scale).collect(),
            ),
            plot(
                "Covered variance by blur, scale 1/10",
                REPORT_BLURS.into_iter().filter_map(of_blur).collect(),
            ),
        ],
    )
}

/// How many comparisons of two cells at the same k grow, of how many; `None` without any pair.
fn pairs<'a>(
    cells: impl Iterator<Item = (Option<&'a Cell>, Option<&'a Cell>)>,
) -> Option<(usize, usize)> {
    let (mut grew, mut of) = (0, 0);
    for (one, other) in cells {
        let (Some(one), Some(other)) = (one, other) else {
            continue;
        };
        let (one, other) = (covered(one), covered(other));
        // All of the variance is covered in both by as many dimensions as one of them has.
        let common = one.iter().zip(&other).take(one.len().min(other.len()) - 1);
        for ((_, less), (_, more)) in common {
            of += 1;
            grew += usize::from(more > less);
        }
    }
    (of > 0).then_some((grew, of))
}

/// Covered variance in percent, in every computed number of dimensions.
fn covered(cell: &Cell) -> Vec<(f64, f64)> {
    let share = |&k: &usize| (k as f64, 100.0 * cell.variance[..k].iter().sum::<f64>());
    cell.dims.iter().map(share).collect()
}
