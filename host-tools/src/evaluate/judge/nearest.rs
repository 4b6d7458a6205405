//! The nearest landmark, of nearnesses that were computed fast and may have been exchanged by rounding.
//!
//! **Method.** Nearnesses come from products a·b, in which small distances drown in the rounding of large norms. The distances
//! of the nearest, and of all that rounding could have exchanged it with, are computed from the differences.

/// Nearnesses that differ by less than this, relative to their magnitude and the view's, may be exchanged by rounding.
const CLOSE: f64 = 1e-10;

/// The nearest of some landmarks: which, how far, and whether no other is as near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    pub index: usize,
    pub distance: f64,
    pub is_strict: bool,
}

/// The nearest landmark by their `nearnesses` to a view, whose coordinates have the norm `squared_norm`; `distance` is the
/// exact one to a landmark.
pub(crate) fn nearest_of(
    nearnesses: impl Iterator<Item = f64> + Clone,
    squared_norm: f64,
    mut distance: impl FnMut(usize) -> f64,
) -> Nearest {
    let greatest = nearnesses.clone().fold(f64::NEG_INFINITY, f64::max);
    let close = CLOSE * (greatest.abs() + squared_norm);
    let mut nearest = Nearest {
        index: 0,
        distance: f64::INFINITY,
        is_strict: true,
    };
    for (index, near) in nearnesses.enumerate() {
        if near + close < greatest {
            continue;
        }
        let distance = distance(index);
        if distance < nearest.distance {
            nearest = Nearest {
                index,
                distance,
                is_strict: true,
            };
        } else if distance == nearest.distance {
            nearest.is_strict = false;
        }
    }
    nearest
}
