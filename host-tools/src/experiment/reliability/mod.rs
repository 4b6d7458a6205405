//! How far the landmarks of many tables can be trusted, all at once: report section 3.5 for a whole grid of dimensions,
//! methods and blurs.
//!
//! **What.** The same as [`evaluate`](crate::evaluate::evaluate()) with one [`Exact`](crate::evaluate::Exact) per table:
//! limits of orientation, altitude and gamma, and catchments, by both criteria.
//!
//! **Method.** A view of the map is rendered once for all spaces of the same scale, and projected once for all tables of a
//! space (`tables`). Catchments are counted as in the report, where the map itself was reduced: at positions around the
//! landmark that are a view pixel apart, not a map pixel, and a hundredth of the footprint at least.
//!
//! **Cost.** Four spaces of 82 dimensions, 150 tables each, of 83 views at scale 1 take minutes of processor time, at
//! scale 10 seconds. Two bytes per table and position: 512 MiB at most, or positions are farther apart.
//!
//! **Limits.** Coordinates of many views at once differ from those of one in the last bits.

mod tables;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::atomic::{AtomicU16, Ordering},
};

use rayon::prelude::*;

use crate::{
    dense::Dense,
    evaluate::{
        Criterion, Panel, Verdict,
        reliability::{Catchment, Limits, Measure, Observer, Reliability, Steps, spiral},
    },
    learn::{Space, scene_of},
    map::{Integral, Map},
    output::Bar,
    simulate::Camera,
};
use tables::Tables;

pub use tables::Table;

/// Views that are projected at once: a basis is read from memory once for all of them.
const BATCH: usize = 32;

/// Verdicts that are kept at once: 512 MiB.
const MOST_VERDICTS: usize = 256 << 20;

/// Positions per side of a footprint, at most: an area of a footprint is then known to 1/10000.
const PER_FOOTPRINT: u32 = 100;

/// What a landmark of a table tolerates, as the strict nearest neighbor and with a guarantee.
pub type ByCriterion = [Reliability; 2];

/// What the tables of one or more spaces tolerate: by space, by table, by landmark in the table's order. Spaces are of the
/// same map and scale.
///
/// # Panics
/// When a table names candidates or dimensions that its space has not, or the spaces' views differ in size.
#[must_use]
pub fn measure(
    map: &Map,
    spaces: &[(&Space, &[Table])],
    steps: Steps,
    bar: &Bar,
) -> Vec<Vec<Vec<ByCriterion>>> {
    let all: Vec<Tables<'_>> = spaces
        .iter()
        .map(|(space, tables)| Tables::new(space, tables))
        .collect();
    let together = Together(&all);
    let views: BTreeSet<u32> = all
        .iter()
        .flat_map(|tables| tables.members().to_vec())
        .collect();
    let views: Vec<u32> = views.into_iter().collect();
    // By view: by measure, by judge, by criterion.
    let limits: BTreeMap<u32, Vec<Vec<[Limits; 2]>>> = views
        .into_par_iter()
        .with_max_len(1)
        .map(|view| {
            let limits = together.limits(map, view, steps);
            bar.inc(1);
            (view, limits)
        })
        .collect();
    let map_px = u64::from(map.width()) * u64::from(map.height());
    let listed: Vec<&Table> = spaces
        .iter()
        .flat_map(|(_, tables)| tables.iter())
        .collect();
    let catchments = together.catchments(map, &listed);
    bar.inc(all.len() as u64);
    let mut first = 0;
    let mut found = Vec::with_capacity(all.len());
    for (tables, (_, of_space)) in all.iter().zip(spaces) {
        let of_table = |(index, table): (usize, &Table)| {
            let of_landmark = |&view: &u32| {
                [0, 1].map(|by| {
                    let limits = Measure::REPORT.into_iter().zip(&limits[&view]);
                    let limits = limits.map(|(m, limits)| (m, limits[first + index][by]));
                    Reliability::new(limits, catchments[&(first + index, view, by)], map_px)
                })
            };
            table.landmarks.iter().map(of_landmark).collect()
        };
        found.push(of_space.iter().enumerate().map(of_table).collect());
        first += tables.count();
    }
    found
}

/// The tables of all spaces, one after the other.
struct Together<'a>(&'a [Tables<'a>]);

impl Together<'_> {
    /// By measure, by table, by criterion; meaningless for tables that do not have the view.
    fn limits(&self, map: &Map, view: u32, steps: Steps) -> Vec<Vec<[Limits; 2]>> {
        let grid = self.0[0].space().candidates.grid();
        let camera = Camera::finest(grid.window_px());
        let mut observer = Observer::new(map, camera, self);
        Measure::REPORT
            .map(|measure| {
                observer.limits(measure, steps, view - 1, scene_of(&grid.candidate(view)))
            })
            .to_vec()
    }
}

impl Panel for Together<'_> {
    fn judges(&self) -> usize {
        self.0.iter().map(Tables::count).sum()
    }

    fn batch(&self) -> usize {
        BATCH
    }

    fn judge(
        &self,
        landmark: u32,
        asked: &[bool],
        frames: &[Integral],
        side_px: u32,
    ) -> Vec<Vec<Option<Verdict>>> {
        let side = self.0[0].space().side();
        let mut views = vec![0; frames.len() * side * side];
        for (frame, view) in frames.iter().zip(views.chunks_exact_mut(side * side)) {
            frame.reduce((0, 0), side_px, side, view);
        }
        let mut verdicts = vec![Vec::with_capacity(self.judges()); frames.len()];
        let mut asked = asked.iter();
        for tables in self.0 {
            let asked: Vec<usize> = (0..tables.count())
                .zip(&mut asked)
                .filter(|(table, is_asked)| **is_asked && tables.has(*table, landmark + 1))
                .map(|(table, _)| table)
                .collect();
            // Dimensions that nobody asks about are not computed.
            let most = asked.iter().map(|&table| tables.dimensions(table)).max();
            let projected = match most {
                Some(most) => tables.space().basis.project_all(&views, most),
                None => vec![None; frames.len()],
            };
            let mut scratch = tables.scratch();
            for (verdicts, coordinates) in verdicts.iter_mut().zip(&projected) {
                let mut said = vec![None; tables.count()];
                if let Some(coordinates) = coordinates {
                    tables.look(coordinates, &mut scratch);
                    for &table in &asked {
                        said[table] = Some(tables.verdict(table, coordinates, &mut scratch));
                    }
                }
                verdicts.extend(said);
            }
        }
        verdicts
    }
}

impl Together<'_> {
    /// Catchments by table, candidate and criterion; `listed` are the tables of all spaces.
    fn catchments(&self, map: &Map, listed: &[&Table]) -> BTreeMap<(usize, u32, usize), Catchment> {
        let space = self.0[0].space();
        let grid = space.candidates.grid();
        let window_px = grid.window_px();
        // Windows are reduced once for all spaces.
        let weights: Vec<&[f64]> = self
            .0
            .iter()
            .map(|one| one.space().basis.weights())
            .collect();
        let weights = weights.concat();
        let dense = Dense::new(map.luminance(), window_px, space.side(), &weights);
        let (columns, rows) = dense.positions();
        let views: BTreeSet<u32> = listed
            .iter()
            .flat_map(|table| table.landmarks.clone())
            .collect();
        let corners: Vec<(u32, u32)> = views.iter().map(|&view| grid.corner(view)).collect();
        let most = (MOST_VERDICTS / listed.len().max(1)) as f64;
        let (pitch_px, step_px) = steps(&dense, (window_px, space.side()), &corners, most);
        let phase_of = |(x, y): (u32, u32)| (x % step_px, y % step_px);
        let phases: BTreeSet<(u32, u32)> = corners.iter().copied().map(phase_of).collect();
        let mut found = BTreeMap::new();
        for phase in phases {
            let asked: Vec<(usize, u32)> = listed
                .iter()
                .enumerate()
                .flat_map(|(index, table)| table.landmarks.iter().map(move |&view| (index, view)))
                .filter(|(_, view)| phase_of(grid.corner(*view)) == phase)
                .collect();
            let mut involved: Vec<usize> = asked.iter().map(|(index, _)| *index).collect();
            involved.dedup();
            let lattice = Lattice {
                phase,
                step_px,
                pitch_px,
                columns: (columns - phase.0).div_ceil(step_px),
                rows: (rows - phase.1).div_ceil(step_px),
            };
            let said = lattice.ask(&dense, self.0, &involved);
            let of_one = |(index, view): (usize, u32)| {
                let slot = involved.binary_search(&index).expect("involved");
                let (x, y) = grid.corner(view);
                let start = [(x, phase.0), (y, phase.1)].map(|(at, phase)| (at - phase) / step_px);
                [0, 1].map(|by| {
                    let counted = spiral((lattice.columns, lattice.rows), start.into(), |x, y| {
                        let at = y as usize * lattice.columns as usize + x as usize;
                        let said = said[at * involved.len() + slot].load(Ordering::Relaxed);
                        Criterion::ALL[by].holds(unpacked(said), view - 1)
                    });
                    let area_px = counted.area_px * u64::from(step_px) * u64::from(step_px);
                    ((index, view, by), Catchment { area_px, ..counted })
                })
            };
            let of_phase: Vec<_> = asked.into_par_iter().flat_map_iter(of_one).collect();
            found.extend(of_phase);
        }
        found
    }
}

/// What positions are computed at, and what they are counted at, a multiple of that: about a view pixel apart, for whole ratios
/// up to a hundredth of the footprint, and so that the landmarks at `corners` share as many as can be. At most `most` are kept at once.
fn steps(
    dense: &Dense<'_>,
    (window_px, side): (u32, usize),
    corners: &[(u32, u32)],
    most: f64,
) -> (u32, u32) {
    let (columns, rows) = dense.positions();
    let ratio = f64::from(window_px) / side as f64;
    let pitch_px = dense.whole_ratio().unwrap_or(1);
    let wanted = match dense.whole_ratio() {
        Some(block_px) => block_px..=window_px.div_ceil(PER_FOOTPRINT).next_multiple_of(block_px),
        None => ((0.6 * ratio).ceil() as u32).max(1)..=((1.3 * ratio) as u32).max(1),
    };
    let positions = |step_px: u32| {
        let phases: BTreeSet<(u32, u32)> = corners
            .iter()
            .map(|(x, y)| (x % step_px, y % step_px))
            .collect();
        phases.len() as f64 / f64::from(step_px).powi(2)
    };
    let kept = |step_px: u32| f64::from(columns) * f64::from(rows) / f64::from(step_px).powi(2);
    // The finest of those that are as few.
    let step_px = wanted
        .filter(|step_px| step_px.is_multiple_of(pitch_px))
        .min_by(|&one, &other| positions(one).total_cmp(&positions(other)))
        .unwrap_or(pitch_px);
    let crowded = (kept(step_px) / most).sqrt().ceil().max(1.0) as u32;
    let pitch_px = dense.whole_ratio().unwrap_or(step_px);
    (pitch_px, step_px * crowded)
}

/// Positions that are as far apart as view pixels.
struct Lattice {
    phase: (u32, u32),
    step_px: u32,
    /// What positions are computed at: a divisor of the step.
    pitch_px: u32,
    columns: u32,
    rows: u32,
}

impl Lattice {
    /// What some tables of all spaces say of every position: by position, by table.
    fn ask(&self, dense: &Dense<'_>, all: &[Tables<'_>], involved: &[usize]) -> Vec<AtomicU16> {
        let len = self.columns as usize * self.rows as usize * involved.len();
        let mut said = Vec::new();
        said.resize_with(len, || AtomicU16::new(NOTHING));
        let first = (self.phase.0 % self.pitch_px, self.phase.1 % self.pitch_px);
        dense.project_lattice(first, self.pitch_px, |part| {
            let mut dots = vec![0.0; dense.rows()];
            let mut scratches: Vec<_> = all.iter().map(Tables::scratch).collect();
            for (index, &sums) in part.sums().iter().enumerate() {
                let (x, y) = part.corner(index);
                let [column, row] = [(x, self.phase.0), (y, self.phase.1)].map(|(at, phase)| {
                    let away = at.checked_sub(phase)?;
                    (away.is_multiple_of(self.step_px)).then(|| away / self.step_px)
                });
                let (Some(column), Some(row)) = (column, row) else {
                    continue;
                };
                part.dots(index, &mut dots);
                let at = (row as usize * self.columns as usize + column as usize) * involved.len();
                let mut slots = said[at..].iter().zip(involved).peekable();
                let (mut rest, mut first) = (dots.as_mut_slice(), 0);
                for (tables, scratch) in all.iter().zip(&mut scratches) {
                    let basis = &tables.space().basis;
                    let coordinates;
                    (coordinates, rest) = rest.split_at_mut(basis.dimensions());
                    let end = first + tables.count();
                    let has_contrast = basis.finish(sums, coordinates);
                    if has_contrast {
                        tables.look(coordinates, scratch);
                    }
                    while let Some((slot, &table)) = slots.next_if(|(_, table)| **table < end) {
                        if has_contrast {
                            let verdict = tables.verdict(table - first, coordinates, scratch);
                            // Every position is visited once.
                            slot.store(packed(verdict), Ordering::Relaxed);
                        }
                    }
                    first = end;
                }
            }
        });
        said
    }
}

/// There is nothing to go by.
const NOTHING: u16 = u16::MAX;

/// The most candidates that are compared: every pair is drawn, and k-means tries every number of clusters.
pub const MOST_CANDIDATES: u32 = 500;

fn packed(verdict: Verdict) -> u16 {
    (verdict.landmark as u16) << 2
        | u16::from(verdict.is_strict) << 1
        | u16::from(verdict.is_guaranteed)
}

fn unpacked(packed: u16) -> Option<Verdict> {
    (packed != NOTHING).then_some(Verdict {
        landmark: u32::from(packed >> 2),
        is_strict: packed & 2 != 0,
        is_guaranteed: packed & 1 != 0,
    })
}
