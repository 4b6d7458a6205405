//! Claims 2 and 3: dissimilarities and profile rankings over dimensions (report 3.3).

use super::{Claim, Curve, FIGURE_SCALE, MISSING, Part, Plot, figure, statistics::mean};
use crate::{
    experiment::{Cell, Grid, REPORT_BLURS},
    select::kendall_tau,
};

/// How near to ½ the mean must come.
const NEAR: f64 = 0.02;

/// The report's groups: up to 2 dimensions, up to 10, more.
const GROUPS: [(usize, usize); 3] = [(1, 2), (3, 10), (11, usize::MAX)];

pub fn dissimilarity_tends_to_a_half(grid: &Grid) -> Claim {
    const STATEMENT: &str = "Mean nSSD tends to ½, and its spread shrinks, as k grows (3.3)";
    let Some(cell) = figure(grid) else {
        return Claim::new(
            2,
            STATEMENT,
            vec![Part::open("scale 1/10, gauss1", MISSING)],
            vec![],
        );
    };
    let (first, last) = (
        cell.dissimilarities[0],
        cell.dissimilarities[cell.dims.len() - 1],
    );
    let (least, most) = (cell.dims[0], cell.dims[cell.dims.len() - 1]);
    let steps = cell.dissimilarities.windows(2);
    let shrinking = steps
        .clone()
        .filter(|pair| pair[1].deviation < pair[0].deviation)
        .count();
    let shrinks = |cell: &Cell| {
        let spreads = &cell.dissimilarities;
        spreads[spreads.len() - 1].deviation < spreads[0].deviation
            && (spreads[spreads.len() - 1].mean - 0.5).abs() <= NEAR
    };
    let everywhere = grid.cells.iter().filter(|cell| shrinks(cell)).count();
    let curve = |cell: &Cell, of: fn(&crate::experiment::Spread) -> f64, name: String| {
        let points = cell.dims.iter().zip(&cell.dissimilarities);
        Curve::new(name, points.map(|(&k, spread)| (k as f64, of(spread))))
    };
    Claim::new(
        2,
        STATEMENT,
        vec![
            Part::new(
                format!("the mean comes within {NEAR} of ½ in all dimensions"),
                format!(
                    "{:.3} for k = {least}, {:.3} for k = {most}",
                    first.mean, last.mean
                ),
                (last.mean - 0.5).abs() <= NEAR,
            ),
            Part::new(
                "the standard deviation shrinks at every step of k",
                format!(
                    "{shrinking} of {} steps; {:.3} for k = {least}, {:.3} for k = {most}",
                    steps.len(),
                    first.deviation,
                    last.deviation
                ),
                shrinking == steps.len(),
            ),
            Part::new(
                "both are so, from the fewest to the most dimensions, at every scale and blur",
                format!("{everywhere} of {} cells", grid.cells.len()),
                everywhere == grid.cells.len(),
            ),
        ],
        vec![Plot::new(
            "nSSD of all pairs of views, scale 1/10, gauss1",
            "dimensions k",
            "nSSD",
            vec![
                curve(cell, |spread| spread.mean, "mean".to_owned()),
                curve(
                    cell,
                    |spread| spread.deviation,
                    "standard deviation".to_owned(),
                ),
            ],
        )],
    )
}

pub fn rankings_form_groups(grid: &Grid) -> Claim {
    const STATEMENT: &str = "Profile rankings fall into three groups of dimensions (1–2, 3–10, > 10) and get stable above 5 \
                             with smoothing (3.3)";
    let Some(cell) = figure(grid) else {
        return Claim::new(
            3,
            STATEMENT,
            vec![Part::open("scale 1/10, gauss1", MISSING)],
            vec![],
        );
    };
    let agreement = agreements(cell);
    // Mean agreement of rankings of two groups; of a group with itself, of different dimensions.
    let between = |one: usize, other: usize| {
        let mut values = Vec::new();
        for (i, &k) in cell.dims.iter().enumerate() {
            for (j, &l) in cell.dims.iter().enumerate() {
                let is_in =
                    |k: usize, group: usize| (GROUPS[group].0..=GROUPS[group].1).contains(&k);
                if i != j && is_in(k, one) && is_in(l, other) {
                    values.push(agreement[i][j]);
                }
            }
        }
        mean(&values)
    };
    let mut parts = Vec::new();
    for (group, name) in [(0, "1–2"), (1, "3–10"), (2, "> 10")] {
        let others: Vec<f64> = (0..3)
            .filter(|&other| other != group)
            .map(|other| between(group, other))
            .collect();
        let (within, without) = (
            between(group, group),
            others.iter().copied().fold(f64::MIN, f64::max),
        );
        parts.push(Part::new(
            format!(
                "group {name}: rankings agree more within (Kendall's τ) than with each other group"
            ),
            format!("{within:.2} within, {without:.2} with the next"),
            within > without,
        )
        .decided_by(&[within, without]));
    }
    let neighbors = |cell: &Cell, above: bool| {
        let agreement = agreements(cell);
        let pairs = (1..cell.dims.len()).filter(|&i| (cell.dims[i - 1] >= 5) == above);
        mean(&pairs.map(|i| agreement[i - 1][i]).collect::<Vec<f64>>())
    };
    let (below, above) = (neighbors(cell, false), neighbors(cell, true));
    parts.push(
        Part::new(
            "neighboring dimensions agree more from 5 on than below",
            format!("τ {below:.2} below, {above:.2} from 5 on"),
            above > below,
        )
        .decided_by(&[below, above]),
    );
    let blurred: Vec<(usize, f64)> = REPORT_BLURS
        .into_iter()
        .enumerate()
        .filter_map(|(index, blur)| Some((index, neighbors(grid.cell(FIGURE_SCALE, blur)?, true))))
        .collect();
    parts.push(if blurred.len() == REPORT_BLURS.len() {
        Part::new(
            "neighboring dimensions from 5 on agree more with gauss3 than without blur",
            format!(
                "τ {:.3} without, {:.3} with gauss3",
                blurred[0].1, blurred[3].1
            ),
            blurred[3].1 > blurred[0].1,
        )
    } else {
        Part::open(
            "neighboring dimensions from 5 on agree more with gauss3 than without blur",
            MISSING,
        )
    });
    let curves = REPORT_BLURS.into_iter().filter_map(|blur| {
        let cell = grid.cell(FIGURE_SCALE, blur)?;
        let agreement = agreements(cell);
        let points = (1..cell.dims.len()).map(|i| (cell.dims[i] as f64, agreement[i - 1][i]));
        Some(Curve::new(cell.blur.clone(), points.collect::<Vec<_>>()))
    });
    Claim::new(
        3,
        STATEMENT,
        parts,
        vec![Plot::new(
            "Agreement of a profile ranking with the one before it, scale 1/10",
            "dimensions k",
            "Kendall's τ",
            curves.collect(),
        )],
    )
}

/// Kendall's τ of the profile rankings of every two numbers of dimensions.
fn agreements(cell: &Cell) -> Vec<Vec<f64>> {
    let row = |one: &Vec<u32>| {
        let others = cell.profiles.iter();
        others
            .map(|other| kendall_tau(one, other).unwrap_or(f64::NAN))
            .collect()
    };
    cell.profiles.iter().map(row).collect()
}
