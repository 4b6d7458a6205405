//! The profile of nSSD without comparing pairs.
//!
//! **Method.** nSSD(a, b) = ½ − a·b/(A + B). With u = ln A, v = ln B and unit vectors â, b̂ that is ½ − â·b̂·½·sech((u
//! − v)/2): the pair enters through a smooth function of u − v alone. So a·Σ_b b/(A + B) = â·F(u) with F(u) = Σ_b
//! b̂·½·sech((u − v_b)/2), k functions of one number, which are computed at P nodes and interpolated in between
//! ([`super::chebyshev`], bounds included). At the node u = ln X a term is b·√X/(X + B): no logarithm, no exponential.
//! Points that are zero are taken out: nSSD(0, b) = ½, and 0 when b is zero too.
//!
//! Only u is interpolated. Interpolating v as well, by moments Σ_b T_q(v_b)·b̂, would multiply the bound by the
//! Lebesgue constant and spare no product.
//!
//! **Rounding.** Values at a node: B by k, quotient, product and root by 5, sums over [`CHUNK`] points and over chunks.
//! Positions: ln A by k and one rounding of its own. All in u, of values of at most ½ per point.
//!
//! **Cost.** 2·P·n·k multiply-adds by matrix products, and P·n quotients; P·k numbers per [`CHUNK`] points, so never
//! more than the points themselves, and n numbers a few times.
//!
//! **Limits.** More than [`MOST_NODES`] nodes are not worth it: where norms differ by more than a factor of 10¹⁸ or so.

use faer::{Accum, Mat, MatMut, MatRef, Par, linalg::matmul::matmul};
use rayon::prelude::*;

use super::{
    Averages, HIGHER_ORDERS, ROUNDING,
    chebyshev::{Interpolation, PEAK},
    literal,
    points::Points,
};
use crate::select::Dissimilarity;

/// What interpolation may change in a profile value: a tenth of the rounding of a literal sum of 10,000 points.
const TRUNCATION: f64 = 1e-13;

/// See **Limits**.
const MOST_NODES: usize = 512;

/// Points that one thread takes at a time. Partial sums are added in order.
const CHUNK: usize = 512;

/// The profile of [`Dissimilarity::Nssd`]; none where the norms differ too much.
pub(super) fn averages(points: Points<'_>) -> Option<Averages> {
    let norms = points.squared_norms();
    let nonzero = norms.iter().filter(|norm| **norm > 0.0);
    let (low, high, count) = nonzero.fold(
        (f64::INFINITY, 0.0_f64, 0_usize),
        |(low, high, count), &norm| (low.min(norm), high.max(norm), count + 1),
    );
    let (low, high) = if count == 0 {
        (0.0, 0.0)
    } else {
        (low.ln(), high.ln())
    };
    let interpolation = Interpolation::of_kernel(low, high, TRUNCATION, MOST_NODES)?;
    let coefficients = coefficients(points, &norms, &interpolation);
    let products = products(points, &norms, &interpolation, &coefficients);
    let own = own_error(points, &interpolation, low.abs().max(high.abs()));
    let half_of_all = 0.5 * points.count() as f64;
    let (values, errors) = norms
        .iter()
        .zip(products)
        .map(|(&norm, product)| {
            let sum = if norm > 0.0 {
                (half_of_all - product).max(0.0)
            } else {
                0.5 * count as f64
            };
            let value = sum / points.others();
            let error = own + literal::error(Dissimilarity::Nssd, points, value + own);
            (value, error)
        })
        .unzip();
    Some(Averages { values, errors })
}

/// F at the nodes, as coefficients of Chebyshev's polynomials: P rows of k.
fn coefficients(points: Points<'_>, norms: &[f64], interpolation: &Interpolation) -> Vec<f64> {
    let (dimensions, nodes) = (points.dimensions(), interpolation.nodes());
    let squares: Vec<f64> = (0..nodes)
        .map(|index| interpolation.node(index).exp())
        .collect();
    let partial: Vec<Mat<f64>> = points
        .values()
        .par_chunks(CHUNK * dimensions)
        .zip(norms.par_chunks(CHUNK))
        .map(|(values, norms)| {
            let mut weights = Mat::<f64>::zeros(norms.len(), nodes);
            for (node, square) in squares.iter().enumerate() {
                let root = square.sqrt();
                let weights = weights.col_as_slice_mut(node).iter_mut();
                for (weight, norm) in weights.zip(norms) {
                    *weight = root / (square + norm);
                }
            }
            let mut sums = Mat::<f64>::zeros(dimensions, nodes);
            matmul(
                sums.as_mut(),
                Accum::Replace,
                MatRef::from_column_major_slice(values, dimensions, norms.len()),
                weights.as_ref(),
                1.0,
                Par::Seq,
            );
            sums
        })
        .collect();
    let mut values = vec![0.0; nodes * dimensions];
    for sums in &partial {
        for (node, values) in values.chunks_exact_mut(dimensions).enumerate() {
            let sums = sums.col_as_slice(node).iter();
            values.iter_mut().zip(sums).for_each(|(x, sum)| *x += sum);
        }
    }
    interpolation.coefficients(&values, dimensions)
}

/// â·F(ln A) of every point; anything where A is zero.
fn products(
    points: Points<'_>,
    norms: &[f64],
    interpolation: &Interpolation,
    coefficients: &[f64],
) -> Vec<f64> {
    let (dimensions, nodes) = (points.dimensions(), interpolation.nodes());
    let coefficients = MatRef::from_column_major_slice(coefficients, dimensions, nodes);
    points
        .values()
        .par_chunks(CHUNK * dimensions)
        .zip(norms.par_chunks(CHUNK))
        .flat_map_iter(|(values, norms)| {
            let mut polynomials = vec![0.0; nodes * norms.len()];
            for (&norm, out) in norms.iter().zip(polynomials.chunks_exact_mut(nodes)) {
                if norm > 0.0 {
                    interpolation.polynomials(norm.ln(), out);
                }
            }
            let mut sums = vec![0.0; dimensions * norms.len()];
            matmul(
                MatMut::from_column_major_slice_mut(&mut sums, dimensions, norms.len()),
                Accum::Replace,
                coefficients,
                MatRef::from_column_major_slice(&polynomials, nodes, norms.len()),
                1.0,
                Par::Seq,
            );
            let rows = values.chunks_exact(dimensions);
            let each = rows.zip(sums.chunks_exact(dimensions)).zip(norms);
            each.map(|((a, sum), norm)| {
                let product: f64 = a.iter().zip(sum).map(|(a, sum)| a * sum).sum();
                product / norm.sqrt()
            })
            .collect::<Vec<f64>>()
        })
        .collect()
}

/// How far a value can be from the exact one, `largest` being the largest |ln A|.
fn own_error(points: Points<'_>, interpolation: &Interpolation, largest: f64) -> f64 {
    let (count, k) = (points.count() as f64, points.dimensions() as f64);
    let chunk = count.min(CHUNK as f64);
    let of_values = PEAK * (k + 6.0 + chunk + count / CHUNK as f64);
    let of_positions = 2.0 * largest + k + 2.0;
    let interpolated = interpolation.rounding(of_values, of_positions, points.dimensions());
    // The unit vector, ½·n less the sum, and the quotient.
    let rest = k + 8.0;
    let rounding = HIGHER_ORDERS * ROUNDING * (interpolated + rest);
    (interpolation.truncation() + rounding) * count / points.others()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_and_orthogonal_points_are_averaged_by_hand() {
        // nSSD is 1 of opposite points, ½ of orthogonal ones, and 1/10 of (1, 0) and (2, 0).
        let points = [1.0, 0.0, -1.0, 0.0, 0.0, 3.0, 2.0, 0.0];
        let found = averages(Points::new(&points, 2)).expect("norms differ by three");
        let opposite_of_two = 9.0 / 10.0;
        let expected = [
            (1.0 + 0.5 + 0.1) / 3.0,
            (1.0 + 0.5 + opposite_of_two) / 3.0,
            0.5,
            (0.1 + opposite_of_two + 0.5) / 3.0,
        ];
        for ((found, error), expected) in found.values.iter().zip(&found.errors).zip(expected) {
            assert!((found - expected).abs() <= *error, "{found} {expected}");
        }
    }

    #[test]
    fn the_bound_stays_below_what_tells_candidates_apart() {
        let points: Vec<f64> = (0..4000).map(|x| (f64::from(x) * 0.37).sin()).collect();
        let found = averages(Points::new(&points, 4)).expect("norms are alike");
        // A thousand values between 0 and 1 are 1e-3 apart in the mean.
        assert!(found.errors.iter().all(|error| *error < 1e-11));
    }
}
