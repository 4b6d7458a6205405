//! Ways that cover an area: corners to fly through, one after the other.

use crate::landmark::Point;

use super::SIDE_PX;

/// A flight pattern around or beside the start. Lengths are in sides; x is right, y down, from the start at (0, 0).
///
/// ```
/// use eigenmark_core::chart::Pattern;
/// let lawn = Pattern::Lawn { from: [0.0, 0.0], to: [4.0, -1.0], spacing: 0.6 };
/// let corners: Vec<_> = lawn.corners().map(|corner| (corner.x_px, corner.y_px)).collect();
/// assert_eq!(corners, [(0.0, 0.0), (400.0, 0.0), (400.0, -50.0), (0.0, -50.0), (0.0, -100.0), (400.0, -100.0)]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pattern {
    /// Lines along x, to and fro, as a lawn is mown.
    Lawn {
        /// The box's corner where it begins: x and y.
        from: [f32; 2],
        /// The opposite corner.
        to: [f32; 2],
        /// Distance of two lines, at most; positive.
        spacing: f32,
    },
    /// A square spiral outward from the start, clockwise.
    Square {
        /// Distance of two lines.
        spacing: f32,
        /// Times that it goes around.
        rings: u16,
    },
}

impl Pattern {
    /// Corner `index` (0-based) in the chart; `None` after the last.
    #[must_use]
    pub fn corner(&self, index: u16) -> Option<Point> {
        let [x, y] = match *self {
            Self::Lawn { from, to, spacing } => lawn(from, to, spacing, index),
            Self::Square { spacing, rings } => {
                square(rings, index).map(|at| at.map(|step| step * spacing))
            }
        }?;
        Some(Point {
            x_px: x * SIDE_PX,
            y_px: y * SIDE_PX,
        })
    }

    /// All corners.
    pub fn corners(&self) -> impl Iterator<Item = Point> + use<> {
        let pattern = *self;
        (0..=u16::MAX).map_while(move |index| pattern.corner(index))
    }
}

fn lawn(from: [f32; 2], to: [f32; 2], spacing: f32, index: u16) -> Option<[f32; 2]> {
    let height = to[1] - from[1];
    // Saturates; rounding makes no line more.
    let gaps = (height.abs() / spacing - 1e-4) as u16;
    let gaps = if height == 0.0 {
        0
    } else {
        gaps.saturating_add(1)
    };
    let line = index / 2;
    if line > gaps {
        return None;
    }
    let is_far = index.div_ceil(2) % 2 == 1;
    let x = if is_far { to[0] } else { from[0] };
    let share = f32::from(line) / f32::from(gaps.max(1));
    Some([x, from[1] + height * share])
}

fn square(rings: u16, index: u16) -> Option<[f32; 2]> {
    let ring = index.div_ceil(4);
    if ring > rings {
        return None;
    }
    let out = f32::from(ring);
    Some(match index % 4 {
        1 => [out, 1.0 - out],
        2 => [out, out],
        3 => [-out, out],
        _ => [-out, -out],
    })
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    fn corners(pattern: Pattern) -> Vec<(f32, f32)> {
        let corners = pattern.corners();
        corners.map(|at| (at.x_px, at.y_px)).collect()
    }

    #[test]
    fn a_lawn_has_lines_at_most_the_spacing_apart() {
        let lawn = |to, spacing| {
            corners(Pattern::Lawn {
                from: [1.0, 1.0],
                to,
                spacing,
            })
        };
        assert_eq!(lawn([3.0, 1.0], 0.5), [(100.0, 100.0), (300.0, 100.0)]);
        for (height, spacing, lines) in [(1.0, 0.5, 3), (1.0, 0.4, 4), (1.0, 2.0, 2), (0.9, 0.3, 4)]
        {
            let found = lawn([3.0, 1.0 + height], spacing);
            assert_eq!(found.len(), 2 * lines, "{height} {spacing}");
            let last = found[2 * lines - 1].1;
            assert!((last - 100.0 * (1.0 + height)).abs() < 1e-3, "{last}");
            for pair in found.windows(2) {
                let (along, down) = ((pair[1].0 - pair[0].0).abs(), pair[1].1 - pair[0].1);
                assert!((along == 200.0) != (down > 0.0), "{found:?}");
                assert!(down <= 100.0 * spacing + 1e-3, "{found:?}");
            }
        }
        assert!(lawn([3.0, 2.0], 0.0).len() <= 1 << 16, "without spacing");
        assert!(lawn([3.0, f32::NAN], 1.0).len() <= 4);
    }

    #[test]
    fn a_square_goes_around_and_outward() {
        let found = corners(Pattern::Square {
            spacing: 0.5,
            rings: 2,
        });
        assert_eq!(found.len(), 9);
        assert_eq!(found[0], (0.0, 0.0));
        let mut legs = Vec::new();
        for pair in found.windows(2) {
            legs.push((pair[1].0 - pair[0].0, pair[1].1 - pair[0].1));
        }
        let expected = [1, 1, 2, 2, 3, 3, 4, 4].map(|steps| 50.0 * steps as f32);
        for ((leg, length), direction) in legs.into_iter().zip(expected).zip(0..) {
            let expected = match direction % 4 {
                0 => (length, 0.0),
                1 => (0.0, length),
                2 => (-length, 0.0),
                _ => (0.0, -length),
            };
            assert_eq!(leg, expected);
        }
    }
}
