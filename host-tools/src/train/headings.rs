//! How many headings a map needs: as many as its landmarks tolerate turns.
//!
//! **Method.** An eigenspace of upright views is learned and its landmarks are selected as the settings say. Views are
//! turned, 1° at a time, until their landmark is not the nearest any more (report section 3.5; in f64). Headings are then as
//! far apart as that goes, from one side to the other, on average. In a dense table its neighbours end a landmark's
//! tolerance, so that headings become as dense as places are.
//!
//! **Limits.** Landmarks that are selected from turned views, too, tolerate less or more than these.

use rayon::prelude::*;

use super::{TrainError, lay_out};
use crate::{
    evaluate::{
        Exact, Judge,
        reliability::{End, Limits, Measure, Observer, Steps},
    },
    learn::{Model, PixelBasis, Settings, scene_of},
    map::Map,
    output::Progress,
    select::select,
    simulate::Camera,
};

/// Headings that are chosen at least: with fewer, views are turned by more than 45° from all of them.
const MIN_HEADINGS: f64 = 4.0;

/// Headings that are chosen at most.
const MAX_HEADINGS: f64 = eigenmark_core::landmark::MAX_HEADINGS as f64;

/// Landmarks that are turned, evenly spread over the table.
const MAX_TURNED: usize = 64;

/// What was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredHeadings {
    /// The number of headings that follows from it.
    pub headings: u8,
    /// Mean turn to the left and to the right up to which a landmark is the nearest, in degrees.
    pub orientation_deg: [f64; 2],
}

/// How many headings training with `settings` needs; theirs are not looked at.
///
/// # Errors
/// See [`TrainError`].
pub fn measure_headings(
    map: &Map,
    settings: &Settings,
    progress: &Progress,
) -> Result<MeasuredHeadings, TrainError> {
    let _step = progress.step("turning views");
    let upright = Settings {
        headings: 1,
        ..settings.clone()
    };
    let candidates = lay_out(map, &upright)?;
    let model = Model::learn(&candidates, usize::from(upright.dimensions))?;
    let coordinates = model.whitened(model.project(&candidates), upright.whiten);
    let landmarks = select(map, &candidates, &coordinates, &upright, false)?.landmarks;
    let basis = PixelBasis::new(&model, candidates.preprocess(), upright.whiten);
    let exact = Exact::new(basis, upright.metric, &coordinates, &landmarks);
    let judges = [&exact as &dyn Judge];
    let judges = &judges[..];

    let turned = landmarks.len().min(MAX_TURNED);
    let limits: Vec<Limits> = (0..turned)
        .into_par_iter()
        .map(|part| {
            let landmark = part * landmarks.len() / turned;
            let nominal = scene_of(&candidates.grid().candidate(landmarks[landmark]));
            let mut observer = Observer::new(map, Camera::finest(settings.view_size_px), &judges);
            let (measure, steps) = (Measure::Orientation, Steps::default());
            let [[nearest, _]] = observer.limits(measure, steps, landmark as u32, nominal)[..]
            else {
                unreachable!("one judge, two criteria");
            };
            nearest
        })
        .collect();
    let orientation_deg = [0, 1].map(|side| mean(&limits, side));
    let [left, right] = orientation_deg;
    // A tolerance of nothing asks for as many as there can be.
    let headings = (360.0 / (right - left)).ceil();
    Ok(MeasuredHeadings {
        headings: headings.clamp(MIN_HEADINGS, MAX_HEADINGS) as u8,
        orientation_deg,
    })
}

/// The mean limit to one side of those that do not end at the map; where all do, of all of them.
fn mean(limits: &[Limits], side: usize) -> f64 {
    let of = |counts: &dyn Fn(End) -> bool| {
        let sides = limits.iter().map(|limits| limits[side]);
        let counted: Vec<f64> = sides
            .filter(|limit| counts(limit.end))
            .map(|limit| limit.value)
            .collect();
        (!counted.is_empty()).then(|| counted.iter().sum::<f64>() / counted.len() as f64)
    };
    of(&|end| end != End::Map)
        .or_else(|| of(&|_| true))
        .unwrap_or(0.0)
}
