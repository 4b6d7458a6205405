//! Turn, scale and shift of the plane, and the one that most of some pairs of points agree on.
//!
//! **Method.** Two pairs fix a similarity. All pairs of pairs, up to a number, are tried in a fixed order; the one with
//! the least sum of squared residuals, each cut off at a limit, is kept (MSAC, Torr and Zisserman 2000). Least squares
//! over those within the limit follows, and again over those within a few of their standard deviations. Nothing is
//! random. With six of ten pairs right, one in three trials starts from two right ones.

use nalgebra::Vector2;

/// Trials, at most.
const MAX_TRIALS: usize = 64;

/// The limit of residuals narrows to this many standard deviations.
const GATE: f32 = 3.0;

/// A point and where it has to go.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    pub from: [f32; 2],
    pub to: [f32; 2],
}

/// p ↦ shift + turn·p, where turn is the matrix [c −s; s c] = scale·rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// [c, s].
    pub turn: [f32; 2],
    pub shift: [f32; 2],
}

/// A similarity that most of the pairs agree on.
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    pub similarity: Similarity,
    /// Which pairs agree: bit i for pair i.
    pub inliers: u32,
    /// Variance of a residual in each direction, of `to`, from the inliers.
    pub variance: f32,
    /// The inliers' mean of `from`.
    pub middle: [f32; 2],
    /// The inliers' Σ ‖from − middle‖².
    pub spread: f32,
}

impl Similarity {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self {
        turn: [1.0, 0.0],
        shift: [0.0, 0.0],
    };

    /// Where a point goes.
    pub fn apply(&self, p: [f32; 2]) -> [f32; 2] {
        let [x, y] = self.rotate(p);
        [x + self.shift[0], y + self.shift[1]]
    }

    /// Turns and scales a vector.
    pub fn rotate(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [c, s] = self.turn;
        [c * x - s * y, s * x + c * y]
    }

    /// This after another one.
    pub fn after(&self, first: &Self) -> Self {
        Self {
            turn: self.rotate(first.turn),
            shift: self.apply(first.shift),
        }
    }

    /// The way back. The scale is not zero.
    pub fn inverse(&self) -> Self {
        let [c, s] = self.turn;
        let square = self.scale_squared();
        let turn = [c / square, -s / square];
        let back = Self {
            turn,
            shift: [0.0; 2],
        };
        let [x, y] = back.rotate(self.shift);
        Self {
            turn,
            shift: [-x, -y],
        }
    }

    /// The square of the scale.
    pub fn scale_squared(&self) -> f32 {
        let [c, s] = self.turn;
        c * c + s * s
    }

    /// The one that takes a pair of points to another; `None` when they are closer than `least`.
    fn between(a: &Pair, b: &Pair, least: f32) -> Option<Self> {
        let from = [b.from[0] - a.from[0], b.from[1] - a.from[1]];
        let to = [b.to[0] - a.to[0], b.to[1] - a.to[1]];
        let square = from[0] * from[0] + from[1] * from[1];
        if square <= least * least {
            return None;
        }
        let turn = [
            (from[0] * to[0] + from[1] * to[1]) / square,
            (from[0] * to[1] - from[1] * to[0]) / square,
        ];
        Some(Self::turned(turn, a.from, a.to))
    }

    /// With that turn, and `from` going to `to`.
    fn turned(turn: [f32; 2], from: [f32; 2], to: [f32; 2]) -> Self {
        let mut similarity = Self {
            turn,
            shift: [0.0; 2],
        };
        let [x, y] = similarity.rotate(from);
        similarity.shift = [to[0] - x, to[1] - y];
        similarity
    }

    fn residual_squared(&self, pair: &Pair) -> f32 {
        let [x, y] = self.apply(pair.from);
        let [dx, dy] = [x - pair.to[0], y - pair.to[1]];
        dx * dx + dy * dy
    }
}

/// The similarity that most pairs agree on to within `limit`, and at best `floor`; both are lengths of `from`, and
/// `least` the smallest distance of two pairs that may fix one. `None` with fewer than three inliers.
///
/// Pairs beyond the 32nd are left out.
#[inline(never)]
pub fn agree(pairs: &[Pair], limit: f32, floor: f32, least: f32) -> Option<Agreement> {
    let pairs = pairs.get(..32).unwrap_or(pairs);
    let mut best = (f32::INFINITY, Similarity::IDENTITY);
    let mut trials = 0;
    // Neighbors in the list by increasing distance there: every pair takes part early.
    'trials: for apart in 1..pairs.len() {
        for (a, b) in pairs.iter().zip(pairs.get(apart..).unwrap_or_default()) {
            let Some(similarity) = Similarity::between(a, b, least) else {
                continue;
            };
            // Residuals are lengths of `to`.
            let cut = limit * limit * similarity.scale_squared();
            let cost: f32 = pairs
                .iter()
                .map(|pair| similarity.residual_squared(pair).min(cut))
                .sum();
            // In lengths of `from`, or nothing would be as good as a scale of zero.
            let cost = cost / similarity.scale_squared();
            if cost < best.0 {
                best = (cost, similarity);
            }
            trials += 1;
            if trials >= MAX_TRIALS {
                break 'trials;
            }
        }
    }
    let mut similarity = best.1;
    let mut gate = limit;
    let mut agreement = None;
    for _ in 0..3 {
        let cut = gate * gate * similarity.scale_squared();
        let found = fit(
            pairs,
            |pair| similarity.residual_squared(pair) <= cut,
            floor,
        )?;
        similarity = found.similarity;
        gate = (GATE * crate::math::sqrt(found.variance / similarity.scale_squared())).min(limit);
        agreement = Some(found);
    }
    agreement
}

/// Least squares over the pairs that are to take part; at least three, that do not lie in one point.
fn fit(pairs: &[Pair], takes_part: impl Fn(&Pair) -> bool, floor: f32) -> Option<Agreement> {
    let (mut inliers, mut count) = (0_u32, 0.0_f32);
    let (mut from, mut to) = (Vector2::zeros(), Vector2::zeros());
    for (index, pair) in pairs.iter().enumerate() {
        if takes_part(pair) {
            inliers |= 1 << index;
            count += 1.0;
            from += Vector2::from(pair.from);
            to += Vector2::from(pair.to);
        }
    }
    if count < 3.0 {
        return None;
    }
    let (from, to): (Vector2<f32>, Vector2<f32>) = (from / count, to / count);
    let taken = || {
        let indexed = pairs.iter().enumerate();
        indexed.filter(move |&(index, _)| inliers >> index & 1 == 1)
    };
    let (mut along, mut across, mut spread, mut moved) = (0.0, 0.0, 0.0, 0.0);
    for (_, pair) in taken() {
        let p = Vector2::from(pair.from) - from;
        let q = Vector2::from(pair.to) - to;
        along += p.dot(&q);
        across += p.x * q.y - p.y * q.x;
        spread += p.dot(&p);
        moved += q.dot(&q);
    }
    if spread <= 0.0 || moved <= 0.0 {
        return None;
    }
    let similarity = Similarity::turned([along / spread, across / spread], from.into(), to.into());
    let squares: f32 = taken()
        .map(|(_, pair)| similarity.residual_squared(pair))
        .sum();
    // Two coordinates per pair, four parameters.
    let variance = squares / (2.0 * count - 4.0);
    let floor = floor * floor * similarity.scale_squared();
    Some(Agreement {
        similarity,
        inliers,
        variance: variance.max(floor),
        middle: from.into(),
        spread,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Errors of rounding, for positions within ±1.
    const ROUNDING: f32 = 1e-5;

    fn pair(from: [f32; 2], by: &Similarity) -> Pair {
        Pair {
            from,
            to: by.apply(from),
        }
    }

    fn any_similarity() -> impl Strategy<Value = Similarity> {
        let shift = prop::array::uniform2(-1.0_f32..1.0);
        (-3.0_f32..3.0, 0.5_f32..2.0, shift).prop_map(|(angle, scale, shift)| Similarity {
            turn: [scale * angle.cos(), scale * angle.sin()],
            shift,
        })
    }

    proptest! {
        #[test]
        fn eight_of_twenty_may_be_anywhere(
            similarity in any_similarity(),
            points in prop::collection::vec(prop::array::uniform2(-0.5_f32..0.5), 20),
            wrong in prop::collection::vec(prop::array::uniform2(-2.0_f32..2.0), 8),
            rotate in 0_usize..20,
        ) {
            let mut pairs: Vec<Pair> = points.iter().map(|&from| pair(from, &similarity)).collect();
            for (pair, to) in pairs.iter_mut().zip(wrong) {
                pair.to = to;
            }
            pairs.rotate_left(rotate);
            let found = agree(&pairs, 0.02, 1e-4, 0.1).expect("twelve agree");
            prop_assert!(found.inliers.count_ones() >= 12);
            for from in [[0.0, 0.0], [0.5, -0.5]] {
                let (a, b) = (found.similarity.apply(from), similarity.apply(from));
                // A wrong pair may be right by chance, nearly: within the last gate.
                prop_assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 2e-3, "{a:?} {b:?}");
            }
        }

        #[test]
        fn an_inverse_leads_back(similarity in any_similarity(), at in prop::array::uniform2(-1.0_f32..1.0)) {
            let back = similarity.inverse();
            for round in [back.after(&similarity).apply(at), back.apply(similarity.apply(at))] {
                prop_assert!((round[0] - at[0]).hypot(round[1] - at[1]) < ROUNDING, "{round:?}");
            }
        }

        #[test]
        fn any_pairs_give_finite_numbers_or_none(
            pairs in prop::collection::vec((prop::array::uniform2(any::<f32>()), prop::array::uniform2(-1.0_f32..1.0)), 0..24),
        ) {
            let pairs: Vec<Pair> = pairs.into_iter().map(|(to, from)| Pair { from, to }).collect();
            if let Some(found) = agree(&pairs, 0.02, 1e-4, 0.1) {
                prop_assert!(found.inliers.count_ones() >= 3);
            }
        }
    }

    #[test]
    fn the_fit_is_that_of_least_squares() {
        // Four corners of a square, of which two opposite ones are pulled outward: that is a larger scale.
        let moved = [
            ([1.0, 1.0], 1.1),
            ([-1.0, 1.0], 1.0),
            ([-1.0, -1.0], 1.1),
            ([1.0, -1.0], 1.0),
        ];
        let pairs = moved.map(|(from, by): ([f32; 2], f32)| Pair {
            from,
            to: from.map(|at| at * by),
        });
        let found = agree(&pairs, 1.0, 0.0, 0.1).expect("agree");
        assert_eq!(found.inliers, 0b1111);
        let [c, s] = found.similarity.turn;
        assert!((c - 1.05).abs() < ROUNDING && s.abs() < ROUNDING);
        // Residuals are 0.05·√2 long, and four of eight coordinates are fit.
        assert!((found.variance - 4.0 * 0.005 / 4.0).abs() < ROUNDING);
        assert!((found.spread - 8.0).abs() < ROUNDING);
    }
}
