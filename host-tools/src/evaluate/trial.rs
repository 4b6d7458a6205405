//! Many deviated views, counted.

use std::f64::consts::FRAC_PI_2;

use eigenmark_core::{
    atlas::Atlas,
    landmark::Point,
    localizer::{Fix, Localizer},
};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

use super::Deviation;
use crate::{
    learn::scene_of,
    map::Map,
    output::Progress,
    simulate::{Camera, Scene, seeded},
};

/// What happened to some views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// Views located.
    pub views: u64,
    /// Fixes on the landmark that the view deviates from.
    pub right: u64,
    /// Fixes that were guaranteed.
    pub guaranteed: u64,
    /// Fixes that were guaranteed and on another landmark.
    pub guaranteed_wrong: u64,
    /// Fixes that were known.
    pub known: u64,
    /// Fixes that were known and on another landmark.
    pub known_wrong: u64,
}

impl Outcome {
    /// A count as a share of the views, in percent.
    #[must_use]
    pub fn percent(&self, count: u64) -> f64 {
        100.0 * count as f64 / self.views.max(1) as f64
    }

    /// The outcome of one view of landmark `truth` (0-based), or of no landmark at all.
    #[must_use]
    pub fn of(fix: Option<Fix>, truth: Option<usize>) -> Self {
        let Some(fix) = fix else {
            return Self {
                views: 1,
                ..Self::default()
            };
        };
        let is_right = truth == Some(fix.landmark as usize);
        Self {
            views: 1,
            right: is_right.into(),
            guaranteed: fix.guaranteed.into(),
            guaranteed_wrong: (fix.guaranteed && !is_right).into(),
            known: fix.known.into(),
            known_wrong: (fix.known && !is_right).into(),
        }
    }

    /// The outcomes of [`deviated_fixes`], one per landmark.
    #[must_use]
    pub fn of_landmarks(fixes: &[Vec<Option<Fix>>]) -> Vec<Self> {
        let outcome = |(truth, fixes): (usize, &Vec<Option<Fix>>)| {
            fixes.iter().map(|&fix| Self::of(fix, Some(truth))).sum()
        };
        fixes.iter().enumerate().map(outcome).collect()
    }

    fn plus(self, other: Self) -> Self {
        Self {
            views: self.views + other.views,
            right: self.right + other.right,
            guaranteed: self.guaranteed + other.guaranteed,
            guaranteed_wrong: self.guaranteed_wrong + other.guaranteed_wrong,
            known: self.known + other.known,
            known_wrong: self.known_wrong + other.known_wrong,
        }
    }
}

/// Locates `views_per_landmark` deviated views of every landmark; one list of fixes per landmark. The list of a
/// landmark without room on the map to deviate is empty.
#[must_use]
pub fn deviated_fixes(
    map: &Map,
    atlas: &Atlas<'_>,
    deviation: &Deviation,
    views_per_landmark: usize,
    seed: u64,
    progress: &Progress,
) -> Vec<Vec<Option<Fix>>> {
    let landmarks: Vec<usize> = (0..atlas.landmarks().len()).collect();
    fixes_around(
        map,
        atlas,
        &landmarks,
        deviation,
        views_per_landmark,
        seed,
        progress,
    )
}

/// The same for some landmarks (0-based) only, in their order.
#[must_use]
pub fn fixes_around(
    map: &Map,
    atlas: &Atlas<'_>,
    landmarks: &[usize],
    deviation: &Deviation,
    views_per_landmark: usize,
    seed: u64,
    progress: &Progress,
) -> Vec<Vec<Option<Fix>>> {
    let camera = Camera::square_for(atlas);
    let bar = progress.bar("deviating", landmarks.len() as u64);
    landmarks
        .par_iter()
        .map(|&landmark| {
            let mut localizer = Localizer::new(atlas.clone());
            let mut random = seeded(seed, landmark as u64);
            let record = atlas.landmarks().records().get(landmark);
            let candidate = record.and_then(|record| atlas.survey().find(record.view));
            let nominal = candidate.map(|candidate| scene_of(&candidate));
            let mut frame = camera.frame();
            let mut fixes = Vec::with_capacity(views_per_landmark);
            for _ in 0..views_per_landmark {
                let drawn = nominal
                    .as_ref()
                    .and_then(|nominal| deviation.draw(map, &camera, nominal, &mut random));
                let Some((scene, _)) = drawn else {
                    break;
                };
                camera.render(map, &scene, &mut random, &mut frame);
                fixes.push(localizer.locate(&frame.as_frame()));
            }
            bar.inc(1);
            fixes
        })
        .collect()
}

/// Locates `views` views of another map, at random places and headings.
#[must_use]
pub fn foreign_fixes(
    foreign: &Map,
    atlas: &Atlas<'_>,
    views: usize,
    seed: u64,
) -> Vec<Option<Fix>> {
    let camera = Camera::square_for(atlas);
    let side = f64::from(atlas.header().footprint_px);
    (0..views)
        .into_par_iter()
        .map(|index| {
            let mut random = seeded(seed, index as u64);
            let mut anywhere = |size: u32| {
                let margin = (side / 2.0).min(f64::from(size) / 2.0);
                random.random_range(margin..=f64::from(size) - margin) as f32
            };
            let place = Point {
                x_px: anywhere(foreign.width()),
                y_px: anywhere(foreign.height()),
            };
            // Quarter turns keep the window on the map.
            let heading_rad = f64::from(random.random_range(0..4_u32)) * FRAC_PI_2;
            let scene = Scene {
                heading_rad,
                noise: 2.0,
                ..Scene::nominal(place)
            };
            let mut frame = camera.frame();
            camera.render(foreign, &scene, &mut random, &mut frame);
            Localizer::new(atlas.clone()).locate(&frame.as_frame())
        })
        .collect()
}

/// The sum of some outcomes.
impl std::iter::Sum for Outcome {
    fn sum<I: Iterator<Item = Self>>(outcomes: I) -> Self {
        outcomes.fold(Self::default(), Self::plus)
    }
}
