//! A flight in numbers.
//!
//! - The **error** of an estimate is its distance from the truth, in map pixels; it counts whether the pilot relied on
//!   it or not.
//! - The **drift** of path integration is the distance between where it says the vehicle went and where it went, over
//!   the length of the way; separately before and after a kidnapping.
//! - A confident estimate is **wrong** when it is farther off than one view's side; the share is of confident estimates.
//! - **Recovery** takes the frames from a kidnapping to the first confident estimate that is not wrong.
//!
//! A log of a real flight may not tell the truth: then there is nothing of all that, and of the rest what the vehicle knew.

use serde::Serialize;

use super::{End, Estimate, Step};

/// One flight in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// How it ended, when that is known.
    pub end: Option<End>,
    /// How long it took, in seconds.
    pub duration_s: f64,
    /// Length of the way over the ground, in meters, when the truth is known.
    pub distance_m: Option<f64>,
    /// Frames that were due.
    pub frames: usize,
    /// Frames that arrived.
    pub frames_seen: usize,
    /// Median error, in map pixels.
    pub median_error_px: Option<f64>,
    /// 95 of 100 errors are at most that, in map pixels.
    pub error_95_px: Option<f64>,
    /// Median error of confident estimates, in map pixels.
    pub confident_median_error_px: Option<f64>,
    /// Confident estimates, in percent of the frames.
    pub confident_percent: f64,
    /// Wrong ones, in percent of the confident estimates, when the truth is known.
    pub confident_wrong_percent: Option<f64>,
    /// Drift of path integration, in percent of the distance it was there for.
    pub drift_percent: Option<f64>,
    /// Whether the vehicle was carried off.
    pub kidnapped: bool,
    /// Frames until it knew where it was again; `None` also when it never did.
    pub recovery_frames: Option<usize>,
    /// Errors of all estimates, in ascending order, and of the confident ones.
    #[serde(skip)]
    pub(super) errors_px: [Vec<f64>; 2],
    /// How many estimates were confident.
    #[serde(skip)]
    pub(super) confident: usize,
    /// How many confident estimates were wrong.
    #[serde(skip)]
    pub(super) confident_wrong: usize,
    /// Sum of the drifts, and of the ways, in meters.
    #[serde(skip)]
    pub(super) drift_m: [f64; 2],
}

impl Statistics {
    /// Of the steps of a flight over a map of that scale, with views of that footprint.
    #[must_use]
    pub fn of(steps: &[Step], end: Option<End>, meters_per_px: f64, footprint_px: f64) -> Self {
        let error = |step: &Step, estimate: &Estimate| {
            let [x, y] = step.truth?.position_px;
            Some(
                (f64::from(estimate.position.x_px) - x)
                    .hypot(f64::from(estimate.position.y_px) - y),
            )
        };
        let all = || {
            steps.iter().filter_map(|step| {
                let estimate = step.report.estimate.as_ref()?;
                Some((error(step, estimate)?, estimate.confident))
            })
        };
        let sorted = |mut errors: Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            errors
        };
        let errors_px = [
            sorted(all().map(|(error, _)| error).collect()),
            sorted(
                all()
                    .filter(|(_, is)| *is)
                    .map(|(error, _)| error)
                    .collect(),
            ),
        ];
        let wrong = |error: f64| error > footprint_px;
        let confident_wrong = errors_px[1].iter().filter(|&&error| wrong(error)).count();
        let kidnapping = steps.iter().rposition(|step| step.kidnapped);
        let recovery_frames = kidnapping.and_then(|start| {
            steps[start..].iter().position(|step| {
                let estimate = step.report.estimate.as_ref();
                estimate.is_some_and(|it| {
                    it.confident && error(step, it).is_some_and(|error| !wrong(error))
                })
            })
        });
        let drift_m = drift(steps).map(|px| px * meters_per_px);
        let is_known = steps.iter().any(|step| step.truth.is_some());
        let is_confident = |step: &&Step| step.report.estimate.is_some_and(|it| it.confident);
        let confident = steps.iter().filter(is_confident).count();
        Self {
            end,
            duration_s: steps.last().map_or(0.0, |step| f64::from(step.time_s)),
            distance_m: is_known.then(|| legs(steps).map(length).sum::<f64>() * meters_per_px),
            frames: steps.len(),
            frames_seen: steps.iter().filter(|step| step.seen).count(),
            median_error_px: quantile(&errors_px[0], 0.5),
            error_95_px: quantile(&errors_px[0], 0.95),
            confident_median_error_px: quantile(&errors_px[1], 0.5),
            confident_percent: percent(confident, steps.len()),
            confident_wrong_percent: is_known.then(|| percent(confident_wrong, errors_px[1].len())),
            drift_percent: ratio_percent(drift_m),
            kidnapped: kidnapping.is_some(),
            recovery_frames,
            errors_px,
            confident,
            confident_wrong,
            drift_m,
        }
    }
}

/// What the vehicle moved by from each step to the next, in map pixels; being carried off is not moving.
fn legs(steps: &[Step]) -> impl Iterator<Item = [f64; 2]> {
    steps
        .windows(2)
        .filter(|pair| !pair[1].kidnapped)
        .filter_map(|pair| {
            let [from, to] = [&pair[0], &pair[1]].map(|step| step.truth);
            let (from, to) = (from?.position_px, to?.position_px);
            Some([to[0] - from[0], to[1] - from[1]])
        })
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// The sum of path integration's drifts and of the ways it was there for, in map pixels: each stretch that neither a
/// kidnapping nor a gap interrupts.
fn drift(steps: &[Step]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for stretch in steps
        .chunk_by(|a, b| !b.kidnapped && a.report.odometry.is_some() && b.report.odometry.is_some())
    {
        let [Some(first), Some(last)] = [stretch.first(), stretch.last()] else {
            continue;
        };
        let (Some(from), Some(to)) = (first.report.odometry, last.report.odometry) else {
            continue;
        };
        let (Some(start), Some(end)) = (first.truth, last.truth) else {
            continue;
        };
        let integrated = [to.x_px - from.x_px, to.y_px - from.y_px].map(f64::from);
        let [x, y] =
            [0, 1].map(|axis| integrated[axis] - (end.position_px[axis] - start.position_px[axis]));
        sums[0] += x.hypot(y);
        sums[1] += legs(stretch).map(length).sum::<f64>();
    }
    sums
}

/// The smallest value that a share of the sorted values does not exceed; the upper one of two middle ones.
pub(super) fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64) as usize;
    sorted
        .get(rank.min(sorted.len().saturating_sub(1)))
        .copied()
}

pub(super) fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

pub(super) fn ratio_percent([part, whole]: [f64; 2]) -> Option<f64> {
    (whole > 0.0).then(|| 100.0 * part / whole)
}

#[cfg(test)]
pub(super) mod tests {
    use eigenmark_core::landmark::Point;

    use super::*;
    use crate::simulate::{Command, Readings, Report, Truth};

    /// A step at x that believes to be `error` pixels farther right, and has integrated `odometry`.
    fn step(x: f32, error: f32, confident: bool, odometry: f32) -> Step {
        let at = |x_px| Point { x_px, y_px: 3.0 };
        Step {
            time_s: x / 10.0,
            step_s: 0.1,
            kidnapped: false,
            truth: Some(Truth::still([x.into(), 3.0])),
            readings: Readings::default(),
            seen: true,
            command: Command::default(),
            report: Report {
                estimate: Some(Estimate {
                    position: at(x + error),
                    covariance_px2: None,
                    confidence: None,
                    confident,
                }),
                odometry: Some(at(odometry)),
                ..Report::default()
            },
        }
    }

    /// Ten pixels, a jump of 500, and ten pixels more.
    pub(in super::super) fn kidnapped() -> Statistics {
        let mut steps = vec![
            step(0.0, 1.0, true, 50.0),
            step(5.0, 2.0, true, 55.5),
            step(10.0, 3.0, false, 61.0),
            step(510.0, -500.0, true, 61.0),
            step(515.0, -490.0, false, 66.0),
            step(520.0, 4.0, true, 69.0),
        ];
        steps[3].kidnapped = true;
        steps[1].seen = false;
        Statistics::of(&steps, Some(End::OutOfTime), 0.5, 100.0)
    }

    #[test]
    fn a_flight_is_measured() {
        let of = kidnapped();
        assert_eq!((of.frames, of.frames_seen, of.duration_s), (6, 5, 52.0));
        assert_eq!(of.distance_m, Some(10.0), "without the jump");
        assert_eq!(
            (of.median_error_px, of.error_95_px),
            (Some(4.0), Some(500.0))
        );
        assert_eq!(of.confident_median_error_px, Some(4.0));
        assert!((of.confident_percent - 66.667).abs() < 1e-3);
        assert_eq!(of.confident_wrong_percent, Some(25.0));
        // One pixel too far in the first ten, two too short in the second.
        assert_eq!(of.drift_percent, Some(15.0));
        assert_eq!((of.kidnapped, of.recovery_frames), (true, Some(2)));
    }

    #[test]
    fn without_truth_there_are_no_errors() {
        let mut steps = vec![step(0.0, 1.0, true, 0.0), step(4.0, 2.0, false, 3.0)];
        steps.iter_mut().for_each(|step| step.truth = None);
        steps[1].kidnapped = true;
        let of = Statistics::of(&steps, None, 1.0, 100.0);
        assert_eq!((of.frames, of.confident_percent), (2, 50.0));
        assert_eq!((of.distance_m, of.confident_wrong_percent), (None, None));
        assert_eq!((of.median_error_px, of.drift_percent), (None, None));
        assert_eq!(of.recovery_frames, None);
    }

    #[test]
    fn nothing_is_measured_of_a_flight_without_thoughts() {
        let mut steps = vec![step(0.0, 0.0, true, 0.0), step(4.0, 0.0, true, 0.0)];
        steps
            .iter_mut()
            .for_each(|step| step.report = Report::default());
        let of = Statistics::of(&steps, None, 1.0, 100.0);
        assert_eq!((of.median_error_px, of.drift_percent), (None, None));
        assert_eq!((of.distance_m, of.recovery_frames), (Some(4.0), None));
        assert_eq!(Statistics::of(&[], None, 1.0, 100.0).frames, 0);
    }
}
