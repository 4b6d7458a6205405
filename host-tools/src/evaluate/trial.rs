//! Many deviated views, counted.

use eigenmark_core::{
    atlas::Atlas,
    localizer::{Fix, Localizer},
};
use rand::RngExt;
use rayon::prelude::*;
use serde::Serialize;

use super::Deviation;
use crate::{
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

    fn of(fix: Option<Fix>, truth: Option<usize>) -> Self {
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

/// Locates `views_per_landmark` deviated views of every landmark; one outcome per landmark. A landmark without room
/// on the map to deviate has an outcome of zero views.
#[must_use]
pub fn deviated_views(
    map: &Map,
    atlas: &Atlas<'_>,
    deviation: &Deviation,
    views_per_landmark: usize,
    seed: u64,
    progress: &Progress,
) -> Vec<Outcome> {
    let camera = Camera::square_for(atlas);
    let bar = progress.bar("evaluating", atlas.landmarks().len() as u64);
    let outcomes = (0..atlas.landmarks().len())
        .into_par_iter()
        .map(|landmark| {
            let mut localizer = Localizer::new(atlas.clone());
            let mut random = seeded(seed, landmark as u64);
            let mut frame = camera.frame();
            let mut outcome = Outcome::default();
            for _ in 0..views_per_landmark {
                let Some(scene) = deviation.draw(map, atlas, landmark, &mut random) else {
                    break;
                };
                camera.render(map, &scene, &mut random, &mut frame);
                outcome = outcome.plus(Outcome::of(
                    localizer.locate(&frame.as_frame()),
                    Some(landmark),
                ));
            }
            bar.inc(1);
            outcome
        })
        .collect();
    bar.finish();
    outcomes
}

/// Locates `views` views of another map, at random places and headings: every fix is wrong.
#[must_use]
pub fn foreign_views(foreign: &Map, atlas: &Atlas<'_>, views: usize, seed: u64) -> Outcome {
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
            let place = eigenmark_core::landmark::Point {
                x_px: anywhere(foreign.width()),
                y_px: anywhere(foreign.height()),
            };
            // Quarter turns keep the window on the map.
            let heading_rad =
                f64::from(random.random_range(0..4_u32)) * std::f64::consts::FRAC_PI_2;
            let scene = Scene {
                heading_rad,
                noise: 2.0,
                ..Scene::nominal(place)
            };
            let mut frame = camera.frame();
            camera.render(foreign, &scene, &mut random, &mut frame);
            Outcome::of(
                Localizer::new(atlas.clone()).locate(&frame.as_frame()),
                None,
            )
        })
        .reduce(Outcome::default, Outcome::plus)
}

/// The sum of some outcomes.
impl std::iter::Sum for Outcome {
    fn sum<I: Iterator<Item = Self>>(outcomes: I) -> Self {
        outcomes.fold(Self::default(), Self::plus)
    }
}
