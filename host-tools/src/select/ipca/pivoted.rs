//! The same ranking without an eigenspace: Gram-Schmidt with pivoting, as late as possible.
//!
//! **What.** A residual only shrinks while landmarks are added. So what is known of a candidate's from earlier is an
//! upper bound now, and most candidates never come near the top: only those that do are brought up to date.
//!
//! **Notation.** y = x − x_s0; u_j the directions of the hull, d of them.
//!
//! **Method.** ‖r‖² = ‖y‖² − Σ_j (u_jᵀy)². For every landmark, candidates are brought up to date from the largest
//! upper bound down, more of them at a time the longer it takes, until nothing older can be the largest. The difference
//! has lost digits where little is left of ‖y‖²; therefore each candidate carries a bound of its error
//! ([`Candidate::error`]), and all that may be largest within their bounds are reduced properly, by Gram-Schmidt on the
//! view itself (twice), before one is chosen.
//!
//! **Cost.** One pass over all views, m·(1 + directions of the start list) multiply-adds each; then m·(directions not
//! seen yet) for each time that a candidate is brought up to date, and its view is read again for it: 3 to 5 times a
//! view in all, for 50 landmarks. Memory is 56 bytes per candidate. Rejected: a heap of candidates, which took as long
//! as the arithmetic.
//!
//! **Limits.** None beyond the module's: the result does not depend on the number of threads.

use rayon::prelude::*;

use super::deviations::Block;
use super::start::Started;
use super::{IpcaError, IpcaRanking, Stop, Until};
use crate::learn::Rows;
use crate::select::Eligible;

/// Candidates that are brought up to date together at first; twice as many each time that was not enough.
const FIRST_BATCH: usize = 64;

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
pub fn rank_by_ipca(
    rows: &dyn Rows,
    eligible: &Eligible,
    start: &[u32],
    until: Until,
) -> Result<IpcaRanking, IpcaError> {
    let started = Started::new(rows, eligible, start, until)?;
    // One of the pool's threads: it hands out work without waking up anyone to ask for it.
    Ok(rayon::scope(|_| Search::new(started, eligible).run()))
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

struct Search<'a> {
    eligible: &'a Eligible,
    started: Started<'a>,
    /// All eligible ones, by number.
    candidates: Vec<Candidate>,
    /// The largest that ‖r‖² of each may be; negative for what is not to be selected any more.
    most: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(started: Started<'a>, eligible: &'a Eligible) -> Self {
        let surveyed = eligible.candidates().iter().zip(&started.surveyed);
        let candidates: Vec<Candidate> = surveyed
            .map(|(&number, surveyed)| Candidate {
                number,
                seen: started.seen as u32,
                energy: surveyed.energy,
                reduced: surveyed.energy,
                squared: if started.seen == 0 {
                    surveyed.energy
                } else {
                    surveyed.squared
                },
            })
            .collect();
        let mut search = Self {
            eligible,
            started,
            most: vec![0.0; candidates.len()],
            candidates,
        };
        for index in 0..search.candidates.len() {
            search.bound(index);
        }
        for landmark in search.started.ranking.clone() {
            search.retire(landmark);
        }
        search
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
            for (index, (_, residual)) in contenders.into_iter().zip(residuals) {
                let candidate = &mut self.candidates[index];
                candidate.squared = residual * residual;
                candidate.reduced = candidate.squared;
                self.bound(index);
            }
            self.select(next);
        };
        IpcaRanking {
            ranking: self.started.ranking,
            residuals: self.started.residuals,
            stop,
        }
    }

    /// All candidates that may have the largest residual, or one equal to it; they are up to date.
    fn contenders(&mut self) -> Vec<usize> {
        let current = self.started.hull.dimensions() as u32;
        let Some(top) = largest(&self.most) else {
            return Vec::new();
        };
        self.update(&mut [top]);
        // Whoever has less than this for certain is not the next.
        let mut floor = self.floor_under(top);
        let reaching = self.most.iter().enumerate();
        let (mut stale, mut updated): (Vec<usize>, Vec<usize>) = reaching
            .filter(|&(_, &most)| most >= floor)
            .map(|(index, _)| index)
            .partition(|&index| self.candidates[index].seen < current);
        let mut batch = FIRST_BATCH;
        while !stale.is_empty() {
            let mut others = Vec::new();
            if stale.len() > batch {
                let by_most = |&a: &usize, &b: &usize| {
                    let descending = self.most[b].total_cmp(&self.most[a]);
                    descending.then(a.cmp(&b))
                };
                stale.select_nth_unstable_by(batch, by_most);
                others = stale.split_off(batch);
            }
            self.update(&mut stale);
            for &index in &stale {
                floor = floor.max(self.floor_under(index));
            }
            updated.append(&mut stale);
            others.retain(|&index| self.most[index] >= floor);
            stale = others;
            batch *= 2;
        }
        for &index in &updated {
            floor = floor.max(self.floor_under(index));
        }
        updated.retain(|&index| self.most[index] >= floor);
        updated
    }

    /// The least ‖r‖² of what may be equal to this candidate, or larger.
    fn floor_under(&self, index: usize) -> f64 {
        let candidate = &self.candidates[index];
        let Started {
            deviations,
            hull,
            rules,
            ..
        } = &self.started;
        let error = candidate.error(deviations.pixels(), hull.dimensions());
        let least = (candidate.squared - error).max(0.0).sqrt() - rules.tie;
        least.max(0.0).powi(2)
    }

    /// Lets these candidates see all directions.
    fn update(&mut self, indices: &mut [usize]) {
        let Started {
            deviations, hull, ..
        } = &self.started;
        let candidates = &self.candidates;
        // Those that lack the same directions together, and neighbors.
        indices.sort_unstable_by_key(|&index| (candidates[index].seen, index));
        let squared: Vec<f64> = indices
            .par_chunks(EVALUATED)
            .map_init(Block::default, |block, indices| {
                let members = || indices.iter().map(|&index| &candidates[index]);
                let first = candidates[indices[0]].seen as usize;
                let numbers: Vec<u32> = members().map(|candidate| candidate.number).collect();
                let parts = hull.parts(deviations.read_into(&numbers, block), first);
                let squared = members().enumerate().map(|(i, candidate)| {
                    let unseen = candidate.seen as usize - first..parts.ncols();
                    let removed: f64 = unseen.map(|j| parts[(i, j)] * parts[(i, j)]).sum();
                    candidate.squared - removed
                });
                squared.collect::<Vec<f64>>()
            })
            .flatten_iter()
            .collect();
        let current = hull.dimensions() as u32;
        for (&index, squared) in indices.iter().zip(squared) {
            self.candidates[index].squared = squared;
            self.candidates[index].seen = current;
            self.bound(index);
        }
    }

    /// The residuals of these candidates, from their views.
    fn reduce(&self, indices: &[usize]) -> Vec<(u32, f64)> {
        let Started {
            deviations, hull, ..
        } = &self.started;
        indices
            .par_chunks(EVALUATED)
            .flat_map_iter(|block| {
                let number = |&index: &usize| self.candidates[index].number;
                let numbers: Vec<u32> = block.iter().map(number).collect();
                let residuals = hull.reduce(&mut deviations.read(&numbers));
                numbers.into_iter().zip(residuals)
            })
            .collect()
    }

    fn select(&mut self, landmark: u32) {
        let mut deviation = self.started.deviations.read(&[landmark]);
        let residual = self.started.hull.reduce(&mut deviation)[0];
        self.started.hull.push(&deviation, residual);
        self.started.ranking.push(landmark);
        self.started.residuals.push(residual);
        self.retire(landmark);
    }

    /// Neither this landmark is to be selected any more, nor what is too close to it.
    fn retire(&mut self, landmark: u32) {
        let numbers = self.eligible.candidates();
        for (most, &number) in self.most.iter_mut().zip(numbers) {
            if number == landmark || !self.eligible.admits_both(number, landmark) {
                *most = f64::NEG_INFINITY;
            }
        }
    }

    fn bound(&mut self, index: usize) {
        let candidate = &self.candidates[index];
        let Started {
            deviations, hull, ..
        } = &self.started;
        let error = candidate.error(deviations.pixels(), hull.dimensions());
        self.most[index] = (candidate.squared + error).max(0.0);
    }
}

/// Where the largest number is, the first of equals, unless all are negative.
fn largest(numbers: &[f64]) -> Option<usize> {
    let mut largest = None;
    let mut value = -f64::MIN_POSITIVE;
    for (index, &number) in numbers.iter().enumerate() {
        if number > value {
            (largest, value) = (Some(index), number);
        }
    }
    largest
}
