//! View pixels → the vector that PCA sees, and the same operator turned around to fold it into the basis.
//!
//! x = H·B·n(y): contrast normalization n, Gaussian blur B (report table 3.2), and an optional high-pass H = I − G.
//! B and G are separable Gaussians; at the border the nearest pixel is repeated, so rows of B and G add up to one and a
//! flat view stays flat. For a basis vector e, e·x = (Bᵀ·Hᵀ·e)·n(y): [`Preprocess::fold`] computes that row.

use eigenmark_core::{atlas::Blur, eigenspace::Normalize};

/// A symmetric one-dimensional kernel, center first: weights at distance 0, 1, 2, …
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel(Vec<f64>);

/// What happens to the pixels of a view before PCA.
#[derive(Clone, Debug)]
pub struct Preprocess {
    side: usize,
    normalize: Normalize,
    blur: Kernel,
    highpass: Option<Kernel>,
}

impl Kernel {
    /// A normalized Gaussian of `radius` pixels to each side.
    #[must_use]
    pub fn gaussian(sigma: f64, radius: usize) -> Self {
        let raw: Vec<f64> = (0..=radius)
            .map(|d| (-((d * d) as f64) / (2.0 * sigma * sigma)).exp())
            .collect();
        let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
        Self(raw.iter().map(|weight| weight / sum).collect())
    }

    /// The kernel of a blur of table 3.2.
    #[must_use]
    pub fn of(blur: Blur) -> Self {
        match blur {
            Blur::None => Self(vec![1.0]),
            Blur::Gauss1 => Self::gaussian(0.48, 1),
            Blur::Gauss2 => Self::gaussian(0.65, 2),
            Blur::Gauss3 => Self::gaussian(0.76, 3),
        }
    }

    /// The square picture convolved with the kernel in both directions.
    fn apply(&self, picture: &[f64], side: usize) -> Vec<f64> {
        let mut horizontal = vec![0.0; picture.len()];
        let radius = self.0.len() - 1;
        let mut padded = vec![0.0; side + 2 * radius];
        for (row, out) in picture
            .chunks_exact(side)
            .zip(horizontal.chunks_exact_mut(side))
        {
            padded[..radius].fill(row[0]);
            padded[radius..radius + side].copy_from_slice(row);
            padded[radius + side..].fill(row[side - 1]);
            for (offset, weight) in self.taps() {
                add_scaled(out, weight, &padded[offset..]);
            }
        }
        let mut both = vec![0.0; picture.len()];
        for (target, out) in both.chunks_exact_mut(side).enumerate() {
            for (offset, weight) in self.taps() {
                let source = (target + offset).saturating_sub(radius).min(side - 1);
                add_scaled(out, weight, &horizontal[source * side..]);
            }
        }
        both
    }

    /// The transpose of [`apply`](Self::apply).
    fn apply_transposed(&self, picture: &[f64], side: usize) -> Vec<f64> {
        let radius = self.0.len() - 1;
        let mut vertical = vec![0.0; picture.len()];
        for (target, row) in picture.chunks_exact(side).enumerate() {
            for (offset, weight) in self.taps() {
                let source = (target + offset).saturating_sub(radius).min(side - 1);
                add_scaled(&mut vertical[source * side..][..side], weight, row);
            }
        }
        let mut both = vec![0.0; picture.len()];
        let mut padded = vec![0.0; side + 2 * radius];
        for (row, out) in vertical.chunks_exact(side).zip(both.chunks_exact_mut(side)) {
            padded.fill(0.0);
            for (offset, weight) in self.taps() {
                add_scaled(&mut padded[offset..offset + side], weight, row);
            }
            out.copy_from_slice(&padded[radius..radius + side]);
            out[0] += padded[..radius].iter().sum::<f64>();
            out[side - 1] += padded[radius + side..].iter().sum::<f64>();
        }
        both
    }

    /// The weights from the first tap to the last, each with its offset from the first.
    fn taps(&self) -> impl Iterator<Item = (usize, f64)> {
        let mirrored = self.0.iter().skip(1).rev();
        mirrored.chain(&self.0).copied().enumerate()
    }
}

/// `out` += `weight`·`row`, as far as `out` goes.
pub(super) fn add_scaled(out: &mut [f64], weight: f64, row: &[f64]) {
    for (out, x) in out.iter_mut().zip(row) {
        *out += weight * x;
    }
}

impl Preprocess {
    /// Preprocessing of views of `side`×`side` pixels. `highpass_sigma_px` is in view pixels; 0 means none.
    #[must_use]
    pub fn new(side: usize, normalize: Normalize, blur: Blur, highpass_sigma_px: f64) -> Self {
        let highpass = (highpass_sigma_px > 0.0).then(|| {
            let radius = ((3.0 * highpass_sigma_px).ceil() as usize).clamp(1, side);
            Kernel::gaussian(highpass_sigma_px, radius)
        });
        Self {
            side,
            normalize,
            blur: Kernel::of(blur),
            highpass,
        }
    }

    /// Contrast normalization, as the core's eigenspace does it. `None` for a flat view under [`Normalize::Std`].
    #[must_use]
    pub fn normalized(&self, pixels: &[u8]) -> Option<Vec<f64>> {
        let m = pixels.len() as f64;
        let mean = pixels.iter().map(|&y| f64::from(y)).sum::<f64>() / m;
        let variance = pixels
            .iter()
            .map(|&y| (f64::from(y) - mean).powi(2))
            .sum::<f64>()
            / m;
        let (offset, gain) = match self.normalize {
            Normalize::None => (0.0, 1.0),
            Normalize::Mean => (mean, 1.0),
            Normalize::Std if pixels.iter().all(|y| *y == pixels[0]) => return None,
            Normalize::Std => (mean, 1.0 / variance.sqrt()),
        };
        Some(
            pixels
                .iter()
                .map(|&y| (f64::from(y) - offset) * gain)
                .collect(),
        )
    }

    /// Blur and high-pass of a normalized view: what PCA sees.
    #[must_use]
    pub fn filtered(&self, normalized: &[f64]) -> Vec<f64> {
        let blurred = self.blur.apply(normalized, self.side);
        match &self.highpass {
            None => blurred,
            Some(kernel) => {
                let low = kernel.apply(&blurred, self.side);
                blurred
                    .iter()
                    .zip(low)
                    .map(|(all, low)| all - low)
                    .collect()
            }
        }
    }

    /// The row w with w·n(y) = row·x for every view y.
    #[must_use]
    pub fn fold(&self, row: &[f64]) -> Vec<f64> {
        let row = match &self.highpass {
            None => row.to_vec(),
            Some(kernel) => {
                let low = kernel.apply_transposed(row, self.side);
                row.iter().zip(low).map(|(all, low)| all - low).collect()
            }
        };
        let mut row = self.blur.apply_transposed(&row, self.side);
        if self.normalize != Normalize::None {
            // n(y) has mean zero, so the mean of the row can go: then w·y = w·(y − mean(y)).
            let mean = row.iter().sum::<f64>() / row.len() as f64;
            row.iter_mut().for_each(|weight| *weight -= mean);
        }
        row
    }

    /// Pixels per side of its views, v.
    #[must_use]
    pub fn side(&self) -> usize {
        self.side
    }

    /// The normalization of its views.
    #[must_use]
    pub fn normalize(&self) -> Normalize {
        self.normalize
    }

    /// Whether what PCA sees are gray levels: nothing is done but blur.
    #[must_use]
    pub fn keeps_levels(&self) -> bool {
        self.normalize == Normalize::None && self.highpass.is_none()
    }

    /// x of the pixels of a view, or `None` when it is flat and contrast is normalized.
    #[must_use]
    pub fn of_pixels(&self, pixels: &[u8]) -> Option<Vec<f64>> {
        self.normalized(pixels)
            .map(|normalized| self.filtered(&normalized))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sums of a hundred products of numbers up to 255.
    const TOLERANCE: f64 = 1e-9;

    fn pixels() -> Vec<u8> {
        (0..49_u32).map(|i| (i * i * 37 % 251) as u8).collect()
    }

    #[test]
    fn kernels_are_those_of_table_3_2() {
        // exp(−1/(2·0.48²)) = 0.11415; 1/(1 + 2·0.11415) = 0.81413.
        let Kernel(weights) = Kernel::of(Blur::Gauss1);
        assert!(
            (weights[0] - 0.814_13).abs() < 1e-4 && (weights[1] - 0.092_93).abs() < 1e-4,
            "{weights:?}"
        );
        for blur in [Blur::None, Blur::Gauss1, Blur::Gauss2, Blur::Gauss3] {
            let Kernel(weights) = Kernel::of(blur);
            assert!((weights[0] + 2.0 * weights[1..].iter().sum::<f64>() - 1.0).abs() < TOLERANCE);
        }
        assert_eq!(Kernel::of(Blur::Gauss3).0.len(), 4);
    }

    #[test]
    fn flat_views_stay_flat_under_blur_and_vanish_under_highpass() {
        let blur = Preprocess::new(7, Normalize::None, Blur::Gauss3, 0.0);
        assert!(
            blur.filtered(&[80.0; 49])
                .iter()
                .all(|x| (x - 80.0).abs() < TOLERANCE)
        );
        let highpass = Preprocess::new(7, Normalize::None, Blur::Gauss3, 2.0);
        assert!(
            highpass
                .filtered(&[80.0; 49])
                .iter()
                .all(|x| x.abs() < TOLERANCE)
        );
    }

    #[test]
    fn folding_gives_the_same_projection() {
        let row: Vec<f64> = (0..49)
            .map(|i| f64::from((i * 13 + 5) % 29) - 14.0)
            .collect();
        for normalize in [Normalize::None, Normalize::Mean, Normalize::Std] {
            for highpass in [0.0, 1.5] {
                let preprocess = Preprocess::new(7, normalize, Blur::Gauss2, highpass);
                let normalized = preprocess.normalized(&pixels()).expect("not flat");
                let x = preprocess.filtered(&normalized);
                let direct: f64 = row.iter().zip(&x).map(|(e, x)| e * x).sum();
                let folded: f64 = preprocess
                    .fold(&row)
                    .iter()
                    .zip(&normalized)
                    .map(|(w, n)| w * n)
                    .sum();
                assert!(
                    (direct - folded).abs() < TOLERANCE * 1e3,
                    "{normalize:?} {highpass}: {direct} {folded}"
                );
            }
        }
    }

    #[test]
    fn flat_views_have_no_unit_variance() {
        assert!(
            Preprocess::new(7, Normalize::Std, Blur::None, 0.0)
                .normalized(&[9; 49])
                .is_none()
        );
    }
}
