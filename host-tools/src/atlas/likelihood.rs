//! What a distance says about where the vehicle is: the likelihood that a belief observes with.
//!
//! Views are rendered from the map around landmarks, deviated as in flight ([`Deviation::FLIGHT`]), and projected by the
//! core. Of a sharpness s and a ceiling c, a view's posterior over the landmarks is proportional to
//! exp(−s·min(δ, c)), and over places without landmark to exp(−s·c). Those s and c are taken under which the landmarks
//! that the views were drawn around are likeliest, by the mean of the logarithm; and, with the landmarks left out that
//! show any of the same ground, places without landmark.

use eigenmark_core::{
    atlas::{Atlas, Likelihood},
    eigenspace::Coefficients,
    preprocess::{View, reduce},
};
use rayon::prelude::*;

use crate::{
    evaluate::Deviation,
    learn::scene_of,
    map::Map,
    simulate::{Camera, seeded},
};

/// Landmarks that views are drawn around.
const MAX_VIEWS: usize = 600;

/// Seed of the deviations.
const SEED: u64 = 0x0011_ce11;

/// Sharpnesses per factor of ten that are tried.
const PER_DECADE: i32 = 8;

/// The least δ that a ceiling may be, and a sharpness is measured by.
const LEAST: f32 = 1e-6;

/// Places without landmark, as a share of the landmarks.
const NOWHERE: f64 = 0.3;

/// A view's dissimilarities: the one from the landmark it was drawn around, those near it, and those elsewhere.
struct Draw {
    own: f32,
    near: Vec<f32>,
    elsewhere: Vec<f32>,
}

/// The likelihood under which views of a map are located best, among all landmarks of an atlas. `None` when no landmark
/// has room for a deviated view.
pub(super) fn likelihood(map: &Map, atlas: &Atlas<'_>) -> Option<Likelihood> {
    let draws = draws(map, atlas, SEED);
    if draws.is_empty() {
        return None;
    }
    let mut own: Vec<f32> = draws.iter().map(|draw| draw.own.max(LEAST)).collect();
    own.sort_by(f32::total_cmp);
    let at = |share: f64| own[((own.len() - 1) as f64 * share).round() as usize];
    let median = at(0.5);
    // What no view of a landmark reaches says that there is none.
    let ceilings = [0.25, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0].map(at);
    let candidates: Vec<Likelihood> = ceilings
        .into_iter()
        .flat_map(|ceiling| {
            // Around one over the median: there a likelihood falls by e.
            (-PER_DECADE..=4 * PER_DECADE).map(move |step| Likelihood {
                sharpness: 10_f32.powf(step as f32 / PER_DECADE as f32) / median,
                ceiling,
            })
        })
        .collect();
    let scored = candidates
        .into_par_iter()
        .map(|likelihood| (score(&draws, likelihood), likelihood));
    let best = scored.max_by(|a, b| {
        // Of equals the flatter: it claims less.
        a.0.total_cmp(&b.0)
            .then(b.1.sharpness.total_cmp(&a.1.sharpness))
    });
    best.map(|(_, likelihood)| likelihood)
}

/// Mean logarithm of the posteriors of the right landmarks, and of none where there is none.
fn score(draws: &[Draw], likelihood: Likelihood) -> f64 {
    let Likelihood { sharpness, ceiling } = likelihood;
    let (sharpness, ceiling) = (f64::from(sharpness), f64::from(ceiling));
    let logarithm = |squared: f32| -sharpness * f64::from(squared).min(ceiling);
    // Of sums, from the largest term on.
    let sum = |lists: &[&[f32]], nowhere: f64| -> f64 {
        let squares = || lists.iter().flat_map(|list| list.iter());
        let largest = squares()
            .map(|&squared| logarithm(squared))
            .fold(-sharpness * ceiling, f64::max);
        let total: f64 = squares()
            .map(|&squared| (logarithm(squared) - largest).exp())
            .sum();
        largest + (total + nowhere * (-sharpness * ceiling - largest).exp()).ln()
    };
    let scores = draws.iter().map(|draw| {
        let (near, elsewhere) = (draw.near.as_slice(), draw.elsewhere.as_slice());
        let nowhere = NOWHERE * (near.len() + elsewhere.len()) as f64;
        let here = logarithm(draw.own) - sum(&[near, elsewhere], nowhere);
        let not_here = nowhere.ln() - sharpness * ceiling - sum(&[elsewhere], nowhere);
        here + not_here
    });
    scores.sum::<f64>() / draws.len() as f64
}

/// Deviated views of evenly spread landmarks.
fn draws(map: &Map, atlas: &Atlas<'_>, seed: u64) -> Vec<Draw> {
    let camera = Camera::square_for(atlas);
    let records = atlas.landmarks().records();
    let count = records.len().min(MAX_VIEWS);
    let per_landmark = (MAX_VIEWS / count).min(8);
    // Between two landmarks of a dense table, the nearer one is right.
    let footprint = f64::from(atlas.header().footprint_px);
    let stride = atlas
        .header()
        .survey
        .lattices
        .iter()
        .map(|lattice| lattice.stride_px);
    let stride = f64::from(stride.fold(f32::MAX, f32::min));
    let deviation = Deviation {
        shift: Deviation::FLIGHT.shift.min(0.5 * stride / footprint),
        ..Deviation::FLIGHT.covering(&atlas.header().survey)
    };
    (0..count * per_landmark)
        .into_par_iter()
        .filter_map(|index| {
            let landmark = index / per_landmark * records.len() / count;
            let mut random = seeded(seed, index as u64);
            let nominal = scene_of(&atlas.header().survey.find(records[landmark].view)?);
            let center = nominal.place;
            let (scene, _) = deviation.draw(map, &camera, &nominal, &mut random)?;
            let mut frame = camera.frame();
            camera.render(map, &scene, &mut random, &mut frame);
            let mut view = View::black(atlas.eigenspace().side());
            reduce(&frame.as_frame(), &mut view);
            let mut coefficients = Coefficients::zeros(atlas.eigenspace().dimensions());
            atlas.eigenspace().project(&view, &mut coefficients)?;
            let mut draw = Draw {
                own: 0.0,
                near: Vec::new(),
                elsewhere: Vec::with_capacity(records.len()),
            };
            let table = atlas.landmarks();
            table.dissimilarities(&coefficients, |index, squared| {
                let at = atlas.header().survey.place(records[index as usize].view);
                if index as usize == landmark {
                    draw.own = squared;
                }
                if at.is_some_and(|at| f64::from(at.distance_px(center)) < footprint) {
                    draw.near.push(squared);
                } else {
                    draw.elsewhere.push(squared);
                }
            });
            Some(draw)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use eigenmark_core::eigenspace::Normalize;

    use super::*;
    use crate::{learn::Settings, output::Progress, select::Selection, train::train};

    /// Share of views to which the landmark they were drawn around is likelier than any that shows other ground.
    fn share_first(draws: &[Draw], likelihood: Likelihood) -> f64 {
        let weight = |squared: f32| {
            let squared = f64::from(squared.min(likelihood.ceiling));
            (-f64::from(likelihood.sharpness) * squared).exp()
        };
        let is_first = |draw: &&Draw| {
            let elsewhere = draw.elsewhere.iter().copied().fold(f32::MAX, f32::min);
            weight(draw.own) > weight(elsewhere)
        };
        draws.iter().filter(is_first).count() as f64 / draws.len() as f64
    }

    #[test]
    fn likelihoods_suit_views_that_they_were_not_made_from() {
        let map = Map::city();
        let settings = Settings {
            selection: Selection::All,
            stride_px: Some(50),
            dimensions: 50,
            normalize: Normalize::Std,
            ..Settings::default()
        };
        let trained = train(&map, &settings, false, &Progress::Hidden).expect("trains");
        let atlas = trained.atlas();
        let likelihood = atlas.header().likelihood;
        assert!(likelihood.sharpness > 0.0 && likelihood.sharpness.is_finite());
        assert!(likelihood.ceiling > 0.0 && likelihood.ceiling.is_finite());

        let others = draws(&map, &atlas, SEED + 1);
        assert_eq!(others.len(), MAX_VIEWS);
        let best = score(&others, likelihood);
        for factor in [0.25, 4.0] {
            let Likelihood { sharpness, ceiling } = likelihood;
            let flatter_or_sharper = Likelihood {
                sharpness: sharpness * factor,
                ceiling,
            };
            let other = score(&others, flatter_or_sharper);
            assert!(other < best, "{factor}: {other}, {best}");
        }
        let first = share_first(&others, likelihood);
        println!("{likelihood:?}: {first}");
        assert!(first > 0.5, "{first}");
    }
}
