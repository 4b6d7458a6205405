//! A flight's steps as lines on the picture.

use eigenmark_core::landmark::Point;

use super::{Line, scaled};
use crate::simulate::Step;

/// Whether the pilot relies on what it believes, and should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    Confident,
    Unsure,
    /// Confident, and farther off than a view's side; without truth nothing is.
    Wrong,
}

/// Lines in pixels of the picture.
pub(super) struct Ways {
    pub(super) truth: Vec<Line>,
    pub(super) odometry: Vec<Line>,
    pub(super) belief: Vec<(Trust, Line)>,
    /// From where to where the vehicle was carried.
    pub(super) jumps: Vec<[[f32; 2]; 2]>,
}

impl Ways {
    pub(super) fn of(steps: &[Step], footprint_px: f64, scale: f32) -> Self {
        let place = |step: &Step| step.truth.map(|truth| truth.place());
        let odometry = |step: &Step| step.report.odometry;
        // Odometry goes on where the vehicle is carried off, and gaps are none of its way.
        let is_jump = |before: &Step, now: &Step| {
            let far = |a: Point, b: Point| {
                f64::from((a.x_px - b.x_px).hypot(a.y_px - b.y_px)) > footprint_px / 2.0
            };
            odometry(before)
                .zip(odometry(now))
                .is_some_and(|(a, b)| far(a, b))
        };
        let jumps = steps.windows(2).filter(|pair| pair[1].kidnapped);
        Self {
            truth: lines(steps, place, |_, now| now.kidnapped, scale),
            odometry: lines(steps, odometry, is_jump, scale),
            belief: belief(steps, footprint_px, scale),
            jumps: jumps
                .filter_map(|pair| Some([place(&pair[0])?, place(&pair[1])?]))
                .map(|pair| pair.map(|at| scaled(at, scale)))
                .collect(),
        }
    }
}

/// The lines of what steps tell, interrupted where they tell nothing or jump.
fn lines(
    steps: &[Step],
    point: impl Fn(&Step) -> Option<Point>,
    is_jump: impl Fn(&Step, &Step) -> bool,
    scale: f32,
) -> Vec<Line> {
    steps
        .chunk_by(|a, b| point(a).is_some() && point(b).is_some() && !is_jump(a, b))
        .map(|steps| {
            steps
                .iter()
                .filter_map(&point)
                .map(|at| scaled(at, scale))
                .collect()
        })
        .filter(|line: &Line| line.len() > 1)
        .collect()
}

/// The lines of the pilot's estimates, apart by trust; where the trust changes, two lines share a point. An estimate
/// that jumps by half a view's side is not joined to the one before.
fn belief(steps: &[Step], footprint_px: f64, scale: f32) -> Vec<(Trust, Line)> {
    let mut found: Vec<(Trust, Line)> = Vec::new();
    let mut last: Option<Point> = None;
    for step in steps {
        let Some(estimate) = step.report.estimate else {
            last = None;
            continue;
        };
        let at = estimate.position;
        let distance = |x: f64, y: f64| (f64::from(at.x_px) - x).hypot(f64::from(at.y_px) - y);
        let is_wrong = step.truth.is_some_and(|truth| {
            let [x, y] = truth.position_px;
            distance(x, y) > footprint_px
        });
        let trust = match (estimate.confident, is_wrong) {
            (true, true) => Trust::Wrong,
            (true, false) => Trust::Confident,
            (false, _) => Trust::Unsure,
        };
        let joined =
            last.filter(|last| distance(last.x_px.into(), last.y_px.into()) <= footprint_px / 2.0);
        match (found.last_mut(), joined) {
            (Some((before, line)), Some(_)) if *before == trust => line.push(scaled(at, scale)),
            (_, Some(last)) => found.push((trust, vec![scaled(last, scale), scaled(at, scale)])),
            (_, None) => found.push((trust, vec![scaled(at, scale)])),
        }
        last = Some(at);
    }
    found
}
