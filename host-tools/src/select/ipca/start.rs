//! What a ranking starts from: the first landmarks, given or drawn.
//!
//! A start list from the profile ranking is its first few numbers.

use rand::seq::SliceRandom;

use super::deviations::Deviations;
use super::hull::Hull;
use super::{IpcaError, Rules, Until};
use crate::learn::Rows;
use crate::select::Eligible;
use crate::simulate::seeded;

/// The stream of random numbers that belongs to start lists.
const STREAM: u64 = 0x1bca;

/// `size` different candidates (1-based) that may be landmarks together, the same for the same seed.
///
/// # Errors
/// When there are not so many, or the draw finds no more that keep their distance.
pub fn random_start(eligible: &Eligible, size: usize, seed: u64) -> Result<Vec<u32>, IpcaError> {
    let mut drawn = eligible.candidates().to_vec();
    drawn.shuffle(&mut seeded(seed, STREAM));
    let start = eligible.best_of(&drawn, size);
    if start.len() < size {
        return Err(IpcaError::TooFew {
            asked: size,
            found: start.len(),
        });
    }
    Ok(start)
}

/// A selection that has its first landmarks.
pub struct Started<'a, R> {
    /// All views, less the first landmark's.
    pub deviations: Deviations<'a, R>,
    /// ‖x − x_s0‖² of every eligible candidate.
    pub energies: Vec<f64>,
    /// The affine hull of the landmarks.
    pub hull: Hull,
    pub rules: Rules,
    /// The landmarks so far.
    pub ranking: Vec<u32>,
    /// Residual of each to those before it.
    pub residuals: Vec<f64>,
}

impl<'a, R: Rows> Started<'a, R> {
    /// Selects the members of `start`, at most as many as landmarks are asked for.
    pub fn new(
        rows: &'a R,
        eligible: &Eligible,
        start: &[u32],
        until: Until,
    ) -> Result<Self, IpcaError> {
        check(rows, eligible, start)?;
        let deviations = Deviations::new(rows, start[0]);
        let energies = deviations.energies(eligible.candidates());
        let mut checked = eligible.candidates().iter().zip(&energies);
        if let Some((&candidate, _)) = checked.find(|(_, energy)| !energy.is_finite()) {
            return Err(IpcaError::NotFinite { candidate });
        }
        let scale = energies.iter().copied().fold(0.0, f64::max).sqrt();
        let rules = Rules::new(until, scale);

        let ranking = start[..start.len().min(until.landmarks)].to_vec();
        let mut hull = Hull::new(rows.pixels());
        let mut residuals = Vec::with_capacity(until.landmarks.min(energies.len()));
        for &member in &ranking {
            let mut deviation = deviations.read(&[member]);
            let residual = hull.reduce(&mut deviation)[0];
            residuals.push(residual);
            if residual > rules.zero {
                hull.push(&deviation, residual);
            }
        }
        Ok(Self {
            deviations,
            energies,
            hull,
            rules,
            ranking,
            residuals,
        })
    }
}

/// Rejects what cannot be started from.
fn check<R: Rows>(rows: &R, eligible: &Eligible, start: &[u32]) -> Result<(), IpcaError> {
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
