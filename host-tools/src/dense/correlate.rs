//! Correlation of real pictures with real kernels by the fast Fourier transform, where a kernel lies within the picture.
//!
//! **Notation.** A transform has `width`×`height` numbers, `width` even. The spectrum of a real picture is known from its
//! first width/2 + 1 columns; it is stored column by column, so that columns are transformed where they lie.
//!
//! **Method.** c(x, y) = Σ_ij kernel(i, j)·picture(x + i, y + j) is the inverse transform of the picture's spectrum times
//! the conjugate of the kernel's. Correlation is circular, but where the kernel does not reach beyond the picture nothing
//! wraps around: padding to `width`×`height` is all there is, and only those places are computed. Rows are transformed
//! as real numbers. Between rows and columns [`LINES`] columns are moved at a time, whole cache lines; on the way back
//! they are multiplied, transformed and moved while they are in the cache. Rows of a kernel that are zero are not
//! transformed, nor rows of the result that wrap around.
//!
//! **Cost.** 16 bytes per number of the half spectrum; as much again while one is made, or turned back.
//!
//! **Limits.** Bits are the same for any number of threads, but may change with the processor: how a transform adds
//! depends on its vector instructions.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex, num_complex::Complex64};
use rustfft::{Fft, FftPlanner};

/// Columns that are moved at once: two cache lines per row.
const LINES: usize = 8;

/// Rows, or groups of columns, that are worth a task.
const MIN_TASK: usize = 8;

/// The planned transforms of one size.
pub(super) struct Correlator {
    width: usize,
    height: usize,
    forward_rows: Arc<dyn RealToComplex<f64>>,
    inverse_rows: Arc<dyn ComplexToReal<f64>>,
    forward_columns: Arc<dyn Fft<f64>>,
    inverse_columns: Arc<dyn Fft<f64>>,
    /// What correlations have used before, to spare fresh pages.
    used: Mutex<Vec<Scratch>>,
}

/// Half of the spectrum of a real picture, column by column.
pub(super) struct Spectrum(Vec<Complex64>);

/// What a correlation needs for the time being.
struct Scratch {
    lines: Vec<Complex64>,
    /// Columns transformed back, row by row.
    rows: Vec<Complex64>,
    row: Vec<f64>,
    of_columns: Vec<Complex64>,
    of_rows: Vec<Complex64>,
}

impl Correlator {
    /// Plans transforms of `width`×`height` numbers.
    ///
    /// # Panics
    /// When the width is odd or a size is zero.
    pub(super) fn new((width, height): (usize, usize)) -> Self {
        assert!(width > 0 && width.is_multiple_of(2) && height > 0);
        let mut real = RealFftPlanner::new();
        let mut complex = FftPlanner::new();
        Self {
            width,
            height,
            forward_rows: real.plan_fft_forward(width),
            inverse_rows: real.plan_fft_inverse(width),
            forward_columns: complex.plan_fft_forward(height),
            inverse_columns: complex.plan_fft_inverse(height),
            used: Mutex::default(),
        }
    }

    /// The spectrum of a kernel of rows of `side` weights, scaled for [`correlate`](Self::correlate).
    pub(super) fn kernel(&self, weights: &[f64], side: usize) -> Spectrum {
        let scale = 1.0 / (self.width * self.height) as f64;
        self.spectrum(weights.len() / side, |row, out| {
            for (out, weight) in out.iter_mut().zip(&weights[row * side..][..side]) {
                *out = weight * scale;
            }
        })
    }

    /// The spectrum of a picture of rows of `width` pixels.
    pub(super) fn picture(&self, pixels: &[u8], width: usize) -> Spectrum {
        self.spectrum(pixels.len() / width, |row, out| {
            for (out, &pixel) in out.iter_mut().zip(&pixels[row * width..][..width]) {
                *out = f64::from(pixel);
            }
        })
    }

    /// The correlation of a picture with a kernel, its first rows of `columns` numbers, as many as `out` holds.
    ///
    /// # Panics
    /// When spectra are not this correlator's, or `out` is larger than a transform.
    pub(super) fn correlate(
        &self,
        picture: &Spectrum,
        kernel: &Spectrum,
        columns: usize,
        out: &mut [f64],
    ) {
        let stride = self.columns();
        let mut scratch = self.scratch();
        let rows = &mut scratch.rows[..out.len() / columns * stride];
        let length = LINES * self.height;
        let groups = picture
            .0
            .chunks_exact(length)
            .zip(kernel.0.chunks_exact(length));
        for (group, (picture, kernel)) in groups.enumerate() {
            let lines = &mut scratch.lines[..];
            for (product, (p, k)) in lines.iter_mut().zip(picture.iter().zip(kernel)) {
                *product = p * k.conj();
            }
            self.inverse_columns
                .process_with_scratch(lines, &mut scratch.of_columns);
            let columns = self.split(lines);
            for (y, row) in rows.chunks_exact_mut(stride).enumerate() {
                let to = &mut row[group * LINES..][..LINES];
                for (to, column) in to.iter_mut().zip(columns) {
                    *to = column[y];
                }
            }
        }
        for (row, out) in rows
            .chunks_exact_mut(stride)
            .zip(out.chunks_exact_mut(columns))
        {
            let row = &mut row[..self.width / 2 + 1];
            // Both are real but for rounding, and the transform insists.
            row[0].im = 0.0;
            row[self.width / 2].im = 0.0;
            self.inverse_rows
                .process_with_scratch(row, &mut scratch.row, &mut scratch.of_rows)
                .expect("buffers of its own lengths");
            out.copy_from_slice(&scratch.row[..columns]);
        }
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        used.push(scratch);
    }

    /// Scratch that was used before, or new.
    fn scratch(&self) -> Scratch {
        let mut used = self.used.lock().unwrap_or_else(PoisonError::into_inner);
        used.pop().unwrap_or_else(|| Scratch {
            lines: vec![Complex64::ZERO; LINES * self.height],
            rows: vec![Complex64::ZERO; self.columns() * self.height],
            row: self.inverse_rows.make_output_vec(),
            of_columns: scratch_of(&*self.inverse_columns),
            of_rows: self.inverse_rows.make_scratch_vec(),
        })
    }

    /// Columns of a spectrum, those included that fill up the last group.
    fn columns(&self) -> usize {
        (self.width / 2 + 1).next_multiple_of(LINES)
    }

    /// The columns of a group.
    fn split<'l>(&self, lines: &'l [Complex64]) -> [&'l [Complex64]; LINES] {
        std::array::from_fn(|column| &lines[column * self.height..][..self.height])
    }

    /// The spectrum of a picture whose first `rows` rows `read` writes over zeros; the others are zero.
    fn spectrum(&self, rows: usize, read: impl Fn(usize, &mut [f64]) + Sync) -> Spectrum {
        let stride = self.columns();
        let mut by_rows = vec![Complex64::ZERO; rows * stride];
        let transform = &self.forward_rows;
        by_rows
            .par_chunks_exact_mut(stride)
            .enumerate()
            .with_min_len(MIN_TASK)
            .for_each_init(
                || (transform.make_input_vec(), transform.make_scratch_vec()),
                |(row, scratch), (y, out)| {
                    row.fill(0.0);
                    read(y, row);
                    transform
                        .process_with_scratch(row, &mut out[..self.width / 2 + 1], scratch)
                        .expect("buffers of its own lengths");
                },
            );
        let mut spectrum = vec![Complex64::ZERO; stride * self.height];
        let transform = &self.forward_columns;
        spectrum
            .par_chunks_exact_mut(LINES * self.height)
            .enumerate()
            .with_min_len(MIN_TASK)
            .for_each_init(
                || scratch_of(&**transform),
                |scratch, (group, lines)| {
                    let mut split = lines.chunks_exact_mut(self.height);
                    let mut columns: [&mut [Complex64]; LINES] =
                        std::array::from_fn(|_| split.next().expect("a whole group"));
                    for (y, row) in by_rows.chunks_exact(stride).enumerate() {
                        let from = &row[group * LINES..][..LINES];
                        for (column, from) in columns.iter_mut().zip(from) {
                            column[y] = *from;
                        }
                    }
                    transform.process_with_scratch(lines, scratch);
                },
            );
        Spectrum(spectrum)
    }
}

fn scratch_of(transform: &dyn Fft<f64>) -> Vec<Complex64> {
    vec![Complex64::ZERO; transform.get_inplace_scratch_len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_of_one_weight_moves_the_picture() {
        let correlator = Correlator::new((6, 5));
        let pixels: Vec<u8> = (1..=30).collect();
        let picture = correlator.picture(&pixels, 6);
        // Weight 2 at column 1 of row 1.
        let kernel = correlator.kernel(&[0.0, 0.0, 0.0, 2.0], 2);
        let mut out = [0.0; 20];
        correlator.correlate(&picture, &kernel, 5, &mut out);
        for (at, found) in out.iter().enumerate() {
            let expected = 2.0 * f64::from(pixels[(at / 5 + 1) * 6 + at % 5 + 1]);
            assert!((found - expected).abs() < 1e-13, "{found} {expected}");
        }
    }
}
