//! The same ranking without an eigenspace: Gram-Schmidt with pivoting, as late as possible.
//!
//! **What.** A residual only shrinks while landmarks are added. So what is known of a candidate's from earlier is an
//! upper bound now, and most candidates never come near the top: only those that do are brought up to date.
//!
//! **Notation.** y = x − x_s0; u_j the directions of the hull, d of them.
//!
//! **Method.** ‖r‖² = ‖y‖² − Σ_j (u_jᵀy)². Candidates wait in a heap, by the upper end of what their squared residual
//! may be. Those on top are brought up to date, more of them at a time the longer it takes, until everything
//! that can still be the largest is. The difference has lost digits where little is left of ‖y‖²; therefore each candidate carries
//! a bound of its error ([`Candidate::error`]), and all that may be largest within their bounds are reduced properly, by
//! Gram-Schmidt on the view itself (twice), before one is chosen.
//!
//! **Cost.** One pass over all views, 1 multiply-add per pixel; then m·(directions not seen yet) per evaluation, and
//! views are read again for it. Per landmark some tens of evaluations where views differ in contrast, all candidates
//! at worst: when they are all equally far from each other. Memory is 40 bytes per candidate.
//!
//! **Limits.** None beyond the module's: the result does not depend on the number of threads.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::start::Started;
use super::{IpcaError, IpcaRanking, Stop, Until};
use crate::learn::Rows;
use crate::select::Eligible;

/// Candidates that are brought up to date together at first; twice as many each time that was not enough.
const FIRST_BATCH: usize = 16;

/// Candidates that one thread evaluates at once.
const EVALUATED: usize = 32;

/// Ranks by distance to the affine hull of the landmarks; `start` are the first ones (1-based), in their order, at most
/// as many as landmarks are asked for.
///
/// ```
/// use eigenmark::learn::Matrix;
/// use eigenmark::select::{Eligible, Stop, Until, rank_by_ipca};
///
/// // From (0, 0), (9, 0) is farthest; then (3, 1) is farther from the line through both than (5, 0).
/// let views = [0.0, 0.0, 5.0, 0.0, 9.0, 0.0, 3.0, 1.0];
/// let rows = Matrix::new(&views, 2);
/// let found = rank_by_ipca(&rows, &Eligible::all(4), &[1], Until::landmarks(4)).unwrap();
/// assert_eq!(found.ranking, [1, 3, 4]);
/// assert_eq!(found.residuals, [0.0, 9.0, 1.0]);
/// assert_eq!(found.stop, Stop::Exhausted); // (5, 0) is on the plane already
/// ```
///
/// # Errors
/// When the start list cannot be one, or a view is not finite.
pub fn rank_by_ipca<R: Rows>(
    rows: &R,
    eligible: &Eligible,
    start: &[u32],
    until: Until,
) -> Result<IpcaRanking, IpcaError> {
    let started = Started::new(rows, eligible, start, until)?;
    Ok(Search::new(started, eligible).run())
}

/// What is known of a candidate.
#[derive(Clone, Copy)]
struct Candidate {
    number: u32,
    /// Directions that are in `squared`.
    seen: u32,
    /// ‖y‖².
    energy: f64,
    /// ‖r‖² when it was last computed from the view itself.
    reduced: f64,
    /// ‖r‖² to the directions seen.
    squared: f64,
    /// The largest that ‖r‖² may be.
    most: f64,
}

impl Candidate {
    /// At most |error| of `squared`, with `dimensions` directions of `pixels` numbers.
    ///
    /// Each u_jᵀy is a sum of m products, off by m·ε·‖y‖ at most, and its square by twice that times |u_jᵀy|, as are
    /// the squares together: Σ_j |u_jᵀy| ≤ √d·‖r₀‖, where r₀ is what was left of y at first. ‖r₀‖² itself is off by
    /// (m + d)·ε·‖r₀‖·‖y‖. ε is twice the rounding of one operation, which leaves a factor of two for what the
    /// directions lack of being orthogonal.
    fn error(&self, pixels: usize, dimensions: usize) -> f64 {
        let (m, d) = (pixels as f64, dimensions as f64);
        (m + d) * (1.0 + 2.0 * d.sqrt()) * f64::EPSILON * (self.energy * self.reduced).sqrt()
    }
}

// The heap's order: largest `most` first, then the lowest number.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_residual = self.most.total_cmp(&other.most);
        by_residual.then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

struct Search<'a, R> {
    eligible: &'a Eligible,
    started: Started<'a, R>,
    /// All that are not selected, and may still be.
    waiting: BinaryHeap<Candidate>,
}

impl<'a, R: Rows> Search<'a, R> {
    fn new(started: Started<'a, R>, eligible: &'a Eligible) -> Self {
        let candidates = eligible.candidates().iter().zip(&started.energies);
        let waiting: Vec<Candidate> = candidates
            .filter(|(number, _)| !started.ranking.contains(number))
            .map(|(&number, &energy)| {
                let mut candidate = Candidate {
                    number,
                    seen: 0,
                    energy,
                    reduced: energy,
                    squared: energy,
                    most: energy,
                };
                candidate.most += candidate.error(started.deviations.pixels(), 0);
                candidate
            })
            .collect();
        Self {
            eligible,
            started,
            waiting: waiting.into(),
        }
    }

    fn run(mut self) -> IpcaRanking {
        let until = self.started.rules.until;
        let stop = loop {
            if self.started.ranking.len() >= until.landmarks {
                break Stop::Landmarks;
            }
            let contenders = self.contenders();
            let residuals = self.reduce(&contenders);
            let Some((next, residual)) = self.started.rules.next(&residuals) else {
                break Stop::Exhausted;
            };
            if let Some(stop) = self.started.rules.stop(residual) {
                break stop;
            }
            self.select(next);
            for (mut candidate, (_, residual)) in contenders.into_iter().zip(residuals) {
                if candidate.number != next {
                    candidate.squared = residual * residual;
                    candidate.reduced = candidate.squared;
                    self.wait(candidate);
                }
            }
        };
        IpcaRanking {
            ranking: self.started.ranking,
            residuals: self.started.residuals,
            stop,
        }
    }

    /// Takes all candidates out of the heap that may have the largest residual, or one equal to it.
    fn contenders(&mut self) -> Vec<Candidate> {
        let current = self.started.hull.dimensions() as u32;
        let mut contenders: Vec<Candidate> = Vec::new();
        // Whoever has less than this for certain is not the next.
        let mut floor = f64::NEG_INFINITY;
        let mut batch = FIRST_BATCH;
        loop {
            let mut stale = Vec::new();
            while stale.len() < batch
                && let Some(top) = self.waiting.peek()
                && top.most >= floor
                && let Some(top) = self.waiting.pop()
            {
                if !self.eligible.admits(top.number, &self.started.ranking) {
                    continue;
                }
                if top.seen < current {
                    stale.push(top);
                } else {
                    floor = floor.max(self.floor_under(&top));
                    contenders.push(top);
                }
            }
            if stale.is_empty() {
                break;
            }
            for candidate in self.evaluated(stale) {
                self.wait(candidate);
            }
            batch *= 2;
        }
        let (contenders, others) = contenders.into_iter().partition(|c| c.most >= floor);
        self.waiting.extend::<Vec<Candidate>>(others);
        contenders
    }

    /// The least ‖r‖² of what may be equal to this candidate, or larger.
    fn floor_under(&self, candidate: &Candidate) -> f64 {
        let Started {
            deviations,
            hull,
            rules,
            ..
        } = &self.started;
        let error = candidate.error(deviations.pixels(), hull.dimensions());
        let least = (candidate.squared - error).max(0.0).sqrt() - rules.tie;
        if least > 0.0 {
            least * least
        } else {
            f64::NEG_INFINITY
        }
    }

    /// The same candidates with all directions seen.
    fn evaluated(&self, mut candidates: Vec<Candidate>) -> Vec<Candidate> {
        let Started {
            deviations, hull, ..
        } = &self.started;
        // Those that lack the same directions together, and neighbors.
        candidates.sort_unstable_by_key(|candidate| (candidate.seen, candidate.number));
        candidates.par_chunks_mut(EVALUATED).for_each(|block| {
            let numbers: Vec<u32> = block.iter().map(|candidate| candidate.number).collect();
            let first = block[0].seen;
            let parts = hull.parts(&deviations.read(&numbers), first as usize);
            for (i, candidate) in block.iter_mut().enumerate() {
                let unseen = (candidate.seen - first) as usize..parts.ncols();
                let removed: f64 = unseen.map(|j| parts[(i, j)] * parts[(i, j)]).sum();
                candidate.squared -= removed;
                candidate.seen = hull.dimensions() as u32;
            }
        });
        candidates
    }

    /// The residuals of these candidates, from their views.
    fn reduce(&self, candidates: &[Candidate]) -> Vec<(u32, f64)> {
        let Started {
            deviations, hull, ..
        } = &self.started;
        candidates
            .par_chunks(EVALUATED)
            .flat_map_iter(|block| {
                let numbers: Vec<u32> = block.iter().map(|candidate| candidate.number).collect();
                let residuals = hull.reduce(&mut deviations.read(&numbers));
                numbers.into_iter().zip(residuals)
            })
            .collect()
    }

    fn select(&mut self, candidate: u32) {
        let mut deviation = self.started.deviations.read(&[candidate]);
        let residual = self.started.hull.reduce(&mut deviation)[0];
        self.started.hull.push(&deviation, residual);
        self.started.ranking.push(candidate);
        self.started.residuals.push(residual);
    }

    /// Back into the heap.
    fn wait(&mut self, mut candidate: Candidate) {
        let Started {
            deviations, hull, ..
        } = &self.started;
        let error = candidate.error(deviations.pixels(), hull.dimensions());
        candidate.most = candidate.squared + error;
        self.waiting.push(candidate);
    }
}
