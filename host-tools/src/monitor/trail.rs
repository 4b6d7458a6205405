//! Where the vehicle was, and what its fixes were worth.

use std::collections::VecDeque;

use eigenmark_core::{
    landmark::Point,
    link::{Refusal, Report},
};

/// Positions that are remembered; older ones are forgotten.
pub const MAX_TRAIL: usize = 10_000;

/// What a fix is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// No other landmark is nearer, whatever rounding did.
    Guaranteed,
    /// It looks like a view of the map.
    Known,
    /// It does not count.
    Refused,
}

/// What is remembered of a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The report's number.
    pub sequence: u32,
    /// When the frame was taken, in milliseconds since the board's start.
    pub time_ms: u32,
    /// Where the vehicle was believed to be.
    pub position: Option<Point>,
    /// Whether that was relied on.
    pub confident: bool,
    /// Where the frame alone placed it, and what that is worth.
    pub fix: Option<(Point, Judgement)>,
    /// The nearest landmark: its rank in the table, 0-based.
    pub landmark: Option<u32>,
    /// Why there is no fix, or why it does not count.
    pub refusal: Option<Refusal>,
    /// The board began anew just before.
    pub restarted: bool,
}

/// The last [`MAX_TRAIL`] samples, numbered from 0 since the monitor's start.
#[derive(Clone, Debug, Default)]
pub struct Trail {
    samples: VecDeque<Sample>,
    forgotten: u64,
}

impl Judgement {
    /// What the report's fix is worth, if it has one.
    #[must_use]
    pub fn of(report: &Report) -> Option<Self> {
        let fix = report.fix?;
        Some(match report.refusal {
            None if fix.guaranteed => Self::Guaranteed,
            None if fix.known => Self::Known,
            _ => Self::Refused,
        })
    }

    /// Its name in a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Guaranteed => "guaranteed",
            Self::Known => "known",
            Self::Refused => "refused",
        }
    }
}

impl Sample {
    /// Of a report; points that are no numbers are left out.
    #[must_use]
    pub fn of(report: &Report, restarted: bool) -> Self {
        let is_point = |point: &Point| point.x_px.is_finite() && point.y_px.is_finite();
        let judged = report.fix.zip(Judgement::of(report));
        Self {
            sequence: report.sequence,
            time_ms: report.time_ms,
            position: report.estimate.map(|it| it.position).filter(is_point),
            confident: report.estimate.is_some_and(|it| it.is_confident()),
            fix: judged
                .map(|(fix, judgement)| (fix.position, judgement))
                .filter(|(at, _)| is_point(at)),
            landmark: report.fix.map(|fix| fix.landmark),
            refusal: report.refusal,
            restarted,
        }
    }
}

impl Trail {
    /// Adds a sample, and forgets the oldest one when there are too many.
    pub fn push(&mut self, sample: Sample) {
        if self.samples.len() >= MAX_TRAIL {
            self.samples.pop_front();
            self.forgotten += 1;
        }
        self.samples.push_back(sample);
    }

    /// The number that the next sample will have.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.forgotten + self.samples.len() as u64
    }

    /// The samples from number `from` on, as far as they are remembered, and the number of the first one.
    pub fn since(&self, from: u64) -> (u64, impl Iterator<Item = &Sample>) {
        let first = from.clamp(self.forgotten, self.next());
        let skipped = (first - self.forgotten) as usize;
        (first, self.samples.range(skipped..))
    }

    /// The samples, the newest first.
    pub fn newest(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().rev()
    }
}
