//! Interpolation of u ↦ ½·sech((u − v)/2), for any v, by a polynomial of as few nodes as a tolerance allows.
//!
//! **Method.** Chebyshev's polynomials T_q on an interval, its nodes the zeros of T_P. Mapped to [−1, 1], the kernel is
//! analytic inside the ellipse whose half axes are (ρ ± 1/ρ)/2 as long as the ellipse stays in the strip |Im u| ≤ y <
//! π, and there |½·sech(z/2)| ≤ M = ½/cos(y/2), because |cosh(x + iy)|² = sinh²x + cos²y. Then (Trefethen,
//! Approximation Theory and Approximation Practice, theorems 8.1 and 8.2) the interpolant of degree d is off by at most
//! 4·M·ρ^−d/(ρ − 1), and its q-th coefficient, aliases included, is at most 6·M·ρ^−q. y is chosen so that d is
//! smallest. All of this is linear: it holds for any sum of such kernels with weights of at most 1, divided by their
//! number.
//!
//! **Rounding.** [`Interpolation::rounding`] counts it.

use std::f64::consts::{FRAC_PI_2, PI};

/// Choices of y, evenly spaced in (0, π).
const STRIPS: u32 = 256;

/// Half the width of an interval is at least this, so that points of one norm have an interval.
const NARROWEST: f64 = 1.0 / 16.0;

/// The largest value of the kernel.
pub(super) const PEAK: f64 = 0.5;

/// An interval, and how the kernel is interpolated on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interpolation {
    middle: f64,
    half_width: f64,
    nodes: usize,
    /// ρ.
    ellipse: f64,
    /// M.
    bound: f64,
}

impl Interpolation {
    /// The one of fewest nodes with a [`truncation`](Self::truncation) of at most `tolerance` on [low, high], if it
    /// needs at most `most` nodes.
    pub(super) fn of_kernel(low: f64, high: f64, tolerance: f64, most: usize) -> Option<Self> {
        let half_width = ((high - low) / 2.0).max(NARROWEST);
        (1..STRIPS)
            .map(|step| {
                let strip = PI * f64::from(step) / f64::from(STRIPS);
                let axis = strip / half_width;
                let ellipse = axis + (axis * axis + 1.0).sqrt();
                let bound = PEAK / (strip / 2.0).cos();
                let degree = (4.0 * bound / ((ellipse - 1.0) * tolerance)).ln() / ellipse.ln();
                Self {
                    middle: low + (high - low) / 2.0,
                    half_width,
                    nodes: degree.ceil().max(1.0) as usize + 1,
                    ellipse,
                    bound,
                }
            })
            .min_by_key(|interpolation| interpolation.nodes)
            .filter(|interpolation| interpolation.nodes <= most)
    }

    /// P, the number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.nodes
    }

    /// Where node `index` is.
    pub(super) fn node(&self, index: usize) -> f64 {
        self.middle + self.half_width * self.cosine(2 * index + 1)
    }

    /// The coefficients of T_0 … T_{P−1} from values at the nodes; `values` has one row of `width` numbers per node,
    /// and so has what is returned per coefficient.
    pub(super) fn coefficients(&self, values: &[f64], width: usize) -> Vec<f64> {
        let mut coefficients = vec![0.0; values.len()];
        for (degree, row) in coefficients.chunks_exact_mut(width).enumerate() {
            let share = if degree == 0 { 1.0 } else { 2.0 } / self.nodes as f64;
            for (node, values) in values.chunks_exact(width).enumerate() {
                let weight = share * self.cosine(degree * (2 * node + 1));
                for (coefficient, value) in row.iter_mut().zip(values) {
                    *coefficient += weight * value;
                }
            }
        }
        coefficients
    }

    /// T_0 … T_{P−1} at `position`, which lies in the interval up to rounding.
    pub(super) fn polynomials(&self, position: f64, out: &mut [f64]) {
        let t = ((position - self.middle) / self.half_width).clamp(-1.0, 1.0);
        let (mut before, mut last) = (t, 1.0);
        for value in out {
            *value = last;
            (before, last) = (last, 2.0 * t * last - before);
        }
    }

    /// How far the interpolant can be from the kernel.
    pub(super) fn truncation(&self) -> f64 {
        4.0 * self.bound * self.ellipse.powf(1.0 - self.nodes as f64) / (self.ellipse - 1.0)
    }

    /// How many u the interpolant is off when values at the nodes are off by `of_values`, those of k dimensions are
    /// summed up to a product in the end, and positions by `of_positions`.
    ///
    /// Values act by the Lebesgue constant, up to 1 + 2/π·ln P. A coefficient has P terms, and its cosines are off by
    /// 14. The recurrence makes 3 in a step, which grows as |U_j| ≤ j + 1 to 3·q(q+1)/2 in T_q. The slope of the kernel
    /// is at most ⅛; a node is as far off as a position.
    pub(super) fn rounding(&self, of_values: f64, of_positions: f64, dimensions: usize) -> f64 {
        let nodes = self.nodes as f64;
        let lebesgue = 1.0 + nodes.ln() / FRAC_PI_2;
        let (mut sizes, mut recurrences) = (0.0, 0.0);
        for degree in 0..self.nodes {
            let size = (6.0 * self.bound * self.ellipse.powi(-(degree as i32))).min(2.0 * PEAK);
            sizes += size;
            recurrences += size * 1.5 * (degree * (degree + 1)) as f64;
        }
        let location = of_positions + self.middle.abs() + 4.0 * self.half_width + 4.0;
        lebesgue * (of_values + location / 8.0)
            + location / 8.0
            + 2.0 * PEAK * nodes * (nodes + 16.0)
            + recurrences
            + (nodes + dimensions as f64 + 4.0) * sizes
    }

    /// cos(numerator·π/(2P)).
    fn cosine(&self, numerator: usize) -> f64 {
        let turn = 4 * self.nodes;
        ((numerator % turn) as f64 * FRAC_PI_2 / self.nodes as f64).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kernel(u: f64, v: f64) -> f64 {
        PEAK / ((u - v) / 2.0).cosh()
    }

    fn largest_error(interpolation: &Interpolation, low: f64, high: f64) -> f64 {
        let at = |step: i32| low + (high - low) * f64::from(step) / 40.0;
        let mut largest = 0.0_f64;
        for v in (0..=40).map(at) {
            let values: Vec<f64> = (0..interpolation.nodes())
                .map(|index| kernel(interpolation.node(index), v))
                .collect();
            let coefficients = interpolation.coefficients(&values, 1);
            let mut polynomials = vec![0.0; interpolation.nodes()];
            for u in (0..=40).map(at) {
                interpolation.polynomials(u, &mut polynomials);
                let pairs = coefficients.iter().zip(&polynomials);
                let found: f64 = pairs.map(|(c, t)| c * t).sum();
                largest = largest.max((found - kernel(u, v)).abs());
            }
        }
        largest
    }

    #[test]
    fn the_kernel_is_interpolated_within_its_bounds() {
        for (low, high) in [(0.0, 0.0), (-2.3, 2.3), (10.0, 24.0), (-60.0, 5.0)] {
            for tolerance in [1e-3, 1e-7, 1e-13] {
                let found = Interpolation::of_kernel(low, high, tolerance, 1000);
                let found = found.expect("a thousand nodes are enough");
                assert!(found.truncation() <= tolerance);
                let bound = found.truncation() + found.rounding(4.0, 4.0, 1) * f64::EPSILON / 2.0;
                let error = largest_error(&found, low, high);
                assert!(error <= bound, "{low}…{high} {tolerance}: {error} {bound}");
            }
        }
    }

    #[test]
    fn nodes_follow_the_width_and_have_a_limit() {
        let nodes = |width: f64| {
            let found = Interpolation::of_kernel(0.0, width, 1e-13, 1000);
            found.expect("a thousand nodes are enough").nodes()
        };
        assert!(nodes(1.0) < nodes(5.0) && nodes(5.0) < nodes(50.0));
        assert!(Interpolation::of_kernel(0.0, 50.0, 1e-13, nodes(50.0) - 1).is_none());
    }
}
