//! What a ranking starts from: the first landmarks, given or drawn.
//!
//! A start list from the profile ranking is its first few numbers.

use rand::seq::SliceRandom;

use super::deviations::{Deviations, Surveyed};
use super::hull::Hull;
use super::{IpcaError, Rules, Until};
use crate::learn::Rows;
use crate::select::Eligible;
use crate::simulate::seeded;

/// The stream of random numbers that belongs to start lists.
const STREAM: u64 = 0x1bca;

/// How often candidates are drawn when those drawn are too close to others.
const DRAWS: usize = 100;

/// `size` different candidates (1-based) that may be landmarks together, the same for the same seed.
///
/// # Errors
/// When there are not so many, or the draw finds no more that keep their distance.
pub fn random_start(eligible: &Eligible, size: usize, seed: u64) -> Result<Vec<u32>, IpcaError> {
    let mut random = seeded(seed, STREAM);
    let mut drawn = eligible.candidates().to_vec();
    let mut found = 0;
    for _ in 0..DRAWS {
        drawn.shuffle(&mut random);
        let start = eligible.best_of(&drawn, size);
        if start.len() == size {
            return Ok(start);
        }
        found = found.max(start.len());
    }
    Err(IpcaError::TooFew { asked: size, found })
}

/// A selection that has its first landmarks.
pub struct Started<'a> {
    /// All views, less the first landmark's.
    pub deviations: Deviations<'a>,
    /// What is known of every eligible candidate.
    pub surveyed: Vec<Surveyed>,
    /// Directions that are in the survey, of all there are now.
    pub seen: usize,
    /// The affine hull of the landmarks.
    pub hull: Hull,
    pub rules: Rules,
    /// The landmarks so far.
    pub ranking: Vec<u32>,
    /// Residual of each to those before it.
    pub residuals: Vec<f64>,
}

impl<'a> Started<'a> {
    /// Selects the members of `start`, at most as many as landmarks are asked for.
    pub fn new(
        rows: &'a dyn Rows,
        eligible: &Eligible,
        start: &[u32],
        until: Until,
    ) -> Result<Self, IpcaError> {
        check(rows, eligible, start)?;
        let deviations = Deviations::new(rows, start[0]);
        let ranking = start[..start.len().min(until.landmarks)].to_vec();
        let members = deviations.read(&ranking);
        // Views are read once for both their distances and the directions to remove. Which directions those are
        // depends on the largest distance; the members' own is a guess.
        let farthest = members
            .chunks_exact(rows.pixels())
            .map(|member| member.iter().map(|x| x * x).sum())
            .fold(0.0, f64::max)
            .sqrt();
        let guess = Rules::new(until, farthest);
        let (guessed, residuals) = Hull::of(&members, rows.pixels(), guess.zero);

        let surveyed = deviations.survey(eligible.candidates(), &guessed);
        let mut checked = eligible.candidates().iter().zip(&surveyed);
        if let Some((&candidate, _)) = checked.find(|(_, candidate)| !candidate.energy.is_finite())
        {
            return Err(IpcaError::NotFinite { candidate });
        }
        let energies = surveyed.iter().map(|candidate| candidate.energy);
        let rules = Rules::new(until, energies.fold(0.0, f64::max).sqrt());
        let mut all = residuals.iter();
        let (hull, residuals, seen) = if all.all(|&r| r <= guess.zero || r > rules.zero) {
            let seen = guessed.dimensions();
            (guessed, residuals, seen)
        } else {
            let (hull, residuals) = Hull::of(&members, rows.pixels(), rules.zero);
            (hull, residuals, 0)
        };
        Ok(Self {
            deviations,
            surveyed,
            seen,
            hull,
            rules,
            ranking,
            residuals,
        })
    }
}

/// Rejects what cannot be started from.
fn check(rows: &dyn Rows, eligible: &Eligible, start: &[u32]) -> Result<(), IpcaError> {
    let count = rows.count();
    if start.is_empty() {
        return Err(IpcaError::EmptyStart);
    }
    let mut numbers = start.iter().chain(eligible.candidates());
    if let Some(&candidate) = numbers.find(|&&number| number == 0 || number as usize > count) {
        return Err(IpcaError::Unknown { candidate, count });
    }
    for (i, &candidate) in start.iter().enumerate() {
        let before = &start[..i];
        if before.contains(&candidate) {
            return Err(IpcaError::Repeated { candidate });
        }
        if eligible.candidates().binary_search(&candidate).is_err() {
            return Err(IpcaError::Ineligible { candidate });
        }
        if let Some(&other) = before
            .iter()
            .find(|&&other| !eligible.admits_both(candidate, other))
        {
            return Err(IpcaError::TooClose { candidate, other });
        }
    }
    Ok(())
}
