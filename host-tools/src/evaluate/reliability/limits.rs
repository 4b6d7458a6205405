//! How far a view may deviate in one respect: outward from the nominal view, step by step, to the last step before the
//! first failure; report section 3.5, ERRATA.

use eigenmark_core::landmark::Point;
use rand::Rng;
use serde::{Deserialize, Serialize};

use super::{Measure, Steps};
use crate::{
    evaluate::judge::{Criterion, Judge, Verdict},
    map::{Integral, Map},
    simulate::{Camera, CameraFrame, Scene, seeded},
};

/// Why a limit is where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// The next step fails.
    Failed,
    /// The next step would show what lies beyond the map: the limit is at least this.
    Map,
    /// There is no next step: the limit is at least this.
    Range,
}

/// The last step that passes to one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Its value.
    pub value: f64,
    /// Why it is the last.
    pub end: End,
}

/// A lower and an upper limit.
pub type Limits = [Limit; 2];

/// Looks at the map from deviating scenes and asks judges about them.
pub(crate) struct Observer<'a> {
    map: &'a Map,
    camera: Camera,
    /// What was seen last, and from where.
    seen: Option<(Scene, CameraFrame)>,
    frame: CameraFrame,
    judges: &'a [&'a dyn Judge],
}

impl<'a> Observer<'a> {
    pub(crate) fn new(map: &'a Map, camera: Camera, judges: &'a [&'a dyn Judge]) -> Self {
        Self {
            map,
            camera,
            seen: None,
            frame: camera.frame(),
            judges,
        }
    }

    /// What every judge says of a scene.
    pub(crate) fn verdicts(
        &mut self,
        scene: &Scene,
        random: &mut impl Rng,
    ) -> Vec<Option<Verdict>> {
        self.look(scene);
        self.camera.expose(scene, random, &mut self.frame);
        let integral = Integral::of(&self.frame.pixels, usize::from(self.frame.width));
        let side_px = u32::from(self.frame.width);
        // Judges of the same side see the same view.
        let mut view = Vec::new();
        let mut verdicts = Vec::with_capacity(self.judges.len());
        for judge in self.judges {
            let side = judge.side();
            if view.len() != side * side {
                view.resize(side * side, 0);
                integral.reduce((0, 0), side_px, side, &mut view);
            }
            verdicts.push(judge.judge(&view));
        }
        verdicts
    }

    /// Sees what a scene shows, before exposure; many scenes in a row differ in nothing else.
    fn look(&mut self, scene: &Scene) {
        let pose = Scene {
            gamma: 1.0,
            noise: 0.0,
            occlusion: None,
            ..*scene
        };
        match &self.seen {
            Some((seen, frame)) if *seen == pose => {
                self.frame.pixels.copy_from_slice(&frame.pixels);
            }
            _ => {
                self.camera.see(self.map, scene, &mut self.frame);
                self.seen = Some((pose, self.frame.clone()));
            }
        }
    }

    /// The limits of `measure` at landmark `landmark` (0-based), whose place is given: by judge, by criterion.
    pub(crate) fn limits(
        &mut self,
        measure: Measure,
        steps: Steps,
        landmark: u32,
        place: Point,
    ) -> Vec<[Limits; 2]> {
        let lower = self.outward(measure, steps, landmark, place, -1);
        let upper = self.outward(measure, steps, landmark, place, 1);
        let both = lower.into_iter().zip(upper);
        both.map(|(lower, upper)| [0, 1].map(|criterion| [lower[criterion], upper[criterion]]))
            .collect()
    }

    /// To one side: by judge, by criterion.
    fn outward(
        &mut self,
        measure: Measure,
        steps: Steps,
        landmark: u32,
        place: Point,
        direction: i32,
    ) -> Vec<[Limit; 2]> {
        let mut limits = vec![[None; 2]; self.judges.len()];
        let mut last = measure.nominal();
        let mut end = End::Range;
        for step in 0.. {
            let Some(value) = measure.value(direction * step, steps) else {
                break;
            };
            let scenes = measure.scenes(value, place, self.camera.footprint_px());
            let is_on_map = |scene| self.camera.is_on_map(self.map, scene);
            if !scenes.iter().all(is_on_map) {
                end = End::Map;
                break;
            }
            for (scene, stream) in scenes.iter().zip(0..) {
                let mut random = seeded(u64::from(landmark), stream << 32 | u64::from(step as u32));
                let verdicts = self.verdicts(scene, &mut random);
                for (limits, verdict) in limits.iter_mut().zip(verdicts) {
                    for (limit, criterion) in limits.iter_mut().zip(Criterion::ALL) {
                        if limit.is_none() && !criterion.holds(verdict, landmark) {
                            *limit = Some(Limit {
                                value: last,
                                end: End::Failed,
                            });
                        }
                    }
                }
            }
            if limits.iter().flatten().all(Option::is_some) {
                break;
            }
            last = value;
        }
        let still = Limit { value: last, end };
        limits
            .into_iter()
            .map(|limits| limits.map(|limit| limit.unwrap_or(still)))
            .collect()
    }
}
