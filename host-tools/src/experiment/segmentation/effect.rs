//! What segmentation by color is worth: how far landmarks can be trusted with it and without; report section 5.2.1, which
//! hopes for less trouble with brightness, contrast and noise.
//!
//! **What.** Landmarks are learned, selected and evaluated as in the report (section 3.5), in three variants: on the plain
//! map; on the segmented map, by a camera that segments what it sees with the map's palette; and on the segmented map, by a
//! plain gray camera.
//!
//! **Method.** By [`evaluate`] in double precision. Where the camera segments, light changes before: gamma is applied to
//! every color sample of the landmark's window, which is then segmented with the known palette, reduced and judged, step by
//! step outward to the last step before the first failure. What turns and climbs sees the segmented map itself.
//!
//! **Cost.** Three evaluations of a few landmarks, and one segmentation of a window per step of gamma: on 1600×1200 pixels
//! some ten seconds of processor time.
//!
//! **Limits.** Each variant selects its own landmarks, and means are over those whose limit does not end at the map.

use image::{GrayImage, RgbImage, imageops::crop_imm};
use rayon::prelude::*;
use serde::Serialize;

use crate::{
    evaluate::{
        Criterion, Deviation, Evaluated, EvaluatedMean, EvaluatedTable, Everywhere, Exact, Journal,
        JournalError, Judge, Plan, Site, evaluate,
        reliability::{End, Limit, Limits, Measure, Steps},
    },
    experiment::{LearnError, cell::learn as learn_space},
    learn::Settings,
    map::{Integral, Map, PaletteColor, SegmentError, Segmentation, luminance},
    output::Progress,
    select::{SelectionError, select},
    simulate::gamma_levels,
};

/// How a map is learned and seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// Learned on the plain map and seen by a plain camera.
    Plain,
    /// Learned on the segmented map and seen by a camera that segments what it sees.
    Segmented,
    /// Learned on the segmented map and seen by a plain camera.
    SegmentedMapOnly,
}

/// How far the landmarks of a variant can be trusted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariantReliability {
    /// Which.
    pub variant: Variant,
    /// Candidate numbers of its landmarks, 1-based, best first.
    pub landmarks: Vec<u32>,
    /// Share of the candidates' variance that the dimensions cover.
    pub covered_variance: f64,
    /// Mean limits of orientation, altitude and gamma, and catchments, by both criteria.
    #[serde(flatten)]
    pub mean: EvaluatedMean,
}

/// What was found about a map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SegmentationEffect {
    /// The palette, from dark to light.
    pub palette: Vec<PaletteColor>,
    /// The segmented map; not serialized.
    #[serde(skip)]
    pub picture: GrayImage,
    /// In the order of [`Variant`].
    pub variants: Vec<VariantReliability>,
}

/// Why nothing was found.
#[derive(Debug, thiserror::Error)]
pub enum SegmentationEffectError {
    /// The picture cannot be segmented.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// A variant cannot be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// It has no such landmarks.
    #[error(transparent)]
    Select(#[from] SelectionError),
    /// Never: nothing is written.
    #[error(transparent)]
    Journal(#[from] JournalError),
}

/// Measures the three variants on the map `picture`: landmarks and dimensions by `settings`, `colors` colors by `seed`, and
/// gamma in `steps`.
///
/// # Errors
/// When the picture cannot be segmented, or a variant not be learned as the settings say.
pub fn segmentation_effect(
    picture: &RgbImage,
    settings: &Settings,
    (colors, seed): (usize, u64),
    steps: Steps,
    progress: &Progress,
) -> Result<SegmentationEffect, SegmentationEffectError> {
    let segmentation = Segmentation::new(picture, colors, seed)?;
    let plain = Map::from_luminance("plain", luminance(picture));
    let segmented = Map::from_luminance("segmented", segmentation.gray());
    let palette = segmentation.colors();

    let of_plain = Learned::new(&plain, settings)?;
    let of_segmented = Learned::new(&segmented, settings)?;
    let mut seen_segmented = of_segmented.evaluate(&segmented, steps, progress)?;
    seen_segmented
        .par_iter_mut()
        .zip(&of_segmented.sites)
        .try_for_each(|(found, site)| {
            let window_px = settings.view_size_px;
            let [x, y] = site.corner(window_px);
            let window = crop_imm(picture, x, y, window_px, window_px).to_image();
            let light = Light {
                window: &window,
                palette: &palette,
                exact: &of_segmented.exact,
                steps,
            };
            light.replace_gamma(found)
        })?;

    let variants = [
        (
            Variant::Plain,
            &of_plain,
            of_plain.evaluate(&plain, steps, progress)?,
        ),
        (Variant::Segmented, &of_segmented, seen_segmented),
        (
            Variant::SegmentedMapOnly,
            &of_segmented,
            of_segmented.evaluate(&plain, steps, progress)?,
        ),
    ];
    let reliability =
        |(variant, learned, found): (Variant, &Learned, Vec<Evaluated>)| VariantReliability {
            variant,
            landmarks: learned.sites.iter().map(|site| site.view).collect(),
            covered_variance: learned.covered_variance,
            mean: EvaluatedTable::new(found).mean,
        };
    Ok(SegmentationEffect {
        palette: segmentation.palette().to_vec(),
        picture: segmentation.gray(),
        variants: variants.into_iter().map(reliability).collect(),
    })
}

/// The eigenspace of a map, and its landmarks.
struct Learned {
    exact: Exact,
    sites: Vec<Site>,
    window_px: u32,
    covered_variance: f64,
}

impl Learned {
    fn new(map: &Map, settings: &Settings) -> Result<Self, SegmentationEffectError> {
        let space = learn_space(map, settings, usize::from(settings.dimensions))?;
        let spanned = Settings {
            dimensions: space.dimensions() as u8,
            ..settings.clone()
        };
        let landmarks =
            select(map, &space.candidates, &space.coordinates, &spanned, false)?.landmarks;
        let site = |&view: &u32| Site::from(&space.candidates.grid().candidate(view));
        let basis = space.basis.clone();
        Ok(Self {
            exact: Exact::new(basis, settings.metric, &space.coordinates, &landmarks),
            sites: landmarks.iter().map(site).collect(),
            window_px: settings.view_size_px,
            covered_variance: space.model.covered_variance(),
        })
    }

    /// Every landmark, as seen on `map`.
    fn evaluate(
        &self,
        map: &Map,
        steps: Steps,
        progress: &Progress,
    ) -> Result<Vec<Evaluated>, JournalError> {
        let plan = Plan {
            measures: Measure::REPORT.to_vec(),
            steps,
            deviation: Deviation::NONE,
            views: 0,
            seed: 0,
        };
        let integral = Integral::new(map.luminance());
        let everywhere = [Everywhere::densely(
            &self.exact,
            map,
            &integral,
            self.window_px,
        )];
        let journal = Journal::none();
        let found = evaluate(map, &self.sites, &everywhere, &plan, &journal, progress)?;
        // By landmark, by the only judge.
        Ok(found.into_iter().flatten().collect())
    }
}

/// The window of a landmark under changing light, seen by a camera that segments.
struct Light<'a> {
    window: &'a RgbImage,
    palette: &'a [[u8; 3]],
    exact: &'a Exact,
    steps: Steps,
}

impl Light<'_> {
    /// Puts limits of gamma before segmentation in the place of those after it.
    fn replace_gamma(&self, found: &mut Evaluated) -> Result<(), SegmentError> {
        let lower = self.outward(found.landmark - 1, -1)?;
        let upper = self.outward(found.landmark - 1, 1)?;
        for (by, criterion) in [(&mut found.nearest, 0), (&mut found.guaranteed, 1)] {
            let limits: Limits = [lower[criterion], upper[criterion]];
            by.limits
                .insert(Measure::Gamma, limits.map(|limit| limit.value));
            by.ends
                .insert(Measure::Gamma, limits.map(|limit| limit.end));
        }
        Ok(())
    }

    /// To one side, by criterion: the last step before the first failure.
    fn outward(&self, landmark: u32, direction: i32) -> Result<[Limit; 2], SegmentError> {
        let mut limits = [None; 2];
        let mut last = Measure::Gamma.nominal();
        for step in 0.. {
            let Some(gamma) = Measure::Gamma.value(direction * step, self.steps) else {
                break;
            };
            let view = self.view(gamma)?;
            let verdict = self.exact.judge(&view);
            for (limit, criterion) in limits.iter_mut().zip(Criterion::ALL) {
                if limit.is_none() && !criterion.holds(verdict, landmark) {
                    *limit = Some(Limit {
                        value: last,
                        end: End::Failed,
                    });
                }
            }
            if limits.iter().all(Option::is_some) {
                break;
            }
            last = gamma;
        }
        let still = Limit {
            value: last,
            end: End::Range,
        };
        Ok(limits.map(|limit| limit.unwrap_or(still)))
    }

    /// The window in that light: its colors, then the palette's grays, then a view.
    fn view(&self, gamma: f64) -> Result<Vec<u8>, SegmentError> {
        let levels = gamma_levels(gamma);
        let mut lit = self.window.clone();
        for sample in lit.iter_mut() {
            *sample = levels[usize::from(*sample)];
        }
        let gray = Segmentation::with_palette(&lit, self.palette)?.gray();
        let side = self.exact.side();
        let mut view = vec![0; side * side];
        Integral::new(&gray).reduce((0, 0), gray.width(), side, &mut view);
        Ok(view)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{map::city, select::Selection};

    fn effect(colors: usize) -> SegmentationEffect {
        let picture = crop_imm(&city::draw(), 200, 100, 500, 400).to_image();
        let settings = Settings {
            view_size_px: 100,
            dimensions: 8,
            selection: Selection::profile(4),
            ..Settings::default()
        };
        let steps = Steps { gamma: 0.5 };
        segmentation_effect(&picture, &settings, (colors, 1), steps, &Progress::Hidden)
            .expect("four landmarks")
    }

    #[test]
    fn variants_are_learned_and_seen_as_they_say() {
        let found = effect(5);
        let [plain, segmented, map_only] = &found.variants[..] else {
            panic!("three variants");
        };
        assert_eq!(segmented.landmarks, map_only.landmarks);
        assert_eq!(segmented.covered_variance, map_only.covered_variance);
        assert_eq!(found.palette.len(), 5);
        assert_eq!(found.picture.dimensions(), (500, 400));
        for one in [plain, segmented] {
            // Its own view is guaranteed: the nominal step passes, and something around it.
            let [low, high] = one.mean.nearest.limits[&Measure::Gamma];
            assert!(low <= 1.0 && high >= 1.0);
            assert!(one.mean.guaranteed.catchment_px >= 1.0, "{one:?}");
        }
        let written = serde_json::to_value(&found).expect("numbers");
        assert_eq!(written["variants"][1]["variant"], "segmented");
        assert!(written["variants"][0]["nearest"]["gamma"][1].is_f64());
        assert!(written["picture"].is_null());
    }

    #[test]
    fn what_cannot_be_learned_is_refused() {
        let picture = RgbImage::new(50, 50);
        let steps = Steps::default();
        let settings = Settings::default();
        let found = segmentation_effect(&picture, &settings, (3, 1), steps, &Progress::Hidden);
        assert!(matches!(found, Err(SegmentationEffectError::Learn(_))));
        let found = segmentation_effect(&picture, &settings, (0, 1), steps, &Progress::Hidden);
        assert!(matches!(found, Err(SegmentationEffectError::Segment(_))));
    }
}
