//! Many tables of landmarks in the same eigenspace, in any number of its dimensions, judged together.
//!
//! **Notation.** K dimensions of the space, k of a table; a the view's coordinates, b a landmark's, A and B their squared
//! norms; u landmarks of all tables together.
//!
//! **Method.** A view is projected once. Its products a·b with the landmarks of all tables grow dimension by dimension; at
//! each number of dimensions that a table has they are read, and make that table's nearest landmark.
//!
//! **Cost.** K·u multiplications per view and, per table, its landmarks; instead of a projection per table.

use std::collections::BTreeMap;

use eigenmark_core::landmark::Metric;

use crate::{
    atlas::radii,
    evaluate::{Verdict, nearest_of},
    learn::Space,
    select::{dissimilarity, nearness},
};

/// Far more than rounding makes of an nSSD.
const ROUNDING: f64 = 1e-6;

/// Some candidates as landmarks, in some dimensions.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Table {
    /// Dimensions, k.
    pub dimensions: usize,
    /// Candidate numbers (1-based), in any order.
    pub landmarks: Vec<u32>,
}

/// Tables of one space.
pub(super) struct Tables<'a> {
    space: &'a Space,
    /// Numbers of dimensions of tables, ascending.
    steps: Vec<usize>,
    /// Landmarks of all tables, ascending.
    members: Vec<u32>,
    /// Their coordinates: K rows of u.
    by_dimension: Vec<f64>,
    /// Their squared norms: a row of u for each of the steps.
    squared_norms: Vec<f64>,
    tables: Vec<Judged>,
}

/// A table as it is judged.
struct Judged {
    /// Which of the steps.
    step: usize,
    /// Its landmarks, as indices of members.
    members: Vec<usize>,
    radii: Vec<f32>,
}

/// Room for the judgement of a view.
pub(super) struct Scratch {
    /// By step: ‖a‖².
    squared_norms: Vec<f64>,
    /// By step, u products or nearnesses.
    nearnesses: Vec<f64>,
    /// The same of distances; NaN where none was needed.
    distances: Vec<f64>,
}

impl<'a> Tables<'a> {
    pub fn new(space: &'a Space, tables: &[Table]) -> Self {
        let mut steps: Vec<usize> = tables.iter().map(|table| table.dimensions).collect();
        steps.sort_unstable();
        steps.dedup();
        let mut members: Vec<u32> = tables.iter().flat_map(|t| t.landmarks.clone()).collect();
        members.sort_unstable();
        members.dedup();
        let most = steps.last().copied().unwrap_or(0);
        let by_dimension = (0..most)
            .flat_map(|d| members.iter().map(move |&view| space.point(view)[d]))
            .collect();
        let squared_norms = steps
            .iter()
            .flat_map(|&k| {
                members
                    .iter()
                    .map(move |&view| squared(&space.point(view)[..k]))
            })
            .collect();
        let coordinates: BTreeMap<usize, Vec<f64>> =
            steps.iter().map(|&k| (k, space.first(k))).collect();
        let judged = |table: &Table| {
            let k = table.dimensions;
            let index = |view: &u32| members.binary_search(view).expect("one of them");
            Judged {
                step: steps.binary_search(&k).expect("one of them"),
                members: table.landmarks.iter().map(index).collect(),
                radii: radii(space.metric, &coordinates[&k], k, &table.landmarks, 0.0),
            }
        };
        Self {
            space,
            tables: tables.iter().map(judged).collect(),
            by_dimension,
            squared_norms,
            steps,
            members,
        }
    }

    pub fn space(&self) -> &'a Space {
        self.space
    }

    pub fn count(&self) -> usize {
        self.tables.len()
    }

    /// Dimensions of table `table`, k.
    pub fn dimensions(&self, table: usize) -> usize {
        self.steps[self.tables[table].step]
    }

    /// Landmarks of all tables, ascending.
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// Whether candidate `view` is a landmark of table `table`.
    pub fn has(&self, table: usize, view: u32) -> bool {
        let index = self.members.binary_search(&view);
        index.is_ok_and(|index| self.tables[table].members.contains(&index))
    }

    pub fn scratch(&self) -> Scratch {
        let len = self.steps.len() * self.members.len();
        Scratch {
            squared_norms: vec![0.0; self.steps.len()],
            nearnesses: vec![0.0; len],
            distances: vec![0.0; len],
        }
    }

    /// Prepares the judgement of a view by tables of no more dimensions than these coordinates.
    pub fn look(&self, coordinates: &[f64], scratch: &mut Scratch) {
        let u = self.members.len();
        let mut products = vec![0.0; u];
        let mut squared_norm = 0.0;
        let mut from = 0;
        let steps = self
            .steps
            .iter()
            .zip(scratch.nearnesses.chunks_exact_mut(u));
        for ((&to, out), (norm, other_norms)) in steps.zip(
            scratch
                .squared_norms
                .iter_mut()
                .zip(self.squared_norms.chunks_exact(u)),
        ) {
            if to > coordinates.len() {
                break;
            }
            let rows = self.by_dimension[from * u..to * u].chunks_exact(u);
            for (g, row) in coordinates[from..to].iter().zip(rows) {
                squared_norm += g * g;
                for (product, h) in products.iter_mut().zip(row) {
                    *product += g * h;
                }
            }
            *norm = squared_norm;
            for ((near, &product), &other) in out.iter_mut().zip(&products).zip(other_norms) {
                *near = nearness(self.space.metric, product, squared_norm, other);
            }
            from = to;
        }
        scratch.distances.fill(f64::NAN);
    }

    /// What table `table` says of the view that was looked at. Its landmark is the candidate's number, 0-based.
    pub fn verdict(&self, table: usize, coordinates: &[f64], scratch: &mut Scratch) -> Verdict {
        let Judged {
            step,
            members,
            radii,
        } = &self.tables[table];
        let (k, row) = (self.steps[*step], step * self.members.len());
        let Scratch {
            squared_norms,
            nearnesses,
            distances,
        } = scratch;
        let mut distance = |member: usize| {
            let distance = &mut distances[row + member];
            if distance.is_nan() {
                let other = &self.space.point(self.members[member])[..k];
                *distance = dissimilarity(self.space.metric, &coordinates[..k], other);
            }
            *distance
        };
        let near = members.iter().map(|member| nearnesses[row + member]);
        // Of most views one landmark is the nearest by far, and farther away than its radius by far.
        if let (Metric::Nssd, Some((index, near))) =
            (self.space.metric, clearly_nearest(near.clone()))
        {
            let (member, radius) = (members[index], f64::from(radii[index]));
            let about = 0.5 - near;
            let is_guaranteed = if (about - radius).abs() > ROUNDING {
                about < radius
            } else {
                distance(member) < radius
            };
            return Verdict {
                landmark: self.members[member] - 1,
                is_strict: true,
                is_guaranteed,
            };
        }
        let nearest = nearest_of(near, squared_norms[*step], |index| distance(members[index]));
        Verdict {
            landmark: self.members[members[nearest.index]] - 1,
            is_strict: nearest.is_strict,
            is_guaranteed: nearest.distance < f64::from(radii[nearest.index]),
        }
    }
}

/// The index and value of the greatest nearness in nSSD, which is between −½ and ½, when no other comes close.
fn clearly_nearest(nearnesses: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    let (mut best, mut greatest, mut second) = (0, f64::NEG_INFINITY, f64::NEG_INFINITY);
    for (index, near) in nearnesses.enumerate() {
        if near > greatest {
            (best, second, greatest) = (index, greatest, near);
        } else if near > second {
            second = near;
        }
    }
    (greatest - second > ROUNDING).then_some((best, greatest))
}

fn squared(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum()
}
