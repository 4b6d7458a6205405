//! Eigenvalues and eigenvectors of a diagonal matrix plus a rank-one one: all that an update's eigenproblem is.
//!
//! **What.** D = diag(d) + v·vᵀ. Report (2.26), corrected, has this form: d = n/(n+1)·[λ; 0], v = √n/(n+1)·[g; γ].
//!
//! **Method.** The eigenvalues are the roots of the secular equation f(μ) = 1 + Σ v_j²/(d_j − μ) = 0, one above each
//! pole d_i and below the next (Golub 1973). Each is kept as an offset τ from the nearer of its two poles, found by
//! bisection over the bits of τ: no starting value, no tolerance, at most 31 evaluations, one per bit. Differences
//! d_j − μ_i = (d_j − d_origin) − τ are then accurate however close the poles are. The eigenvectors are those of the
//! rank-one matrix that has exactly the computed roots (Gu and Eisenstat 1995), so they are orthogonal to rounding
//! whatever the roots' errors are. Deviations:
//! 1. Poles that are equal, or closer than [`MIN_GAP`], are moved apart by that much instead of being rotated into
//!    each other.
//! 2. A pole whose v_i is negligible ([`MIN_WEIGHT`]) keeps its eigenvalue and a unit vector.
//!
//! Small eigenvalues keep their relative accuracy, see the test `small_eigenvalues_keep_their_accuracy`. A solver for
//! general symmetric matrices errs by rounding of the *largest* eigenvalue, in every update anew.
//!
//! **Cost.** 62,000 instructions for 16×16 on a Cortex-M4F when all take part, most of them in the bisections.
//!
//! **Limits.** Eigenvalues below 2⁻⁴⁸ of ‖D‖ are kept apart from each other rather than told apart.

use nalgebra::SMatrix;

use crate::math::sqrt;

/// Weights v_i² below this share of ‖D‖ are left out: 2⁻⁵⁴, the square of 2⁻²⁷. Rounding of a coordinate is 2⁻²⁴.
const MIN_WEIGHT: f32 = 1.0 / (1_u64 << 54) as f32;

/// The smallest distance of two poles, relative to the lower: two units in the last place.
const MIN_RELATIVE_GAP: f32 = 2.0 * f32::EPSILON;

/// The smallest distance of two poles as a share of ‖D‖: 2⁻⁴⁸, the square of rounding.
const MIN_GAP: f32 = 1.0 / (1_u64 << 48) as f32;

/// Where poles are that do not take part, at weight 0: beyond every root, which is below 4 when ‖D‖ is below 2.
const BEYOND: f32 = 8.0;

/// Eigenvalues, descending, and the eigenvectors as columns in the same order.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigen<const N: usize> {
    pub values: [f32; N],
    pub vectors: SMatrix<f32, N, N>,
}

/// Decomposes diag(`poles`) + `vector`·`vector`ᵀ. Poles are finite, not negative, and descend.
///
/// An eigenvector's component along the pole just below its eigenvalue is not negative.
#[inline(never)]
pub fn decompose<const N: usize>(poles: &[f32; N], vector: &[f32; N]) -> Eigen<N> {
    let mut eigen = Eigen {
        values: *poles,
        vectors: SMatrix::identity(),
    };
    let norm =
        poles.iter().copied().fold(0.0, f32::max) + vector.iter().map(|v| v * v).sum::<f32>();
    // A power of two: scaling by it does not round.
    let scale = f32::from_bits(norm.to_bits() & f32::INFINITY.to_bits());
    if scale <= 0.0 {
        return eigen;
    }
    let secular = Secular::new(poles, vector, scale.recip());
    let index = secular.index.get(..secular.len).unwrap_or_default();
    let poles = secular.poles.get(..secular.len).unwrap_or_default();
    let mut roots = [Root::default(); N];
    let roots = roots.get_mut(..secular.len).unwrap_or_default();
    for (i, root) in roots.iter_mut().enumerate() {
        *root = secular.root(i);
    }
    let roots = &*roots;

    // The vector whose rank-one matrix has exactly these roots; its signs are those of the given one.
    let mut exact = [0.0; N];
    let targets = poles.iter().zip(&mut exact).zip(index);
    for (j, ((&own, target), &at)) in targets.enumerate() {
        let mut square = 1.0;
        for (i, (&pole, root)) in poles.iter().zip(roots).enumerate() {
            let to_root = root.difference(own);
            square *= if i == j {
                to_root
            } else {
                to_root / (own - pole)
            };
        }
        *target = sqrt(square.abs());
        if vector.get(at).is_some_and(|&component| component < 0.0) {
            *target = -*target;
        }
    }

    for (i, (root, &at)) in roots.iter().zip(index).enumerate() {
        let mut column = [0.0; N];
        let mut square = 0.0;
        for ((value, &pole), &component) in column.iter_mut().zip(poles).zip(&exact) {
            // Times the offset: the quotient is at most 1, so nothing overflows.
            *value = component * (root.offset / root.difference(pole));
            square += *value * *value;
        }
        let length = if column.get(i).is_some_and(|&component| component < 0.0) {
            -sqrt(square)
        } else {
            sqrt(square)
        };
        for (value, &row) in column.iter().zip(index) {
            if let Some(component) = eigen.vectors.get_mut((row, at)) {
                *component = value / length;
            }
        }
        if let Some(eigenvalue) = eigen.values.get_mut(at) {
            *eigenvalue = (root.pole + root.offset) * scale;
        }
    }
    eigen.sort();
    eigen
}

/// The secular equation of the poles that take part, scaled to ‖D‖ between 1 and 2.
struct Secular<const N: usize> {
    len: usize,
    /// Where each of them stands in the matrix.
    index: [usize; N],
    poles: [f32; N],
    weights: [f32; N],
}

/// An eigenvalue: an offset from a pole.
#[derive(Clone, Copy, Default)]
struct Root {
    pole: f32,
    offset: f32,
}

impl<const N: usize> Secular<N> {
    fn new(poles: &[f32; N], vector: &[f32; N], scale: f32) -> Self {
        let mut secular = Self {
            len: 0,
            index: [0; N],
            poles: [BEYOND; N],
            weights: [0.0; N],
        };
        let targets = secular.index.iter_mut().zip(&mut secular.poles);
        let mut targets = targets.zip(&mut secular.weights);
        for (i, (pole, v)) in poles.iter().zip(vector).enumerate() {
            let weight = v * v * scale;
            if weight >= MIN_WEIGHT
                && let Some(target) = targets.next()
            {
                let ((index, scaled), weights) = target;
                (*index, *scaled, *weights) = (i, pole * scale, weight);
                secular.len += 1;
            }
        }
        let mut least = 0.0;
        let taken = secular.poles.get_mut(..secular.len).unwrap_or_default();
        for pole in taken.iter_mut().rev() {
            *pole = pole.max(least);
            least = *pole + (*pole * MIN_RELATIVE_GAP).max(MIN_GAP);
        }
        secular
    }

    /// The root above pole `i`.
    fn root(&self, i: usize) -> Root {
        let pole = self.pole(i);
        let (origin, limit) = match i.checked_sub(1) {
            None => (i, self.weights.iter().sum()),
            Some(above) => {
                let half = 0.5 * (self.pole(above) - pole);
                let is_lower_half = self.value(&self.offsets_from(i), half) >= 0.0;
                (if is_lower_half { i } else { above }, half)
            }
        };
        let poles = self.offsets_from(origin);
        let sign = if origin == i { 1.0 } else { -1.0 };
        let (mut near, mut far) = (0, f32::to_bits(limit));
        while far - near > 1 {
            let middle = near + (far - near) / 2;
            // f rises from −∞ to ∞ between two poles: its sign says on which side of the root a point is.
            if self.value(&poles, sign * f32::from_bits(middle)) * sign < 0.0 {
                near = middle;
            } else {
                far = middle;
            }
        }
        Root {
            pole: self.pole(origin),
            offset: sign * f32::from_bits(far),
        }
    }

    fn pole(&self, i: usize) -> f32 {
        self.poles.get(i).copied().unwrap_or(BEYOND)
    }

    /// The poles as offsets from one of them.
    fn offsets_from(&self, origin: usize) -> [f32; N] {
        let from = self.pole(origin);
        self.poles.map(|pole| pole - from)
    }

    /// f at `offset` from the pole that `poles` are offsets from.
    fn value(&self, poles: &[f32; N], offset: f32) -> f32 {
        let mut sum = 1.0;
        for (pole, weight) in poles.iter().zip(&self.weights) {
            sum += weight / (pole - offset);
        }
        sum
    }
}

impl Root {
    /// `pole` minus this root.
    fn difference(self, pole: f32) -> f32 {
        (pole - self.pole) - self.offset
    }
}

impl<const N: usize> Eigen<N> {
    /// Puts the eigenvalues in descending order; equal ones stay as they are.
    fn sort(&mut self) {
        for end in 1..N {
            for i in (0..end).rev() {
                if self.values[i] >= self.values[i + 1] {
                    break;
                }
                self.values.swap(i, i + 1);
                self.vectors.swap_columns(i, i + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Errors of orthogonality and of D = RΛRᵀ, as a share of ‖D‖: some ten roundings (2⁻²⁴) for 8×8.
    const BACKWARD_ERROR: f32 = 1e-6;

    fn check<const N: usize>(poles: &[f32; N], vector: &[f32; N]) {
        let eigen = decompose(poles, vector);
        let r = &eigen.vectors;
        let off = (r.tr_mul(r) - SMatrix::<f32, N, N>::identity()).amax();
        assert!(
            off <= BACKWARD_ERROR,
            "orthogonality {off:e} of {poles:?} {vector:?}"
        );
        assert!(
            eigen.values.is_sorted_by(|a, b| a >= b),
            "{:?}",
            eigen.values
        );
        let matrix = SMatrix::<f32, N, N>::from_fn(|i, j| {
            vector[i] * vector[j] + if i == j { poles[i] } else { 0.0 }
        });
        let diagonal = SMatrix::<f32, N, N>::from_diagonal(&eigen.values.into());
        let error = (r * diagonal * r.transpose() - matrix).amax() / matrix.amax().max(1e-30);
        assert!(
            error <= BACKWARD_ERROR,
            "error {error:e} of {poles:?} {vector:?}"
        );
    }

    /// Numbers of very different sizes, zeros and repetitions.
    fn graded() -> impl Strategy<Value = f32> {
        prop_oneof![
            Just(0.0_f32),
            Just(1.0),
            Just(64.0),
            0.0_f32..100.0,
            (-20_i32..4, 1.0_f32..2.0).prop_map(|(e, x)| x * libm::exp2f(e as f32)),
        ]
    }

    proptest! {
        #[test]
        fn eigenvectors_are_orthogonal_and_give_the_matrix_back(
            mut poles in prop::array::uniform8(graded()),
            vector in prop::array::uniform8((graded(), any::<bool>())),
        ) {
            poles.sort_by(|a, b| b.total_cmp(a));
            check(&poles, &vector.map(|(v, negative)| if negative { -v } else { v }));
        }

        #[test]
        fn eigenvalues_match_reference(
            mut poles in prop::array::uniform6(0.0_f32..100.0),
            vector in prop::array::uniform6(-10.0_f32..10.0),
        ) {
            poles.sort_by(|a, b| b.total_cmp(a));
            let matrix = nalgebra::DMatrix::from_fn(6, 6, |i, j| {
                f64::from(vector[i]) * f64::from(vector[j]) + if i == j { f64::from(poles[i]) } else { 0.0 }
            });
            let mut expected = matrix.symmetric_eigenvalues().as_slice().to_vec();
            expected.sort_by(|a, b| b.total_cmp(a));
            for (value, expected) in decompose(&poles, &vector).values.iter().zip(expected) {
                prop_assert!((f64::from(*value) - expected).abs() <= 1e-6 * expected.max(1e-3), "{value} {expected}");
            }
        }
    }

    #[test]
    fn nothing_to_add_leaves_the_diagonal_as_it_is() {
        let eigen = decompose(&[3.0, 2.0, 0.0], &[0.0; 3]);
        assert_eq!(eigen.values, [3.0, 2.0, 0.0]);
        assert_eq!(eigen.vectors, SMatrix::<f32, 3, 3>::identity());
        assert_eq!(
            decompose(&[0.0; 3], &[0.0; 3]).vectors,
            SMatrix::<f32, 3, 3>::identity()
        );
        assert_eq!(decompose(&[0.0; 3], &[1e-30; 3]).values, [0.0; 3]);
    }

    #[test]
    fn a_vector_alone_is_its_own_eigenvector() {
        let eigen = decompose(&[0.0, 0.0], &[0.0, 3.0]);
        assert_eq!(eigen.values, [9.0, 0.0]);
        assert_eq!(eigen.vectors.column(0).as_slice(), [0.0, 1.0]);
    }

    #[test]
    fn poles_that_are_equal_or_nearly_so_are_no_trouble() {
        check(&[5.0; 4], &[1.0, -2.0, 3.0, 4.0]);
        check(&[0.0; 4], &[1.0, -2.0, 3.0, 4.0]);
        check(&[5.0, 5.0_f32.next_down(), 1e-30, 0.0], &[1.0; 4]);
        check(&[1e30, 1e30, 1.0, 0.0], &[1e15, 1e-15, 1.0, 1.0]);
        check(&[1e-30, 1e-31, 0.0, 0.0], &[1e-15, 1e-16, 1e-17, 0.0]);
    }

    #[test]
    fn small_eigenvalues_keep_their_accuracy() {
        // An update of an eigenspace of graded eigenvalues, by a view as strong in every dimension.
        let poles = [1e4_f32, 1e1, 1e-2, 1e-5, 0.0];
        let vector = [100.0_f32, 3.162, 0.1, 3.162e-3, 1e-4];
        let ours = decompose(&poles, &vector).values[4];
        // To first order in v₅², where the last pole is 0: v₅²/(1 + Σ v²/pole).
        let expected = 1e-8 / 5.0;
        assert!(
            (f64::from(ours) / expected - 1.0).abs() < 2e-3,
            "{ours:e} {expected:e}"
        );
    }
}
