//! Claim 10: localization matrices of strongly down-scaled maps (report 4.2).

use super::{Claim, Curve, FIGURE_BLUR, MISSING, Part, Plot, statistics::rank_correlation};
use crate::experiment::{Grid, Localized, REPORT_BLURS, REPORT_SCALES};

pub fn minima(grid: &Grid) -> Claim {
    let of_blur = |blur| -> Vec<(f64, &Localized)> {
        let cells = REPORT_SCALES
            .into_iter()
            .filter_map(|scale| grid.cell(scale, blur));
        // The last is in the most dimensions, and says most.
        cells
            .filter_map(|cell| Some((cell.scale, cell.localization.last()?)))
            .collect()
    };
    let found = of_blur(FIGURE_BLUR);
    let counts: Vec<(f64, f64)> = found
        .iter()
        .map(|(scale, one)| (*scale, one.mean_minima))
        .collect();
    let more = "more local minima with down-scaling: rank correlation with the scale factor of 0.8 at least";
    let elsewhere =
        "the global minimum of a view turned by ten degrees lies elsewhere at some scale";
    let parts = match (counts.first(), counts.last()) {
        (Some((finest, few)), Some((coarsest, many))) if counts.len() >= 3 => {
            let correlation = rank_correlation(&counts);
            let shares: Vec<(f64, f64)> = found
                .iter()
                .filter_map(|(scale, one)| Some((*scale, one.elsewhere?)))
                .collect();
            let most =
                shares.iter().copied().fold(
                    (0.0, 0.0),
                    |most, one| if one.1 > most.1 { one } else { most },
                );
            vec![
                Part::new(
                    more,
                    format!(
                        "{correlation:.2} over {} scales; {few:.0} at 1/{finest}, {many:.0} at 1/{coarsest}",
                        counts.len()
                    ),
                    correlation >= 0.8,
                ),
                if shares.is_empty() {
                    Part::open(elsewhere, "no landmark can be turned on the map")
                } else {
                    let numbers = match most {
                        (_, 0.0) => "of no view at any scale".to_owned(),
                        (scale, share) => {
                            format!("of {:.0} % of the views at 1/{scale}", 100.0 * share)
                        }
                    };
                    Part::new(elsewhere, numbers, most.1 > 0.0)
                },
            ]
        }
        _ => vec![Part::open(more, MISSING), Part::open(elsewhere, MISSING)],
    };
    let curves = |value: fn(&Localized) -> Option<f64>| -> Vec<Curve> {
        REPORT_BLURS
            .into_iter()
            .map(|blur| {
                let points = of_blur(blur).into_iter();
                let points = points.filter_map(|(scale, one)| Some((scale, value(one)?)));
                Curve::new(crate::learn::blur_name(blur), points.collect::<Vec<_>>())
            })
            .collect()
    };
    let plot =
        |title, y, curves| Plot::new(title, "scale factor, map pixels per view pixel", y, curves);
    Claim::new(
        10,
        "Localization matrices of strongly down-scaled maps have more local minima; the global minimum can be elsewhere \
         (4.2)",
        parts,
        vec![
            plot(
                "Local minima, k = 18, mean over the fixed landmarks",
                "local minima",
                curves(|one| Some(one.mean_minima)),
            ),
            plot(
                "Views turned by ten degrees whose global minimum is elsewhere",
                "share of views, %",
                curves(|one| one.elsewhere.map(|share| 100.0 * share)),
            ),
        ],
    )
}
