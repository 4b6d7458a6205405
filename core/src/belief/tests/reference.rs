//! The same filter, plainly: whole sums in double precision, every state from every state that it comes from.

use std::{vec, vec::Vec};

use micromath::F32Ext;

use super::super::{Belief, Cells, Estimate, Motion, Observation};
use crate::{atlas::Atlas, eigenspace::Coefficients, landmark::Point};

/// Where a fraction is this near to one half, single and double precision may round it to different cells.
const NEAR_HALF: f64 = 1e-3;

#[derive(Clone, Debug)]
pub(super) struct Reference {
    cells: Cells,
    pub weights: Vec<f64>,
    pub offsets: Vec<[f64; 2]>,
    pub heading_rad: f64,
    spread_px2: f64,
    spread_rad2: f64,
    way_px: f64,
    /// Whether a decision was so near that the belief may have taken the other one.
    pub is_close: bool,
}

impl Reference {
    /// A twin of a belief.
    pub fn of<const STATES: usize>(belief: &Belief<STATES>) -> Self {
        let headings = usize::from(belief.layers.cells.headings());
        let offsets = belief.layers.offsets.iter().take(headings);
        Self {
            cells: belief.layers.cells,
            weights: belief.weights().iter().copied().map(f64::from).collect(),
            offsets: offsets
                .map(|offset| [offset.x_px, offset.y_px].map(f64::from))
                .collect(),
            heading_rad: belief.layers.heading_rad.into(),
            spread_px2: belief.layers.spread_px2.into(),
            spread_rad2: belief.layers.spread_rad2.into(),
            way_px: belief.layers.way_px.into(),
            is_close: false,
        }
    }

    /// The grid's sizes: columns, rows, headings.
    fn sizes(&self) -> [i64; 3] {
        [
            self.cells.columns().into(),
            self.cells.rows().into(),
            self.cells.headings().into(),
        ]
    }

    /// The weight of a state; nothing beyond the grid, headings go round.
    fn at(&self, column: i64, row: i64, heading: i64) -> f64 {
        let [columns, rows, headings] = self.sizes();
        if !(0..columns).contains(&column) || !(0..rows).contains(&row) {
            return 0.0;
        }
        let index = (heading.rem_euclid(headings) * rows + row) * columns + column;
        self.weights[index as usize]
    }

    /// The weights that `of` says, state by state.
    fn each(&self, of: impl Fn(i64, i64, i64) -> f64) -> Vec<f64> {
        let [columns, rows, headings] = self.sizes();
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        (0..headings)
            .flat_map(|heading| {
                cells
                    .clone()
                    .map(move |(column, row)| (column, row, heading))
            })
            .map(|(column, row, heading)| of(column, row, heading))
            .collect()
    }

    fn rounded(&mut self, number: f64) -> i64 {
        self.is_close |= ((number - number.floor()) - 0.5).abs() < NEAR_HALF;
        number.round() as i64
    }

    pub fn predict(&mut self, motion: &Motion, heading_rad: f32) {
        let [_, _, headings] = self.sizes();
        let (forward, right) = (f64::from(motion.forward_px), f64::from(motion.right_px));
        let yaw = f64::from(motion.yaw_rad);
        let step = core::f64::consts::TAU / headings as f64;
        let side = f64::from(self.cells.side_px());
        let halfway = if headings == 1 {
            f64::from(heading_rad)
        } else {
            self.heading_rad + yaw / 2.0
        };
        let mut shifts = Vec::new();
        for index in 0..headings {
            // The belief's own sine, which is off by 0.002.
            let heading = crate::math::wrapped((halfway + step * index as f64) as f32);
            let sin = f64::from(F32Ext::sin(heading));
            let cos = f64::from(F32Ext::cos(heading));
            let [x, y] = self.offsets[index as usize];
            let moved = [
                x + forward * sin + right * cos,
                y - forward * cos + right * sin,
            ];
            let whole = moved.map(|along| self.rounded(along / side));
            self.offsets[index as usize] =
                [0, 1].map(|axis| moved[axis] - whole[axis] as f64 * side);
            shifts.push(whole);
        }
        self.weights = self.each(|column, row, heading| {
            let [right, down] = shifts[heading as usize];
            self.at(column - right, row - down, heading)
        });

        if headings == 1 {
            self.heading_rad = heading_rad.into();
        } else {
            let turned = self.heading_rad + yaw;
            let steps = self.rounded(turned / step);
            self.heading_rad = turned - steps as f64 * step;
            self.weights = self.each(|column, row, heading| self.at(column, row, heading - steps));
            let offsets = (0..headings).map(|heading| (heading - steps).rem_euclid(headings));
            self.offsets = offsets.map(|from| self.offsets[from as usize]).collect();
        }

        self.way_px += forward.hypot(right);
        if motion.carried_away >= 0.1 {
            self.way_px = f64::INFINITY;
        }
        self.spread(motion, step);
        self.normalize(motion.carried_away.into());
    }

    fn spread(&mut self, motion: &Motion, step: f64) {
        let [columns, rows, headings] = self.sizes();
        self.spread_px2 += f64::from(motion.variance_px2);
        self.spread_rad2 += f64::from(motion.variance_rad2);
        let mut share = self.spread_px2 / f64::from(self.cells.side_px()).powi(2);
        self.is_close |= (share - 0.05).abs() < 1e-6;
        if share >= 0.05 {
            self.spread_px2 = 0.0;
            for _ in 0..8 {
                let a = (share / 2.0).min(1.0 / 3.0);
                let kernel = [a, 1.0 - 2.0 * a, a];
                self.weights = self.each(|column, row, heading| {
                    let mut sum = 0.0;
                    for (down, vertical) in (-1..=1).zip(kernel) {
                        for (right, horizontal) in (-1..=1).zip(kernel) {
                            // What would leave stays at the border.
                            let column = (column + right).clamp(0, columns - 1);
                            let row = (row + down).clamp(0, rows - 1);
                            sum += vertical * horizontal * self.at(column, row, heading);
                        }
                    }
                    sum
                });
                share -= 2.0 * a;
                self.is_close |= (share - 0.05).abs() < 1e-6;
                if share < 0.05 {
                    break;
                }
            }
        }
        let share = self.spread_rad2 / (step * step);
        self.is_close |= (share - 0.05).abs() < 1e-6;
        if headings > 1 && share >= 0.05 {
            self.spread_rad2 = 0.0;
            let a = (share / 2.0).min(1.0 / 3.0);
            self.weights = self.each(|column, row, heading| {
                let [before, here, after] =
                    [-1, 0, 1].map(|turn| self.at(column, row, heading + turn));
                a * before + (1.0 - 2.0 * a) * here + a * after
            });
        }
    }

    pub fn observe(
        &mut self,
        atlas: &Atlas<'_>,
        coefficients: &Coefficients,
        observation: &Observation,
    ) {
        let likelihood = atlas.header().likelihood;
        let (sharpness, ceiling) = (
            f64::from(likelihood.sharpness),
            f64::from(likelihood.ceiling),
        );
        let side = f64::from(self.cells.side_px());
        let worth = (self.way_px / f64::from(observation.independent_px))
            .clamp(observation.least_worth.into(), 1.0);
        self.way_px = 0.0;
        let [columns, rows, headings] = self.sizes();
        let origin = self.cells.center(0, 0);
        let origin = [origin.x_px, origin.y_px].map(f64::from);
        let mut least = vec![ceiling; self.weights.len()];
        for (landmark, record) in atlas.landmarks().records().iter().enumerate() {
            let stored = atlas.landmarks().coefficients(landmark);
            let squares = stored
                .zip(coefficients.values())
                .map(|(a, &b)| f64::from(i32::from(a) - i32::from(b)).powi(2));
            let squared: f64 = squares.sum();
            let candidate = atlas.survey().find(record.view).expect("a candidate");
            let heading = i64::from(candidate.layer.index) % headings;
            let place = [candidate.place().x_px, candidate.place().y_px].map(f64::from);
            let [column, row] = [0, 1].map(|axis| {
                let offset = self.offsets[heading as usize][axis];
                self.rounded((place[axis] - offset - origin[axis]) / side)
            });
            // A point less than a cell beyond the grid counts to its border.
            if (-1..=columns).contains(&column) && (-1..=rows).contains(&row) {
                let (column, row) = (column.clamp(0, columns - 1), row.clamp(0, rows - 1));
                let index = ((heading * rows + row) * columns + column) as usize;
                least[index] = squared.min(least[index]);
            }
        }
        for (weight, squared) in self.weights.iter_mut().zip(least) {
            *weight *= (-sharpness * worth * squared).exp();
        }
        self.normalize(0.0);
    }

    pub fn estimate(&self, footprint_px: f32) -> Estimate {
        let [columns, rows, headings] = self.sizes();
        let side = f64::from(self.cells.side_px());
        let reach = ((f64::from(footprint_px) / side) as i64).max(1);
        let mut states = Vec::new();
        for heading in 0..headings {
            for row in 0..rows {
                for column in 0..columns {
                    let center = self.cells.center(column as u16, row as u16);
                    let [x, y] = self.offsets[heading as usize];
                    let at = [f64::from(center.x_px) + x, f64::from(center.y_px) + y];
                    states.push((self.at(column, row, heading), [column, row], at, heading));
                }
            }
        }
        // The first of the heaviest.
        let mut middle = &states[0];
        for state in &states {
            if state.0 > middle.0 {
                middle = state;
            }
        }
        let is_near =
            |cell: [i64; 2]| (0..2).all(|axis| (cell[axis] - middle.1[axis]).abs() <= reach);
        let near: Vec<_> = states.iter().filter(|state| is_near(state.1)).collect();
        let total: f64 = near.iter().map(|state| state.0).sum();
        let mean = |of: &dyn Fn([f64; 2]) -> f64| {
            near.iter().map(|state| state.0 * of(state.2)).sum::<f64>() / total
        };
        let (x, y) = (mean(&|at| at[0]), mean(&|at| at[1]));
        let within = side * side / 12.0;
        let step = core::f64::consts::TAU / headings as f64;
        let turned = |of: fn(f64) -> f64| -> f64 {
            near.iter()
                .map(|state| state.0 * of(step * state.3 as f64))
                .sum()
        };
        let heading = self.heading_rad + turned(f64::sin).atan2(turned(f64::cos));
        Estimate {
            position: Point {
                x_px: x as f32,
                y_px: y as f32,
            },
            covariance_px2: [
                (mean(&|at| (at[0] - x).powi(2)) + within) as f32,
                mean(&|at| (at[0] - x) * (at[1] - y)) as f32,
                (mean(&|at| (at[1] - y).powi(2)) + within) as f32,
            ],
            heading_rad: crate::math::wrapped(heading as f32),
            confidence: total as f32,
        }
    }

    fn normalize(&mut self, share: f64) {
        let total: f64 = self.weights.iter().sum();
        let even = 1.0 / self.weights.len() as f64;
        for weight in &mut self.weights {
            *weight = if total > 0.0 {
                *weight / total * (1.0 - share) + even * share
            } else {
                even
            };
        }
    }
}
