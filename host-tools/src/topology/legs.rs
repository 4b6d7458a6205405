//! Between which places a vehicle can fly.

use eigenmark_core::landmark::Point;

use super::ROOM;

/// How far path integration may carry a vehicle between places, in sides of a view: it drifts by some percent, and
/// where it arrives the belief has to hold the place.
const LONGEST: f32 = 4.0;

/// The longest leg for views whose footprint has that side, in map pixels.
pub(super) fn longest_px(footprint_px: f32) -> f32 {
    LONGEST * footprint_px
}

/// The Gabriel graph (Gabriel and Sokal 1969) of the places, without legs longer than `longest_px`: two places are joined
/// when no other one lies within the circle between them. Of a square grid these are neighbours and diagonals; where
/// places are scattered, no place is left out that a shortest network would join.
pub(super) fn between(places: &[Point], longest_px: f32) -> Vec<(u16, u16)> {
    // From left to right, so that only some of the places can be near.
    let mut order: Vec<u16> = (0..places.len().min(ROOM.0) as u16).collect();
    let at = |place: u16| places[usize::from(place)];
    order.sort_by(|&a, &b| at(a).x_px.total_cmp(&at(b).x_px));
    let from_x = |x_px: f32| order.partition_point(|&place| at(place).x_px < x_px);
    let mut legs = Vec::new();
    for (index, &a) in order.iter().enumerate() {
        for &b in &order[index + 1..] {
            let (p, q) = (at(a), at(b));
            if q.x_px - p.x_px > longest_px {
                break;
            }
            let length = p.distance_px(q);
            if length > longest_px || length <= 0.0 {
                continue;
            }
            let middle = Point {
                x_px: (p.x_px + q.x_px) / 2.0,
                y_px: (p.y_px + q.y_px) / 2.0,
            };
            // Corners of a square lie on the circles of its diagonals: rounding must not decide.
            let radius = length / 2.0 * 0.999;
            let near = &order[from_x(middle.x_px - radius)..from_x(middle.x_px + radius)];
            let is_within = |&&c: &&u16| c != a && c != b && at(c).distance_px(middle) < radius;
            if !near.iter().any(|c| is_within(&c)) {
                legs.push((length, a.min(b), a.max(b)));
            }
        }
    }
    // The shortest, as far as there is room.
    legs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    legs.truncate(ROOM.1);
    let mut legs: Vec<(u16, u16)> = legs.into_iter().map(|(_, a, b)| (a, b)).collect();
    legs.sort_unstable();
    legs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{simulate::seeded, topology::Network};
    use rand::RngExt;

    #[test]
    fn of_a_grid_neighbours_and_diagonals_are_joined() {
        let places: Vec<Point> = (0..9_u8)
            .map(|index| Point {
                x_px: f32::from(index % 3) * 10.0,
                y_px: f32::from(index / 3) * 10.0,
            })
            .collect();
        let legs = between(&places, 100.0);
        assert_eq!(legs.len(), 12 + 8);
        assert!(legs.contains(&(0, 4)) && legs.contains(&(1, 3)) && !legs.contains(&(0, 2)));
        assert_eq!(between(&places, 12.0).len(), 12, "diagonals are too long");
    }

    #[test]
    fn between_matches_reference() {
        let mut random = seeded(4, 4);
        let places: Vec<Point> = (0..80)
            .map(|_| Point {
                x_px: random.random_range(0.0..500.0),
                y_px: random.random_range(0.0..300.0),
            })
            .collect();
        let mut expected = Vec::new();
        for a in 0..places.len() {
            for b in a + 1..places.len() {
                let (p, q) = (places[a], places[b]);
                let middle = Point {
                    x_px: (p.x_px + q.x_px) / 2.0,
                    y_px: (p.y_px + q.y_px) / 2.0,
                };
                let radius = p.distance_px(q) / 2.0 * 0.999;
                let is_free = (0..places.len())
                    .all(|c| c == a || c == b || places[c].distance_px(middle) >= radius);
                if is_free {
                    expected.push((a as u16, b as u16));
                }
            }
        }
        let legs = between(&places, 1000.0);
        assert_eq!(legs, expected);
        assert_eq!(Network { places, legs }.islands(), 1);
    }
}
