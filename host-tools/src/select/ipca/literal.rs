//! Algorithm 2.4 as it is printed (corrected): the oracle.
//!
//! **Cost.** Every view is read for every landmark; 2·n·m·k multiply-adds each time, and an update of the eigenspace.
//! [`BLOCK`] views per thread in memory.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::deviations::{BLOCK, Block};
use super::start::Started;
use super::{IpcaError, IpcaRanking, Stop, Until};
use crate::learn::{Growth, IncrementalPca, Rows};
use crate::select::Eligible;

/// Ranks by projecting every candidate into the eigenspace of the landmarks, which grows with each; `start` are the
/// first ones (1-based), in their order, at most as many as landmarks are asked for.
///
/// # Errors
/// When the start list cannot be one, or a view is not finite.
pub fn rank_by_ipca_literally(
    rows: &dyn Rows,
    eligible: &Eligible,
    start: &[u32],
    until: Until,
) -> Result<IpcaRanking, IpcaError> {
    let Started {
        deviations,
        rules,
        mut ranking,
        mut residuals,
        ..
    } = Started::new(rows, eligible, start, until)?;
    let not_finite = |candidate| IpcaError::NotFinite { candidate };
    // Members that those before them express would move the mean and tilt the axes by what rounding has left of them.
    let expressing: Vec<u32> = (0..ranking.len())
        .filter(|&i| i == 0 || residuals[i] > rules.zero)
        .map(|i| ranking[i])
        .collect();
    let members = deviations.read(&expressing);
    let mut eigenspace = IncrementalPca::of_all(&members, deviations.pixels(), Growth::Exact)
        .ok_or(not_finite(start[0]))?;
    let mut remaining: Vec<u32> = eligible.candidates().to_vec();
    remaining.retain(|candidate| !ranking.contains(candidate));
    let stop = loop {
        if ranking.len() >= until.landmarks {
            break Stop::Landmarks;
        }
        remaining.retain(|&candidate| eligible.admits(candidate, &ranking));
        let expressed: Vec<(u32, f64)> = remaining
            .par_chunks(BLOCK)
            .map_init(Block::default, |block, candidates| {
                let block = deviations.read_into(candidates, block);
                let residuals = residuals_of(block, &eigenspace);
                candidates.iter().copied().zip(residuals)
            })
            .flatten_iter()
            .collect();
        let Some((next, residual)) = rules.next(&expressed) else {
            break Stop::Exhausted;
        };
        if let Some(stop) = rules.stop(residual) {
            break stop;
        }
        ranking.push(next);
        residuals.push(residual);
        remaining.retain(|&candidate| candidate != next);
        eigenspace
            .add(&deviations.read(&[next]))
            .ok_or(not_finite(next))?;
    };
    Ok(IpcaRanking {
        ranking,
        residuals,
        stop,
    })
}

/// ‖r‖ of a block of vectors, report (2.20) and (2.21); afterwards `block` has the residuals.
fn residuals_of(block: &mut [f64], eigenspace: &IncrementalPca) -> Vec<f64> {
    let (m, k) = (eigenspace.pixels(), eigenspace.dimensions());
    let count = block.len() / m;
    for row in block.chunks_exact_mut(m) {
        for (x, mean) in row.iter_mut().zip(eigenspace.mean()) {
            *x -= mean;
        }
    }
    if k > 0 {
        let basis = MatRef::from_row_major_slice(eigenspace.basis(), k, m);
        let mut coefficients = Mat::zeros(count, k);
        matmul(
            coefficients.as_mut(),
            Accum::Replace,
            MatRef::from_row_major_slice(block, count, m),
            basis.transpose(),
            1.0,
            Par::Seq,
        );
        matmul(
            MatMut::from_row_major_slice_mut(block, count, m),
            Accum::Add,
            coefficients.as_ref(),
            basis,
            -1.0,
            Par::Seq,
        );
    }
    let rows = block.chunks_exact(m);
    rows.map(|row| row.iter().map(|x| x * x).sum::<f64>().sqrt())
        .collect()
}
