//! Claims 8 and 9: clusters of views (report 4.1).

use super::{
    Claim, Curve, FIGURE_SCALE, MISSING, Part, Plot, figure,
    statistics::{mean, median, rank_correlation},
};
use crate::experiment::{Cell, Clusters, Grid, REPORT_BLURS};

/// What the report finds.
const OFTEN: std::ops::RangeInclusive<f64> = 0.7..=0.8;

/// Its best linkages.
const BEST: [&str; 3] = ["average", "centroid", "single"];

/// Clusters that the report shows: mean silhouettes of as many are compared over dimensions.
const SHOWN: usize = 15;

/// A number of clusters is natural when it is the best of this share of settings.
const NATURAL: f64 = 0.5;

/// Claims 8 and 9.
pub fn claims(grid: &Grid) -> Vec<Claim> {
    vec![cophenetic(grid), silhouettes(grid)]
}

fn cophenetic(grid: &Grid) -> Claim {
    const STATEMENT: &str =
        "CCC is 0.7–0.8 for Euclidean distance with average, centroid or single linkage (4.1)";
    let clustered = clustered(grid);
    let all = |dissimilarity: &str, linkage: &str| -> Vec<f64> {
        let of = |clusters: &&Clusters| clusters.ccc.get(dissimilarity)?.get(linkage).cloned();
        let found = clustered.iter().filter_map(|(_, clusters)| of(clusters));
        found.flatten().flatten().collect()
    };
    if clustered.is_empty() {
        return Claim::new(8, STATEMENT, vec![Part::open("clusters", MISSING)], vec![]);
    }
    let mut parts: Vec<Part> = BEST
        .into_iter()
        .map(|linkage| {
            let values = all("euclid", linkage);
            let inside = values.iter().filter(|value| OFTEN.contains(value)).count();
            Part::new(
                format!("{linkage} linkage: the median over all settings lies between 0.7 and 0.8"),
                format!(
                    "median {:.3}; {inside} of {} settings between",
                    median(&values),
                    values.len()
                ),
                OFTEN.contains(&median(&values)),
            )
            .decided_by(&[median(&values)])
        })
        .collect();
    let best = BEST.map(|linkage| median(&all("euclid", linkage)));
    let complete = median(&all("euclid", "complete"));
    parts.push(
        Part::new(
            "each of the three is better than complete linkage (median)",
            format!(
                "complete {complete:.3}, the least of the three {:.3}",
                best.iter().copied().fold(f64::MAX, f64::min)
            ),
            best.iter().all(|value| *value > complete),
        )
        .decided_by(&best),
    );
    let medians =
        ["euclid", "ssd", "nssd"].map(|dissimilarity| median(&all(dissimilarity, "average")));
    parts.push(
        Part::new(
            "average linkage: Euclidean distance is better than SSD and nSSD (median)",
            format!(
                "{:.3} against {:.3} and {:.3}",
                medians[0], medians[1], medians[2]
            ),
            medians[0] > medians[1] && medians[0] > medians[2],
        )
        .decided_by(&medians),
    );
    let plot = figure(grid)
        .and_then(|cell| Some((cell, cell.clusters.as_ref()?)))
        .map(|(cell, clusters)| {
            let curve = |(linkage, values): (&String, &Vec<Option<f64>>)| {
                let points = cell.dims.iter().zip(values);
                Curve::new(
                    linkage,
                    points
                        .filter_map(|(&k, value)| Some((k as f64, (*value)?)))
                        .collect::<Vec<_>>(),
                )
            };
            let by_linkage = clusters.ccc.get("euclid").into_iter().flatten();
            Plot::new(
                "Cophenetic correlation, Euclidean distance, scale 1/10, gauss1",
                "dimensions k",
                "CCC",
                by_linkage.map(curve).collect(),
            )
        });
    Claim::new(8, STATEMENT, parts, plot.into_iter().collect())
}

fn silhouettes(grid: &Grid) -> Claim {
    const STATEMENT: &str =
        "Mean silhouette worsens with k, and there is no natural number of clusters (4.1)";
    let clustered = clustered(grid);
    if clustered.is_empty() {
        return Claim::new(9, STATEMENT, vec![Part::open("clusters", MISSING)], vec![]);
    }
    // Of every cell, how the mean silhouette goes with k.
    let mut correlations = Vec::new();
    let (mut least, mut most) = (Vec::new(), Vec::new());
    // How often each number of clusters is the best, of 2 to half as many as there are views.
    let mut wins: Vec<usize> = Vec::new();
    for (cell, clusters) in &clustered {
        let shown: Vec<(f64, f64)> = cell
            .dims
            .iter()
            .zip(&clusters.k_means)
            .filter_map(|(&k, means)| Some((k as f64, means.curve.get(SHOWN - 1)?[0])))
            .collect();
        if shown.len() > 4 {
            correlations.push(rank_correlation(&shown));
        }
        least.extend(shown.first().map(|(_, mean)| *mean));
        most.extend(shown.last().map(|(_, mean)| *mean));
        for means in &clusters.k_means {
            let candidates = 1..means.curve.len() / 2;
            let best = candidates.max_by(|&a, &b| means.curve[a][0].total_cmp(&means.curve[b][0]));
            wins.extend(best.map(|index| index + 1));
        }
    }
    let count = |number: usize| wins.iter().filter(|&&other| other == number).count();
    let mode = wins
        .iter()
        .copied()
        .max_by_key(|&number| (count(number), std::cmp::Reverse(number)));
    let correlation = median(&correlations);
    let worsens = Part::new(
        format!(
            "the mean silhouette of {SHOWN} clusters falls with k: median rank correlation of -0.8 at most"
        ),
        format!(
            "{correlation:.2}; {:.2} in the fewest dimensions, {:.2} in the most",
            mean(&least),
            mean(&most)
        ),
        correlation <= -0.8,
    );
    let mut parts = vec![worsens.decided_by(&[correlation])];
    let what =
        "no number of clusters (2 to n/2) has the best mean silhouette in half of all settings";
    parts.push(match mode {
        Some(mode) => Part::new(
            what,
            format!(
                "{mode} clusters are best in {} of {} settings",
                count(mode),
                wins.len()
            ),
            (count(mode) as f64) < NATURAL * wins.len() as f64,
        ),
        None => Part::open(what, "too few views"),
    });
    let curves = REPORT_BLURS.into_iter().filter_map(|blur| {
        let cell = grid.cell(FIGURE_SCALE, blur)?;
        let means = &cell.clusters.as_ref()?.k_means;
        let points = cell.dims.iter().zip(means);
        let points =
            points.filter_map(|(&k, means)| Some((k as f64, means.curve.get(SHOWN - 1)?[0])));
        Some(Curve::new(cell.blur.clone(), points.collect::<Vec<_>>()))
    });
    let mut plots = vec![Plot::new(
        "Mean silhouette of 15 clusters, scale 1/10",
        "dimensions k",
        "mean silhouette",
        curves.collect(),
    )];
    if let Some((cell, clusters)) =
        figure(grid).and_then(|cell| Some((cell, cell.clusters.as_ref()?)))
    {
        let drawn = [2, 5, 15, 35].into_iter().filter_map(|k| {
            let curve = &clusters.k_means[cell.index_of(k)?].curve;
            let points = (1..)
                .zip(curve)
                .map(|(number, all)| (f64::from(number), all[0]));
            Some(Curve::new(format!("k = {k}"), points.collect::<Vec<_>>()))
        });
        plots.push(Plot::new(
            "Mean silhouette by number of clusters, scale 1/10, gauss1",
            "number of clusters",
            "mean silhouette",
            drawn.collect(),
        ));
    }
    Claim::new(9, STATEMENT, parts, plots)
}

/// The cells that were clustered.
fn clustered(grid: &Grid) -> Vec<(&Cell, &Clusters)> {
    let cells = grid.cells.iter();
    cells
        .filter_map(|cell| Some((cell, cell.clusters.as_ref()?)))
        .collect()
}
