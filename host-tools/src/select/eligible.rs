//! Which candidates may be selected, and which may stand together.

use eigenmark_core::landmark::Point;

/// The candidates that a selection chooses from, and how far apart its landmarks must be.
#[derive(Clone, Debug)]
pub struct Eligible {
    /// Candidate numbers, 1-based, ascending.
    candidates: Vec<u32>,
    spacing: Option<Spacing>,
}

#[derive(Clone, Debug)]
struct Spacing {
    /// Where every candidate of the grid is, candidate 1 first.
    places: Vec<Point>,
    minimum_px: f32,
}

impl Eligible {
    /// All of `count` candidates.
    #[must_use]
    pub fn all(count: u32) -> Self {
        Self::among((1..=count).collect())
    }

    /// Only these candidates (1-based).
    #[must_use]
    pub fn among(mut candidates: Vec<u32>) -> Self {
        candidates.sort_unstable();
        candidates.dedup();
        Self {
            candidates,
            spacing: None,
        }
    }

    /// The same candidates, but selected ones must be at least `minimum_px` map pixels apart. `places` are the centers
    /// of every candidate of the grid, candidate 1 first.
    #[must_use]
    pub fn spaced(self, places: Vec<Point>, minimum_px: f32) -> Self {
        Self {
            spacing: Some(Spacing { places, minimum_px }),
            ..self
        }
    }

    /// Candidate numbers (1-based), ascending.
    #[must_use]
    pub fn candidates(&self) -> &[u32] {
        &self.candidates
    }

    /// Whether two different candidates (1-based) may both be landmarks.
    #[must_use]
    pub fn admits_both(&self, one: u32, other: u32) -> bool {
        self.spacing.as_ref().is_none_or(|spacing| {
            let [a, b] = [one, other].map(|view| spacing.places[view as usize - 1]);
            (a.x_px - b.x_px).hypot(a.y_px - b.y_px) >= spacing.minimum_px
        })
    }

    /// Whether `candidate` is far enough from everything in `selected`.
    #[must_use]
    pub fn admits(&self, candidate: u32, selected: &[u32]) -> bool {
        selected
            .iter()
            .all(|&other| self.admits_both(candidate, other))
    }

    /// The first `landmarks` of a ranking that are far enough from all those taken before; fewer when it ends.
    #[must_use]
    pub fn best_of(&self, ranking: &[u32], landmarks: usize) -> Vec<u32> {
        let mut selected = Vec::with_capacity(landmarks.min(ranking.len()));
        for &candidate in ranking {
            if selected.len() == landmarks {
                break;
            }
            if self.admits(candidate, &selected) {
                selected.push(candidate);
            }
        }
        selected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn landmarks_keep_their_distance() {
        let places = [0.0, 3.0, 6.0, 10.0].map(|x_px| Point { x_px, y_px: 1.0 });
        let eligible = Eligible::all(4).spaced(places.to_vec(), 6.0);
        assert_eq!(eligible.best_of(&[2, 1, 3, 4], 3), [2, 4]);
        assert_eq!(Eligible::all(4).best_of(&[2, 1, 3, 4], 3), [2, 1, 3]);
        assert!(eligible.admits_both(1, 3) && !eligible.admits_both(3, 4));
    }

    #[test]
    fn candidates_are_listed_once_and_in_order() {
        assert_eq!(Eligible::among(vec![7, 2, 7]).candidates(), [2, 7]);
    }
}
