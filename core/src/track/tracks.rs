//! The corners that are tracked: found in the next frame, kept or dropped, joined by new ones.

use heapless::Vec;

use super::{
    MAX_TRACKS, Track,
    corner::Candidates,
    follow::follow,
    ground::Ground,
    level::{Level, Pyramid},
    regions::Regions,
    similarity::{Agreement, Pair, Similarity, agree},
};

/// Corners that tell others where to look.
const SURPRISES: usize = 5;
const MIN_SURPRISES: usize = 3;

/// With fewer corners, new ones are looked for everywhere.
const FEW: usize = MAX_TRACKS / 2;

/// Corners that must agree, at least; and as shares of those found again, and of those that should have been: half a
/// frame from another time has half of the corners, and is refused.
const MIN_INLIERS: usize = 6;
const MIN_PERCENT_OF_FOUND: usize = 60;
const MIN_PERCENT_OF_VISIBLE: usize = 40;

/// How far from where a corner should be it may be found to agree, in pixels.
const LIMIT_PX: f32 = 2.5;

/// No fit is better than this, in pixels: the error of a corner on a noiseless frame.
const FLOOR_PX: f32 = 0.05;

/// The smallest distance of two corners that may fix a similarity, as a share of the side.
const LEAST_BASE: f32 = 0.15;

/// When corners moved by this on average since the reference frame, in pixels, the present one takes its place.
const RENEW_PX: f32 = 6.0;

/// Corners, at most as many as the budget is made for.
#[derive(Clone, Debug)]
pub struct Tracks {
    tracks: Vec<Track, MAX_TRACKS>,
    next_id: u32,
}

impl Tracks {
    /// None.
    pub const fn new() -> Self {
        Self {
            tracks: Vec::new(),
            next_id: 0,
        }
    }

    pub fn as_slice(&self) -> &[Track] {
        &self.tracks
    }

    /// Drops all.
    pub fn clear(&mut self) {
        self.tracks.clear();
    }

    /// Whether there are as many as must agree.
    pub fn are_enough(&self) -> bool {
        self.tracks.len() >= MIN_INLIERS
    }

    /// Moves all anchors.
    pub fn move_anchors(&mut self, by: &Similarity) {
        for track in &mut self.tracks {
            track.anchor = by.apply(track.anchor);
        }
    }

    /// Looks for all corners in the second frame, near where the guesses are, and for the pose that most of them agree on;
    /// and says how many were found. Corners stay as they are.
    pub fn find(
        &mut self,
        (from, to): &(Pyramid<'_>, Pyramid<'_>),
        ground: &Ground,
        guess: impl Fn(&Track) -> Option<[f32; 2]>,
    ) -> Option<(Agreement, u8)> {
        let side_px = to[0].side;
        let mut surprises = Surprises::default();
        for is_inner in [true, false] {
            for track in &mut self.tracks {
                if is_inner != track.is_inner(side_px) {
                    continue;
                }
                track.found_px = None;
                let Some(guess) = guess(track) else {
                    continue;
                };
                track.found_px = follow(from, to, track.reference_px, surprises.add_to(guess));
                if let Some(found) = track.found_px {
                    surprises.note(guess, found);
                }
            }
        }
        let mut pairs: Vec<Pair, MAX_TRACKS> = Vec::new();
        for track in &mut self.tracks {
            let from = track.found_px.and_then(|found| ground.level(found));
            let pair = from.map(|from| Pair {
                from,
                to: track.anchor,
            });
            if pair.is_none_or(|pair| pairs.push(pair).is_err()) {
                track.found_px = None;
            }
        }
        let per_px = ground.per_px();
        let least = LEAST_BASE * f32::from(side_px) * per_px;
        let agreement = agree(&pairs, LIMIT_PX * per_px, FLOOR_PX * per_px, least)?;
        let inliers = agreement.inliers.count_ones() as usize;
        let visible = self.count_visible(&agreement.similarity, ground, side_px);
        let is_share = |of: usize, percent: usize| inliers * 100 >= of * percent;
        let is_agreed = inliers >= MIN_INLIERS
            && is_share(pairs.len(), MIN_PERCENT_OF_FOUND)
            && is_share(visible, MIN_PERCENT_OF_VISIBLE);
        is_agreed.then_some((agreement, pairs.len() as u8))
    }

    /// Corners that the frame shows when it was taken at that pose.
    fn count_visible(&self, pose: &Similarity, ground: &Ground, side_px: u16) -> usize {
        let (to_ground, regions) = (pose.inverse(), Regions::new(side_px, [0.0; 2]));
        let is_visible = |track: &&Track| {
            let at = ground.project(to_ground.apply(track.anchor));
            at.is_some_and(|at| regions.is_inside(at))
        };
        self.tracks.iter().filter(is_visible).count()
    }

    /// Moves corners to where they were found, and drops those that do not agree, or are about to leave.
    pub fn settle(&mut self, agreement: &Agreement, side_px: u16) {
        let regions = Regions::new(side_px, [0.0; 2]);
        let mut index = 0;
        self.tracks.retain_mut(|track| {
            let Some(found) = track.found_px.take() else {
                return false;
            };
            track.before_px = track.at_px;
            track.at_px = found;
            track.age = track.age.saturating_add(1);
            let is_inlier = agreement.inliers >> index & 1 == 1;
            index += 1;
            let next = [0, 1].map(|axis| 2.0 * found[axis] - track.before_px[axis]);
            is_inlier && regions.is_inside(next)
        });
    }

    /// Whether new corners are wanted: few are left, or they moved far in the frame.
    pub fn are_due(&self) -> bool {
        let squares: f32 = self.tracks.iter().map(Track::moved_squared).sum();
        let count = self.tracks.len();
        count < FEW || squares > RENEW_PX * RENEW_PX * count as f32
    }

    /// Tracks from the present frame on, whose finest levels these are, and looks for new corners in it: `flow` is where
    /// the ground goes. The share of new ones.
    #[inline(never)] // its candidates are not the caller's
    pub fn renew(
        &mut self,
        [base, half]: &[Level<'_>; 2],
        ground: &Ground,
        pose: &Similarity,
        flow: [f32; 2],
    ) -> f32 {
        for track in &mut self.tracks {
            track.reference_px = track.at_px;
        }
        let old = self.tracks.len();
        if old == MAX_TRACKS {
            return 0.0;
        }
        let mut candidates = Candidates::none();
        candidates.find(base, half);
        let (regions, is_few) = (Regions::new(base.side, flow), old < FEW);
        let corners = candidates.spread(&self.tracks, MAX_TRACKS - old, |at_px| {
            regions.is_inside(at_px) && (is_few || !regions.is_outgoing(at_px))
        });
        for corner in &corners {
            let Some(below) = ground.level(corner.at_px) else {
                continue;
            };
            let track = Track {
                id: self.next_id,
                age: 0,
                at_px: corner.at_px,
                before_px: corner.at_px,
                found_px: None,
                reference_px: corner.at_px,
                anchor: pose.apply(below),
            };
            if self.tracks.push(track).is_ok() {
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
        let count = self.tracks.len();
        (count - old) as f32 / count.max(1) as f32
    }
}

/// How far corners were from where they should have been.
#[derive(Default)]
struct Surprises {
    moves: Vec<[f32; 2], SURPRISES>,
}

impl Surprises {
    /// Where a corner should be, seeing where others were: moved by the medians of the first ones' surprises.
    fn add_to(&self, guess: [f32; 2]) -> [f32; 2] {
        if self.moves.len() < MIN_SURPRISES {
            return guess;
        }
        [guess[0] + self.median(0), guess[1] + self.median(1)]
    }

    fn note(&mut self, guess: [f32; 2], found: [f32; 2]) {
        // Those that come when it is full are not needed.
        let _ = self.moves.push([found[0] - guess[0], found[1] - guess[1]]);
    }

    /// The one that as many are above as below; of an even number the upper of the two.
    fn median(&self, axis: usize) -> f32 {
        let values = || {
            self.moves
                .iter()
                .filter_map(move |by| by.get(axis).copied())
        };
        let below = |value: f32| values().filter(|&other| other < value).count();
        let half = self.moves.len() / 2;
        let is_median = |&value: &f32| {
            let equal = values().filter(|&other| other == value).count();
            (below(value)..below(value) + equal).contains(&half)
        };
        values().find(is_median).unwrap_or_default()
    }
}
