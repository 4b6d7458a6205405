//! Preselection of landmarks by attention operators; report section 5.2.3.
//!
//! A dense grid has far more candidates than a map has remarkable places. An attention operator gives every map pixel
//! a response; candidates with little of it are dropped before anything is ranked: [`preselect`] names the rest, for
//! [`Eligible::among`](super::Eligible::among).
//!
//! **Notation.** A view pixel is ⌊`scale` + ½⌋ map pixels wide, here called the pitch. Responses are per map pixel;
//! their units are the operators'. Outside the map its border is repeated.
//!
//! **Method.** Details finer than a view pixel cannot be seen on board, so that no operator sees them either: the map
//! is averaged over a square of one pitch around every pixel, and the operators' taps are one pitch apart. The
//! response at a map pixel is thus what the textbook operator finds in a view that has a pixel centered there; a view
//! picture reduced once would only tell that for one of pitch² alignments, and the candidates of a grid have others.
//! A candidate's attention is the mean response over the central half of its window (half the width, half the height):
//! the report complains (5.1) of remarkable features at the border of views, from where a small deviation moves them
//! out of sight. An integral image gives it in four reads.
//!
//! **Cost.** A map of 1600×1200 takes 0.04 to 0.14 s on two cores, whatever the operator and the scale (1 to 15);
//! preselecting among 22,176 candidates takes 0.18 s. Memory is at most six f32 per map pixel while filtering, then
//! one f32 and one f64.
//!
//! **Limits.** Neighbors share their features, so what is kept comes in clusters: choose with spacing among it. What
//! is remarkable in itself may still occur twice; whether it does is for the ranking to say.

mod edges;
mod entropy;
mod gradient;
mod harris;
mod integral;
mod plane;

use eigenmark_core::preprocess::MIN_VIEW_SIDE;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use plane::Plane;

use crate::map::{Grid, Map};
use integral::Integral;

/// What draws attention.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Attention {
    /// Corners: the strength of Harris and Stephens (1988), in levels⁴ per view pixel⁴; nothing along straight edges.
    Harris,
    /// Edges: 1 where the gradient is larger than noise explains, otherwise 0, so that means are densities.
    Edges,
    /// Variety: the entropy of the luminance levels around, in bits, 0 to 5.
    Entropy,
}

impl Attention {
    /// The response of every pixel of `map`, at `scale` map pixels per view pixel.
    #[must_use]
    pub fn response(self, map: &Map, scale: f64) -> Plane {
        let pitch = pitch(map, scale);
        let seen = Plane::of(map).averaged(pitch);
        match self {
            Self::Harris => harris::response(&seen, pitch),
            Self::Edges => edges::response(&seen, pitch),
            Self::Entropy => entropy::response(&seen, pitch),
        }
    }

    /// The attention of every candidate of `grid`, candidate 1 first.
    #[must_use]
    pub fn of_candidates(self, map: &Map, grid: &Grid, scale: f64) -> Vec<f64> {
        let responses = Integral::of(&self.response(map, scale));
        let window = grid.window_px() as usize;
        let margin = window / 4;
        let side = window - 2 * margin;
        (1..=grid.count())
            .into_par_iter()
            .map(|view| {
                let (x, y) = grid.corner(view);
                responses.mean((x as usize + margin, y as usize + margin), side)
            })
            .collect()
    }
}

/// The `keep` candidates of `grid` with the largest attention, as ascending numbers (1-based); of equals the lower
/// number is kept. All of them when there are no more.
#[must_use]
pub fn preselect(
    map: &Map,
    grid: &Grid,
    attention: Attention,
    scale: f64,
    keep: usize,
) -> Vec<u32> {
    let attentions = attention.of_candidates(map, grid, scale);
    let mut kept: Vec<u32> = (1..=grid.count()).collect();
    // Stable, so that of equals the lower number comes first.
    kept.sort_by(|&a, &b| attentions[b as usize - 1].total_cmp(&attentions[a as usize - 1]));
    kept.truncate(keep);
    kept.sort_unstable();
    kept
}

/// Whole map pixels per view pixel: at least one, and no more than leave the smallest view of a board on the map.
fn pitch(map: &Map, scale: f64) -> usize {
    let largest = map.width().min(map.height()) as usize / usize::from(MIN_VIEW_SIDE);
    (scale.round() as usize).min(largest).max(1)
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;

    const ALL: [Attention; 3] = [Attention::Harris, Attention::Edges, Attention::Entropy];

    /// Responses at scale 3 of blocks of 3×3 equal pixels differ from those of single pixels by the rounding of an
    /// average of nine f32, which the fourth power of Harris magnifies; relative to the largest.
    const TOLERANCE: f32 = 1e-4;

    /// A dark map with one bright square of `side` pixels centered at (x, y).
    fn with_square(width: u32, height: u32, (x, y): (u32, u32), side: u32) -> Map {
        let near = |at: u32, center: u32| (center - side / 2..center + side / 2).contains(&at);
        let picture = GrayImage::from_fn(width, height, |column, row| {
            Luma([if near(column, x) && near(row, y) {
                200
            } else {
                50
            }])
        });
        Map::from_luminance("square", picture)
    }

    #[test]
    fn flat_maps_draw_no_attention() {
        for level in [0, 77, 255] {
            let map = Map::from_luminance("flat", GrayImage::from_pixel(50, 40, Luma([level])));
            for attention in ALL {
                for scale in [1.0, 3.0, 4.0] {
                    let response = attention.response(&map, scale);
                    assert_eq!((response.width(), response.height()), (50, 40));
                    assert!(
                        response.values().iter().all(|&found| found == 0.0),
                        "{attention:?} {scale}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_response_is_that_of_a_view_whose_pixel_is_centered_there() {
        let small = GrayImage::from_fn(24, 20, |x, y| {
            Luma([((x * x * 7 + y * 31 + x * y) % 256) as u8])
        });
        let blocks = GrayImage::from_fn(72, 60, |x, y| *small.get_pixel(x / 3, y / 3));
        let [small, blocks] = [small, blocks].map(|picture| Map::from_luminance("blocks", picture));
        let (small, blocks) = (
            Attention::Harris.response(&small, 1.0),
            Attention::Harris.response(&blocks, 3.0),
        );
        let largest = small.values().iter().fold(0.0, |a: f32, &b| a.max(b));
        // Far enough from the border that it is not repeated: three pixels of the Gaussian, one of the gradient.
        for (x, y) in (4..20).flat_map(|x| (4..16).map(move |y| (x, y))) {
            let (expected, found) = (small.at(x, y), blocks.at(3 * x + 1, 3 * y + 1));
            assert!(
                (expected - found).abs() <= TOLERANCE * largest,
                "{x}, {y}: {expected} {found}"
            );
        }
    }

    #[test]
    fn details_finer_than_a_view_pixel_draw_no_attention() {
        let picture = GrayImage::from_fn(80, 80, |x, y| {
            Luma([if (x + y) % 2 == 0 { 250 } else { 0 }])
        });
        let map = Map::from_luminance("fine checkerboard", picture);
        for attention in ALL {
            let (fine, coarse) = (attention.response(&map, 1.0), attention.response(&map, 4.0));
            // Where nothing within reach is repeated: two pixels of the average, 18 of the entropy's window.
            for (x, y) in (20..60).flat_map(|x| (20..60).map(move |y| (x, y))) {
                assert_eq!(coarse.at(x, y), 0.0, "{attention:?} at {x}, {y}");
            }
            // Central differences do not see a pattern of two pixels, at any scale; levels do.
            assert!(attention != Attention::Entropy || fine.at(40, 40) > 0.9);
        }
    }

    #[test]
    fn features_at_the_center_draw_more_attention_than_at_the_border() {
        let map = with_square(120, 120, (60, 60), 12);
        let grid = Grid::dense(&map, 40, 4).expect("fits");
        let candidate = |corner| {
            (1..=grid.count())
                .find(|&view| grid.corner(view) == corner)
                .expect("on the grid")
        };
        let (centered, aside) = (candidate((40, 40)), candidate((56, 40)));
        for attention in [Attention::Harris, Attention::Edges] {
            let attentions = attention.of_candidates(&map, &grid, 2.0);
            assert!(
                attentions[centered as usize - 1] > attentions[aside as usize - 1],
                "{attention:?}"
            );
            assert!(preselect(&map, &grid, attention, 2.0, 30).contains(&centered));
        }
        // Entropy has a window of its own, and the whole square is in both.
        let attentions = Attention::Entropy.of_candidates(&map, &grid, 1.0);
        assert!(attentions[centered as usize - 1] > attentions[candidate((64, 64)) as usize - 1]);
    }

    #[test]
    fn the_city_keeps_as_many_candidates_as_asked() {
        let map = Map::city();
        let grid = Grid::dense(&map, 200, 40).expect("fits");
        for attention in ALL {
            let attentions = attention.of_candidates(&map, &grid, 10.0);
            for keep in [0, 1, 200, 936, 2000] {
                let kept = preselect(&map, &grid, attention, 10.0, keep);
                assert_eq!(kept.len(), keep.min(grid.count() as usize));
                assert!(kept.is_sorted_by(|a, b| a < b));
                let is_kept = |view: &u32| kept.binary_search(view).is_ok();
                let least = kept
                    .iter()
                    .map(|&view| attentions[view as usize - 1])
                    .fold(f64::INFINITY, f64::min);
                let dropped = (1..=grid.count()).filter(|view| !is_kept(view));
                let most = dropped
                    .map(|view| attentions[view as usize - 1])
                    .fold(0.0, f64::max);
                assert!(least >= most, "{attention:?} {keep}: {least} {most}");
            }
        }
    }

    #[test]
    fn of_equals_the_lower_number_is_kept() {
        let map = Map::from_luminance("flat", GrayImage::new(64, 64));
        let grid = Grid::dense(&map, 16, 8).expect("fits");
        assert_eq!(preselect(&map, &grid, Attention::Harris, 1.0, 3), [1, 2, 3]);
    }

    #[test]
    fn any_scale_and_the_smallest_map_have_a_response() {
        let point = Map::from_luminance("point", GrayImage::new(1, 1));
        let line = Map::from_luminance("line", GrayImage::new(300, 1));
        for map in [&point, &line] {
            for scale in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1.0, 1e9] {
                for attention in ALL {
                    let response = attention.response(map, scale);
                    assert_eq!(response.values().len() as u32, map.width());
                }
            }
        }
    }
}
