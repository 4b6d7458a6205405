//! What the last ten seconds come down to.

use std::{collections::VecDeque, time::Duration};

use eigenmark_core::link::{Camera, Report};
use serde::Serialize;

use super::Judgement;

/// How far rates look back.
const WINDOW: Duration = Duration::from_secs(10);

/// Reports that are looked at, at most: of a board that sends more, only the newest.
const MAX_REPORTS: usize = 2_000;

/// Rates over the last ten seconds; of nothing, nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rates {
    /// Frames per second, those without report included, by the board's clock.
    pub frames_per_s: Option<f64>,
    /// Reports per second, by the board's clock.
    pub reports_per_s: Option<f64>,
    /// Frames per second that had a fix that counts.
    pub fixes_per_s: Option<f64>,
    /// Share of the reports whose camera gave a frame, 0 to 1.
    pub seen: Option<f64>,
    /// Share of the reports whose fix counts, 0 to 1.
    pub known: Option<f64>,
    /// Share of the reports whose fix is guaranteed and counts, 0 to 1.
    pub guaranteed: Option<f64>,
    /// Mean time from the frame to the command, in microseconds.
    pub took_us_mean: Option<f64>,
    /// The longest one.
    pub took_us_worst: Option<u32>,
}

/// The reports of the last ten seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    entries: VecDeque<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    at: Duration,
    sequence: u32,
    time_ms: u32,
    took_us: u32,
    seen: bool,
    judgement: Option<Judgement>,
}

impl Window {
    pub(super) fn push(&mut self, report: &Report, now: Duration) {
        if self.entries.len() >= MAX_REPORTS {
            self.entries.pop_front();
        }
        self.entries.push_back(Entry {
            at: now,
            sequence: report.sequence,
            time_ms: report.time_ms,
            took_us: report.took_us,
            seen: report.camera == Camera::Frame,
            judgement: Judgement::of(report),
        });
        while self.entries.front().is_some_and(|it| it.at + WINDOW < now) {
            self.entries.pop_front();
        }
    }

    /// Of a board that began anew, what was before says nothing.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
    }

    pub(super) fn rates(&self, now: Duration) -> Rates {
        let entries = || self.entries.iter().filter(|it| it.at + WINDOW >= now);
        let count = entries().count();
        let (Some(first), Some(last)) = (entries().next(), entries().next_back()) else {
            return Rates::default();
        };
        let share = |is: fn(&Entry) -> bool| {
            entries().filter(|entry| is(entry)).count() as f64 / count as f64
        };
        let guaranteed = share(|it| it.judgement == Some(Judgement::Guaranteed));
        let known = guaranteed + share(|it| it.judgement == Some(Judgement::Known));
        let passed_s = f64::from(last.time_ms.saturating_sub(first.time_ms)) / 1000.0;
        let per_s = |number: f64| (passed_s > 0.0).then(|| number / passed_s);
        let frames_per_s = per_s(f64::from(last.sequence.saturating_sub(first.sequence)));
        let took_us: f64 = entries().map(|it| f64::from(it.took_us)).sum();
        Rates {
            frames_per_s,
            reports_per_s: per_s((count - 1) as f64),
            fixes_per_s: frames_per_s.map(|rate| rate * known),
            seen: Some(share(|it| it.seen)),
            known: Some(known),
            guaranteed: Some(guaranteed),
            took_us_mean: Some(took_us / count as f64),
            took_us_worst: entries().map(|it| it.took_us).max(),
        }
    }
}
