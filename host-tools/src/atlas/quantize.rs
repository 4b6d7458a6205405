//! From an eigenspace in f64 to the integers that fly.
//!
//! Each basis row is whitened, turned through blur and high-pass onto the pixels ([`PixelBasis`]), and scaled so
//! that its largest weight uses 16 bits while 255·Σ|w| stays below 2³¹. Coefficients share one step, so that distances
//! are computed in integers; the step is chosen so that the largest coordinate any view can have fits, or
//! [`HEADROOM`] times the largest that a candidate has when that is less.
//!
//! What this costs is bounded row by row, over *all* views and not only those at hand: rounding of weights
//! (255·max(Σδ⁺, Σδ⁻), or √m·‖δ‖ for unit variance), rounding to whole steps, and single precision, on board and of
//! the vectors that were learned from.
//! [`Folded::error`] is the Euclidean length of those bounds.

use eigenmark_core::{
    atlas::{AtlasError, Contents, Header, Likelihood, Limits, Training},
    eigenspace::{
        Coefficients, MeanRow, Normalize, Row, padded_pixels, weight_count, weight_index,
    },
    landmark::{Metric, Record, Width},
};

use super::AtlasBuffer;
use crate::{
    learn::{Candidates, Model, PixelBasis, Settings},
    map::Map,
};

/// How much larger than any candidate's a coordinate may be before it is clamped, per width.
const HEADROOM: fn(Width) -> f64 = |width| match width {
    Width::I16 => 4.0,
    Width::I8 => 1.25, // 127 steps must also resolve neighbours
};

/// Roundings of single precision per coefficient, each at most 2⁻²⁴ of the magnitudes involved, with room to spare.
const FLOAT_ROUNDING: f64 = 16.0 / (1 << 24) as f64;

/// Rounding of a number of a vector to single precision, relative to it.
const VECTOR_ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// A quantized eigenspace, not yet bound to landmarks.
#[derive(Clone, Debug)]
pub struct Folded {
    side: u8,
    dimensions: u8,
    normalize: Normalize,
    metric: Metric,
    width: Width,
    step: f64,
    weights: Vec<i16>,
    rows: Vec<Row>,
    mean: MeanRow,
    mean_weights: Vec<i8>,
    error: f64,
}

/// One basis row on the pixels, in f64, and the range of its coordinate over all views.
struct PixelRow<'a> {
    weights: &'a [f64],
    offset: f64,
    whitening: f64,
    largest: f64,
}

/// Integers near `factor` times a row of weights.
struct Rounded {
    weights: Vec<i32>,
    factor: f64,
}

impl Folded {
    /// Quantizes `model`, whose candidates have these whitened `coordinates` (rows of k).
    #[must_use]
    pub fn new(
        model: &Model,
        coordinates: &[f64],
        candidates: &Candidates,
        settings: &Settings,
    ) -> Self {
        let side = settings.view_side() as u8;
        let dimensions = settings.dimensions;
        let normalize = settings.normalize;
        let basis = PixelBasis::new(model, candidates.preprocess(), settings.whiten);
        let pixel_rows: Vec<PixelRow> = basis
            .rows()
            .zip(basis.offsets())
            .zip(model.whitening(settings.whiten))
            .map(|((weights, &offset), whitening)| {
                PixelRow::new(weights, offset, whitening, normalize)
            })
            .collect();

        let reachable = pixel_rows.iter().map(|row| row.largest).fold(0.0, f64::max);
        let seen = coordinates
            .iter()
            .fold(0.0_f64, |largest, g| largest.max(g.abs()));
        let limit = f64::from(settings.width.limit(dimensions));
        // In f32 already here: everything below must use the step that flies.
        let step = f64::from((reachable.min(HEADROOM(settings.width) * seen) / limit) as f32);

        let mut weights = vec![0; weight_count(side, dimensions)];
        let (mut rows, mut squared_error) = (Vec::new(), 0.0);
        for (pixel_row, r) in pixel_rows.iter().zip(0..) {
            let rounded = Rounded::to_i16(pixel_row.weights, normalize != Normalize::None);
            for (&weight, pixel) in rounded.weights.iter().zip(0..) {
                weights[weight_index(side, r, pixel)] = weight as i16;
            }
            rows.push(Row {
                scale: (1.0 / (rounded.factor * step)) as f32,
                offset: (pixel_row.offset / step) as f32,
                spread: (step / pixel_row.whitening) as f32,
            });
            squared_error += (pixel_row.error(&rounded, normalize) + step / 2.0).powi(2);
        }
        let (mean, mean_weights) = mean_row(&candidates.normalized_mean(), side, normalize);
        Self {
            side,
            dimensions,
            normalize,
            metric: settings.metric,
            width: settings.width,
            step,
            weights,
            rows,
            mean,
            mean_weights,
            error: squared_error.sqrt(),
        }
    }

    /// How far the coordinates of a view on board are from those in f64, at most, in (whitened) eigenspace units;
    /// clamped views excepted.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }

    /// The atlas of some landmarks. Nothing is known yet: the limits admit every view.
    ///
    /// # Errors
    /// What the core has against it; only the number of landmarks can be too large.
    pub fn atlas(
        &self,
        map: &Map,
        candidates: &Candidates,
        landmarks: &[u32],
        radii: &[f32],
        training: Training,
    ) -> Result<AtlasBuffer, AtlasError> {
        let records: Vec<Record> = landmarks
            .iter()
            .zip(radii)
            .map(|(&view, &radius)| Record { view, radius })
            .collect();
        let unlimited = Limits {
            distance: f32::MAX,
            from_feature_space: f32::MAX,
        };
        let mut header = Header {
            view_side: self.side,
            dimensions: self.dimensions,
            landmarks: 1,
            width: self.width,
            thumbnail_side: 0,
            normalize: self.normalize,
            metric: self.metric,
            step: self.step as f32,
            error: ((self.error / self.step) as f32).next_up(),
            limits: unlimited,
            mean: self.mean,
            footprint_px: candidates.grid().window_px() as f32,
            map_px: (map.width(), map.height()),
            survey: candidates.grid().survey().clone(),
            likelihood: Likelihood {
                sharpness: 1.0,
                ceiling: f32::MAX,
            },
            places: 0,
            legs: 0,
            training,
        };

        // A landmark stores what the board itself computes from its view: its own window is at distance zero.
        let zeros = vec![0; usize::from(self.dimensions)];
        let probe = AtlasBuffer::emit(&self.contents(&header, &zeros, &records[..1]))?;
        let atlas = probe.atlas();
        let mut coefficients = Vec::with_capacity(landmarks.len() * zeros.len());
        let mut projected = Coefficients::zeros(self.dimensions);
        for &view in landmarks {
            // Views too large for a board, and flat ones, were refused when the candidates were laid out.
            let view = candidates.view(view);
            let projection =
                view.and_then(|view| atlas.eigenspace().project(&view, &mut projected));
            debug_assert!(projection.is_some());
            coefficients.extend_from_slice(projected.values());
        }
        header.landmarks = landmarks.len() as u32;
        AtlasBuffer::emit(&self.contents(&header, &coefficients, &records))
    }

    fn contents<'a>(
        &'a self,
        header: &'a Header,
        coefficients: &'a [i16],
        records: &'a [Record],
    ) -> Contents<'a> {
        Contents {
            header,
            weights: &self.weights,
            rows: &self.rows,
            mean_weights: &self.mean_weights,
            coefficients,
            records,
            thumbnails: &[],
            places: &[],
            legs: &[],
        }
    }
}

impl<'a> PixelRow<'a> {
    fn new(weights: &'a [f64], offset: f64, whitening: f64, normalize: Normalize) -> Self {
        let largest = match normalize {
            Normalize::Std => (weights.len() as f64).sqrt() * norm(weights) + offset.abs(),
            // Under `Mean` the weights add up to zero, so n(y) may be replaced by y.
            Normalize::None | Normalize::Mean => {
                let (above, below) = signed_sums(weights.iter().copied());
                (255.0 * above - offset)
                    .abs()
                    .max((-255.0 * below - offset).abs())
            }
        };
        Self {
            weights,
            offset,
            whitening,
            largest,
        }
    }

    /// Largest difference between the coordinate from rounded weights in single precision and the exact one.
    fn error(&self, rounded: &Rounded, normalize: Normalize) -> f64 {
        let deltas: Vec<f64> = rounded
            .weights
            .iter()
            .zip(self.weights)
            .map(|(&integer, exact)| f64::from(integer) / rounded.factor - exact)
            .collect();
        let of_weights = match normalize {
            Normalize::Std => (deltas.len() as f64).sqrt() * norm(&deltas),
            Normalize::None | Normalize::Mean => {
                let (above, below) = signed_sums(deltas.into_iter());
                255.0 * above.max(below)
            }
        };
        let range = match normalize {
            Normalize::Std => 1.0,
            Normalize::None | Normalize::Mean => 255.0,
        };
        // ‖x‖ ≤ 2·range·√m: a high-pass at most doubles what averaging left.
        let of_vectors =
            self.whitening * VECTOR_ROUNDING * 2.0 * range * (self.weights.len() as f64).sqrt();
        of_weights + of_vectors + FLOAT_ROUNDING * (self.largest + 2.0 * self.offset.abs())
    }
}

impl Rounded {
    /// 16-bit weights with 255·Σ|w| < 2³¹; with `balance` they add up to zero.
    fn to_i16(weights: &[f64], balance: bool) -> Self {
        let magnitude: f64 = weights.iter().map(|w| w.abs()).sum();
        // Rounding, and balancing, add at most one to each weight.
        let room = f64::from(i32::MAX) / 255.0 - weights.len() as f64 * 2.0;
        let factor = (f64::from(i16::MAX - 1) / largest(weights)).min(room / magnitude);
        Self::new(weights, factor, balance)
    }

    /// 8-bit weights; with `balance` they add up to zero.
    fn to_i8(weights: &[f64], balance: bool) -> Self {
        Self::new(weights, f64::from(i8::MAX - 1) / largest(weights), balance)
    }

    fn new(weights: &[f64], factor: f64, balance: bool) -> Self {
        let exact: Vec<f64> = weights.iter().map(|weight| weight * factor).collect();
        let mut rounded: Vec<i32> = exact.iter().map(|weight| weight.round() as i32).collect();
        if balance {
            // Move the weights by one that were rounded furthest the other way, each at most once.
            let surplus: i32 = rounded.iter().sum();
            let mut order: Vec<usize> = (0..rounded.len()).collect();
            let direction = f64::from(surplus.signum());
            order.sort_by(|&a, &b| {
                let moved = |i: usize| direction * (f64::from(rounded[i]) - exact[i]);
                moved(b).total_cmp(&moved(a))
            });
            for &i in &order[..surplus.unsigned_abs() as usize] {
                rounded[i] -= surplus.signum();
            }
        }
        Self {
            weights: rounded,
            factor,
        }
    }
}

/// The mean of the normalized views as one gray level and 8-bit weights around it.
fn mean_row(mean: &[f64], side: u8, normalize: Normalize) -> (MeanRow, Vec<i8>) {
    let is_balanced = normalize != Normalize::None;
    let base = if is_balanced {
        0.0
    } else {
        mean.iter().sum::<f64>() / mean.len() as f64
    };
    let around: Vec<f64> = mean.iter().map(|level| level - base).collect();
    let rounded = Rounded::to_i8(&around, is_balanced);
    let mut weights = vec![0; padded_pixels(side)];
    for (&weight, pixel) in rounded.weights.iter().zip(0..) {
        weights[pixel] = weight as i8;
    }
    let energy = mean.iter().map(|level| level * level).sum::<f64>() as f32;
    (
        MeanRow {
            base: base as f32,
            scale: (1.0 / rounded.factor) as f32,
            energy,
        },
        weights,
    )
}

/// Largest magnitude; never zero, so that it can be divided by.
fn largest(weights: &[f64]) -> f64 {
    weights
        .iter()
        .fold(f64::from(f32::MIN_POSITIVE), |largest, w| {
            largest.max(w.abs())
        })
}

fn norm(weights: &[f64]) -> f64 {
    weights.iter().map(|w| w * w).sum::<f64>().sqrt()
}

/// Sum of the positive numbers, and of the magnitudes of the negative ones.
fn signed_sums(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((0.0, 0.0), |(above, below), x| {
        (above + x.max(0.0), below + (-x).max(0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balanced_weights_add_up_to_zero_and_move_by_at_most_one() {
        let weights: Vec<f64> = (0..400)
            .map(|i| f64::from((i * 7919) % 1009) / 1009.0 - 0.4995)
            .collect();
        let mean = weights.iter().sum::<f64>() / 400.0;
        let weights: Vec<f64> = weights.iter().map(|w| w - mean).collect();
        for rounded in [
            Rounded::to_i16(&weights, true),
            Rounded::to_i8(&weights, true),
        ] {
            assert_eq!(rounded.weights.iter().sum::<i32>(), 0);
            for (&integer, exact) in rounded.weights.iter().zip(&weights) {
                assert!((f64::from(integer) - exact * rounded.factor).abs() <= 1.5);
            }
        }
    }

    #[test]
    fn long_rows_leave_room_in_the_accumulator() {
        let rounded = Rounded::to_i16(&vec![1.0; 2500], false);
        let magnitude: i64 = rounded.weights.iter().map(|&w| i64::from(w.abs())).sum();
        assert!(magnitude * 255 < 1 << 31);
        assert!(magnitude * 255 > 1 << 30, "the room is used");
    }
}
