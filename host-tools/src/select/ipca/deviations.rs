//! Views less the first landmark's, x − x_s0, read a block at a time.

use rayon::prelude::*;

use crate::learn::Rows;

/// Rows that one thread reads at once: they stay in its cache up to some 1,000 pixels.
pub const BLOCK: usize = 64;

/// Sums that run side by side, so that the compiler uses vector instructions.
const LANES: usize = 8;

/// Views as seen from one of them.
pub struct Deviations<'a, R> {
    rows: &'a R,
    /// x_s0.
    origin: Vec<f32>,
}

impl<'a, R: Rows> Deviations<'a, R> {
    /// `first` is the candidate (1-based) that is subtracted.
    pub fn new(rows: &'a R, first: u32) -> Self {
        let mut origin = vec![0.0; rows.pixels()];
        rows.read(first as usize - 1, &mut origin);
        Self { rows, origin }
    }

    /// Numbers per view, m.
    pub fn pixels(&self) -> usize {
        self.origin.len()
    }

    /// x − x_s0 of these candidates, one row of m each.
    pub fn read(&self, candidates: &[u32]) -> Vec<f64> {
        let views = self.views(candidates);
        let origin = self.origin.iter().cycle();
        views
            .iter()
            .zip(origin)
            .map(|(&x, &origin)| f64::from(x) - f64::from(origin))
            .collect()
    }

    /// ‖x − x_s0‖² of these candidates.
    pub fn energies(&self, candidates: &[u32]) -> Vec<f64> {
        candidates
            .par_chunks(BLOCK)
            .flat_map_iter(|block| {
                let views = self.views(block);
                let energies = views
                    .chunks_exact(self.pixels())
                    .map(|view| self.energy(view));
                energies.collect::<Vec<f64>>()
            })
            .collect()
    }

    /// The candidates' views; neighbors are read together.
    fn views(&self, candidates: &[u32]) -> Vec<f32> {
        let m = self.pixels();
        let mut views = vec![0.0; candidates.len() * m];
        let mut rest = views.as_mut_slice();
        for run in candidates.chunk_by(|a, b| a + 1 == *b) {
            let (out, after) = rest.split_at_mut(run.len() * m);
            self.rows.read(run[0] as usize - 1, out);
            rest = after;
        }
        views
    }

    fn energy(&self, view: &[f32]) -> f64 {
        let mut sums = [0.0; LANES];
        let (whole, rest) = view.as_chunks::<LANES>();
        let (origins, rest_of_origin) = self.origin.as_chunks::<LANES>();
        for (view, origin) in whole.iter().zip(origins) {
            for ((sum, &x), &origin) in sums.iter_mut().zip(view).zip(origin) {
                let deviation = f64::from(x) - f64::from(origin);
                *sum += deviation * deviation;
            }
        }
        for ((sum, &x), &origin) in sums.iter_mut().zip(rest).zip(rest_of_origin) {
            let deviation = f64::from(x) - f64::from(origin);
            *sum += deviation * deviation;
        }
        sums.iter().sum()
    }
}
