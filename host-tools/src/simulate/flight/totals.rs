//! Several flights in numbers.

use serde::Serialize;

use super::{
    End, Statistics,
    statistics::{percent, quantile, ratio_percent},
};

/// Several flights in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Totals {
    /// Number of flights.
    pub flights: usize,
    /// Flights that ended where they should.
    pub arrived: usize,
    /// Flights that ended elsewhere, believed to be the goal.
    pub mistaken: usize,
    /// Flights that left the map.
    pub left_map: usize,
    /// Flights whose time was up.
    pub out_of_time: usize,
    /// Length of all ways that are known, in meters; `None` when none is.
    pub distance_m: Option<f64>,
    /// Frames that were due.
    pub frames: usize,
    /// Frames that arrived.
    pub frames_seen: usize,
    /// Median error over the estimates of all flights, in map pixels.
    pub median_error_px: Option<f64>,
    /// 95 of 100 errors are at most that, in map pixels.
    pub error_95_px: Option<f64>,
    /// Median error of confident estimates, in map pixels.
    pub confident_median_error_px: Option<f64>,
    /// Confident estimates, in percent of the frames.
    pub confident_percent: f64,
    /// Wrong ones, in percent of the confident estimates of flights whose truth is known; `None` when there are none.
    pub confident_wrong_percent: Option<f64>,
    /// Drift of path integration, in percent: the mean over the flights, by distance.
    pub drift_percent: Option<f64>,
    /// Flights with a kidnapping.
    pub kidnapped: usize,
    /// Flights that knew where they were again after one.
    pub recovered: usize,
    /// Median over the flights with a kidnapping; `None` when half of them or more never knew again.
    pub recovery_frames_median: Option<usize>,
}

impl Totals {
    /// Of several flights.
    #[must_use]
    pub fn of(flights: &[Statistics]) -> Self {
        let ended = |end: End| {
            flights
                .iter()
                .filter(|flight| flight.end == Some(end))
                .count()
        };
        let count = |part: fn(&Statistics) -> usize| flights.iter().map(part).sum::<usize>();
        let sum = |part: fn(&Statistics) -> f64| flights.iter().map(part).sum::<f64>();
        let ways: Vec<f64> = flights
            .iter()
            .filter_map(|flight| flight.distance_m)
            .collect();
        let is_known = !ways.is_empty();
        let [all, confident] = [0, 1].map(|kind| {
            let errors = flights.iter().flat_map(|flight| &flight.errors_px[kind]);
            let mut errors: Vec<f64> = errors.copied().collect();
            errors.sort_by(f64::total_cmp);
            errors
        });
        let frames = count(|flight| flight.frames);
        let kidnapped = count(|flight| flight.kidnapped.into());
        let mut recoveries: Vec<usize> = flights
            .iter()
            .filter_map(|flight| flight.recovery_frames)
            .collect();
        recoveries.sort_unstable();
        Self {
            flights: flights.len(),
            arrived: ended(End::Arrived),
            mistaken: ended(End::Mistaken),
            left_map: ended(End::LeftMap),
            out_of_time: ended(End::OutOfTime),
            distance_m: is_known.then(|| ways.iter().sum()),
            frames,
            frames_seen: count(|flight| flight.frames_seen),
            median_error_px: quantile(&all, 0.5),
            error_95_px: quantile(&all, 0.95),
            confident_median_error_px: quantile(&confident, 0.5),
            confident_percent: percent(count(|flight| flight.confident), frames),
            confident_wrong_percent: is_known
                .then(|| percent(count(|flight| flight.confident_wrong), confident.len())),
            drift_percent: ratio_percent([
                sum(|flight| flight.drift_m[0]),
                sum(|flight| flight.drift_m[1]),
            ]),
            kidnapped,
            recovered: recoveries.len(),
            // Those that never knew again come last.
            recovery_frames_median: recoveries.get(kidnapped / 2).copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::statistics::tests::kidnapped, *};

    #[test]
    fn flights_are_summed() {
        let lost = Statistics {
            recovery_frames: None,
            end: Some(End::Arrived),
            ..kidnapped()
        };
        let slow = Statistics {
            recovery_frames: Some(9),
            ..kidnapped()
        };
        let of = Totals::of(&[kidnapped(), lost.clone(), slow]);
        assert_eq!((of.flights, of.arrived, of.out_of_time), (3, 1, 2));
        assert_eq!((of.kidnapped, of.recovered), (3, 2));
        assert_eq!(of.recovery_frames_median, Some(9), "2, 9, never");
        assert_eq!(
            (of.median_error_px, of.drift_percent),
            (Some(4.0), Some(15.0))
        );
        assert_eq!(
            (of.distance_m, of.confident_wrong_percent),
            (Some(30.0), Some(25.0))
        );
        assert_eq!(
            Totals::of(&[kidnapped(), lost]).recovery_frames_median,
            None
        );
    }
}
