//! How far a view may deviate in one respect: outward from the nominal view, step by step, to the last step before the
//! first failure; report section 3.5, ERRATA.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::{Measure, Steps};
use crate::{
    evaluate::judge::{Criterion, Panel, Verdict},
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
    judges: &'a dyn Panel,
}

impl<'a> Observer<'a> {
    pub(crate) fn new(map: &'a Map, camera: Camera, judges: &'a dyn Panel) -> Self {
        Self {
            map,
            camera,
            seen: None,
            frame: camera.frame(),
            judges,
        }
    }

    /// What every judge says of a scene around `landmark` (0-based).
    pub(crate) fn verdicts(
        &mut self,
        landmark: u32,
        scene: &Scene,
        random: &mut impl Rng,
    ) -> Vec<Option<Verdict>> {
        let frame = self.frame(scene, random);
        let all = vec![true; self.judges.judges()];
        let mut of_frames = self.judge(landmark, &all, &[frame]);
        of_frames.swap_remove(0)
    }

    fn judge(
        &self,
        landmark: u32,
        asked: &[bool],
        frames: &[Integral],
    ) -> Vec<Vec<Option<Verdict>>> {
        let side_px = u32::from(self.frame.width);
        self.judges.judge(landmark, asked, frames, side_px)
    }

    /// The sums of the frame of a scene.
    fn frame(&mut self, scene: &Scene, random: &mut impl Rng) -> Integral {
        self.look(scene);
        self.camera.expose(scene, random, &mut self.frame);
        Integral::of(&self.frame.pixels, usize::from(self.frame.width))
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

    /// The limits of `measure` at landmark `landmark` (0-based), whose nominal scene is given: by judge, by criterion.
    pub(crate) fn limits(
        &mut self,
        measure: Measure,
        steps: Steps,
        landmark: u32,
        nominal: Scene,
    ) -> Vec<[Limits; 2]> {
        let sides = [-1, 1].map(|direction| {
            let outward = Outward {
                measure,
                steps,
                landmark,
                nominal,
                direction,
            };
            self.outward(&outward)
        });
        let [lower, upper] = sides;
        let both = lower.into_iter().zip(upper);
        both.map(|(lower, upper)| [0, 1].map(|criterion| [lower[criterion], upper[criterion]]))
            .collect()
    }

    /// To one side: by judge, by criterion.
    fn outward(&mut self, outward: &Outward) -> Vec<[Limit; 2]> {
        let mut limits = vec![[None; 2]; self.judges.judges()];
        let mut last = outward.measure.nominal();
        let mut next = 0;
        let end = loop {
            let (seen, end) = self.see(outward, next);
            next += seen.values.len() as i32;
            let is_open = |limits: &[Option<Limit>; 2]| limits.iter().any(Option::is_none);
            let open: Vec<bool> = limits.iter().map(is_open).collect();
            let mut verdicts = self
                .judge(outward.landmark, &open, &seen.frames)
                .into_iter();
            for (value, scenes) in seen.values {
                for verdicts in verdicts.by_ref().take(scenes) {
                    for (limits, verdict) in limits.iter_mut().zip(verdicts) {
                        for (limit, criterion) in limits.iter_mut().zip(Criterion::ALL) {
                            if limit.is_none() && !criterion.holds(verdict, outward.landmark) {
                                *limit = Some(Limit {
                                    value: last,
                                    end: End::Failed,
                                });
                            }
                        }
                    }
                }
                last = value;
            }
            if limits.iter().flatten().all(Option::is_some) {
                break End::Failed;
            }
            if let Some(end) = end {
                break end;
            }
        };
        let still = Limit { value: last, end };
        limits
            .into_iter()
            .map(|limits| limits.map(|limit| limit.unwrap_or(still)))
            .collect()
    }

    /// The next steps from step `first` on, as many as are judged at once, and why there are no more.
    fn see(&mut self, outward: &Outward, first: i32) -> (Seen, Option<End>) {
        let mut seen = Seen::default();
        for step in (first..).take(self.judges.batch()) {
            let Some(value) = outward.value(step) else {
                return (seen, Some(End::Range));
            };
            let footprint_px = self.camera.footprint_px();
            let scenes = outward
                .measure
                .scenes(value, &outward.nominal, footprint_px);
            let is_on_map = |scene| self.camera.is_on_map(self.map, scene);
            if !scenes.iter().all(is_on_map) {
                return (seen, Some(End::Map));
            }
            for (scene, stream) in scenes.iter().zip(0..) {
                let stream = stream << 32 | u64::from(step as u32);
                let mut random = seeded(u64::from(outward.landmark), stream);
                seen.frames.push(self.frame(scene, &mut random));
            }
            seen.values.push((value, scenes.len()));
        }
        (seen, None)
    }
}

/// A way outward.
struct Outward {
    measure: Measure,
    steps: Steps,
    landmark: u32,
    nominal: Scene,
    /// 1 to larger values, −1 to smaller ones.
    direction: i32,
}

impl Outward {
    fn value(&self, step: i32) -> Option<f64> {
        self.measure.value(self.direction * step, self.steps)
    }
}

/// Steps on the way: their values, and of how many scenes each is.
#[derive(Default)]
struct Seen {
    values: Vec<(f64, usize)>,
    /// Of all their scenes.
    frames: Vec<Integral>,
}
