//! Claim 7: no selection method is better than the other (report 3.5, 5.1).

use super::{Claim, Curve, MISSING, Part, Plot, figure};
use crate::{
    evaluate::reliability::{MeanReliability, Measure},
    experiment::{Grid, Method},
};

/// How often one may win without being better.
const EVEN: std::ops::RangeInclusive<f64> = 0.25..=0.75;

/// What is compared.
const NAMES: [&str; 4] = ["orientation", "altitude", "gamma", "catchment"];

pub fn none_is_better(grid: &Grid) -> Claim {
    const STATEMENT: &str = "No selection method is better than the other (3.5, 5.1)";
    let mut parts = Vec::new();
    for (by, criterion) in [(1, "guaranteed"), (0, "nearest")] {
        for (index, name) in NAMES.into_iter().enumerate() {
            let what = format!(
                "{name}, {criterion}: IPCA from the best by profile tolerates more than profile in 25 to 75 % of settings with \
                 k > 5"
            );
            let (mut won, mut of) = (0, 0);
            for cell in &grid.cells {
                for &k in cell.dims.iter().filter(|&&k| k > 5) {
                    let tables =
                        [Method::IpcaProfile, Method::Profile].map(|method| cell.table(method, k));
                    let [Some(ipca), Some(profile)] = tables else {
                        continue;
                    };
                    let [ipca, profile] =
                        [ipca, profile].map(|table| tolerance(&table.mean()[by], index));
                    of += usize::from(ipca != profile);
                    won += usize::from(ipca > profile);
                }
            }
            parts.push(if of == 0 {
                Part::open(what, MISSING)
            } else {
                let share = won as f64 / of as f64;
                Part::new(
                    what,
                    format!("{won} of {of}, {:.0} %", 100.0 * share),
                    EVEN.contains(&share),
                )
            });
        }
    }
    let plots = figure(grid).map(|cell| {
        let curve = |method: Method| {
            let points = cell
                .dims
                .iter()
                .filter_map(|&k| Some((k as f64, tolerance(&cell.table(method, k)?.mean()[0], 0))));
            Curve::new(method.name(), points.collect::<Vec<_>>())
        };
        Plot::new(
            "Range of orientation by method, nearest, scale 1/10, gauss1",
            "dimensions k",
            "orientation, degrees",
            Method::REPORT.into_iter().map(curve).collect(),
        )
    });
    Claim::new(7, STATEMENT, parts, plots.into_iter().collect())
}

/// A mean range: of degrees, of altitude, of gamma in octaves; or the catchment.
fn tolerance(mean: &MeanReliability, index: usize) -> f64 {
    let Some(measure) = Measure::REPORT.get(index) else {
        return mean.catchment_share;
    };
    let [low, high] = mean.limits[measure];
    match measure {
        Measure::Gamma => (high / low).log2(),
        _ => high - low,
    }
}
