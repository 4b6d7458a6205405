//! Views less the first landmark's, x − x_s0, read a block at a time.

use rayon::prelude::*;

use super::hull::Hull;
use crate::learn::Rows;

/// Rows that one thread reads at once: they stay in its cache up to some 1,000 pixels.
pub const BLOCK: usize = 64;

/// Sums that run side by side, so that the compiler uses vector instructions.
const LANES: usize = 8;

/// Views as seen from one of them.
pub struct Deviations<'a> {
    rows: &'a dyn Rows,
    /// x_s0.
    origin: Vec<f64>,
}

/// What a first look says about a view.
#[derive(Clone, Copy)]
pub struct Surveyed {
    /// ‖x − x_s0‖².
    pub energy: f64,
    /// The same, less what lies along the directions of a hull.
    pub squared: f64,
}

/// Memory for a block of views.
#[derive(Default)]
pub struct Block {
    views: Vec<f32>,
    deviations: Vec<f64>,
}

impl<'a> Deviations<'a> {
    /// `first` is the candidate (1-based) that is subtracted.
    pub fn new(rows: &'a dyn Rows, first: u32) -> Self {
        let mut origin = vec![0.0; rows.pixels()];
        rows.read(first as usize - 1, &mut origin);
        let origin = origin.into_iter().map(f64::from).collect();
        Self { rows, origin }
    }

    /// Numbers per view, m.
    pub fn pixels(&self) -> usize {
        self.origin.len()
    }

    /// x − x_s0 of these candidates, one row of m each.
    pub fn read(&self, candidates: &[u32]) -> Vec<f64> {
        let mut block = Block::default();
        self.read_into(candidates, &mut block);
        block.deviations
    }

    /// The same, in memory that is used again.
    pub fn read_into<'b>(&self, candidates: &[u32], block: &'b mut Block) -> &'b mut [f64] {
        let m = self.pixels();
        block.deviations.resize(candidates.len() * m, 0.0);
        let mut rows = block.deviations.chunks_exact_mut(m);
        self.for_each_run(candidates, &mut block.views, |views| {
            for (view, row) in views.chunks_exact(m).zip(&mut rows) {
                for ((deviation, &x), origin) in row.iter_mut().zip(view).zip(&self.origin) {
                    *deviation = f64::from(x) - origin;
                }
            }
        });
        &mut block.deviations
    }

    /// Reads each of these candidates once.
    pub fn survey(&self, candidates: &[u32], hull: &Hull) -> Vec<Surveyed> {
        candidates
            .par_chunks(BLOCK)
            .map_init(Block::default, |block, candidates| {
                let deviations = self.read_into(candidates, block);
                let parts = hull.parts(deviations, 0);
                let rows = deviations.chunks_exact(self.pixels()).enumerate();
                let surveyed = rows.map(|(i, row)| {
                    let energy = energy(row);
                    let removed: f64 = parts.row(i).iter().map(|part| part * part).sum();
                    let squared = energy - removed;
                    Surveyed { energy, squared }
                });
                surveyed.collect::<Vec<Surveyed>>()
            })
            .flatten_iter()
            .collect()
    }

    /// Reads the candidates' views, neighbors together; `buffer` is used again.
    fn for_each_run(
        &self,
        candidates: &[u32],
        buffer: &mut Vec<f32>,
        mut each: impl FnMut(&[f32]),
    ) {
        for run in candidates.chunk_by(|a, b| a + 1 == *b) {
            each(self.rows.block(run[0] as usize - 1, run.len(), buffer));
        }
    }
}

/// ‖y‖², in an order of its own.
fn energy(deviation: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (whole, rest) = deviation.as_chunks::<LANES>();
    for values in whole {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value * value;
        }
    }
    for (sum, value) in sums.iter_mut().zip(rest) {
        *sum += value * value;
    }
    sums.iter().sum()
}
