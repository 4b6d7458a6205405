//! A grid of cells: what is known is not computed again.

use std::path::Path;

use eigenmark_core::atlas::Blur;

use super::{Cell, ExperimentError, LearnError, Plan, cache::Cache, cell};
use crate::{
    learn::{Settings, blur_name},
    map::Map,
    output::{Progress, create_dir},
};

/// Which cells are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Map pixels per view pixel.
    pub scales: Vec<f64>,
    /// Blurs, at each of them.
    pub blurs: Vec<Blur>,
    /// Compute them even when they are known.
    pub is_fresh: bool,
}

/// The cells of a grid.
#[derive(Clone, Debug)]
pub struct Grid {
    /// What was found: by scale, then by blur.
    pub cells: Vec<Cell>,
    /// How many of them were computed now.
    pub computed: usize,
}

/// A cell's settings, and the cell if it is known.
type Known = (Settings, Option<Cell>);

/// Computes the cells that are asked for, a scale at a time, and keeps each in a file in `directory`. Other cells of the
/// report's grid that are known from before are in the result, too. An interrupted run loses one scale at most.
///
/// # Errors
/// When the map has no such candidates, or a file cannot be written.
pub fn run(
    map: &Map,
    plan: &Plan,
    asked: &Asked,
    directory: &Path,
    provenance: &str,
    progress: &Progress,
) -> Result<Grid, ExperimentError> {
    create_dir(directory)?;
    let cache = Cache::new(directory, map, plan, provenance);
    let is_asked = |settings: &Settings| {
        asked.scales.contains(&settings.scale) && asked.blurs.contains(&settings.blur)
    };
    let mut scales = [&asked.scales[..], &super::REPORT_SCALES].concat();
    scales.sort_by(f64::total_cmp);
    scales.dedup();
    let mut of_scales: Vec<(f64, Vec<Known>)> = Vec::new();
    for scale in scales {
        let of_blur = |blur| {
            let settings = Settings {
                scale,
                blur,
                ..plan.settings.clone()
            };
            let is_again = asked.is_fresh && is_asked(&settings);
            let cell = (!is_again).then(|| cache.cell(&settings)).flatten();
            (settings, cell)
        };
        of_scales.push((scale, super::REPORT_BLURS.map(of_blur).to_vec()));
    }
    let is_missing = |(settings, cell): &Known| cell.is_none() && is_asked(settings);
    let missing = |cells: &[Known]| cells.iter().filter(|one| is_missing(one)).count();
    let candidates = plan.settings.grid(map).map_err(LearnError::Grid)?.count();
    let parts = of_scales.iter().map(|(_, cells)| match missing(cells) {
        0 => 0,
        count => cell::parts(count, candidates),
    });
    let bar = progress.bar("grid", parts.sum());
    let mut grid = Grid {
        cells: Vec::new(),
        computed: 0,
    };
    for (scale, mut cells) in of_scales {
        let wanted: Vec<Settings> = cells
            .iter()
            .filter(|one| is_missing(one))
            .map(|(settings, _)| settings.clone())
            .collect();
        if !wanted.is_empty() {
            bar.say(format!("scale 1/{scale}"));
            let computed = cell::compute(map, plan, &wanted, &bar)?;
            grid.computed += computed.len();
            for (settings, cell) in wanted.iter().zip(computed) {
                cache.keep(settings, &cell)?;
                let slot = cells.iter_mut().find(|(of, _)| of.blur == settings.blur);
                if let Some((_, slot)) = slot {
                    *slot = Some(cell);
                }
            }
        }
        grid.cells
            .extend(cells.into_iter().filter_map(|(_, cell)| cell));
    }
    Ok(grid)
}

impl Grid {
    /// The cell of a scale and a blur.
    #[must_use]
    pub fn cell(&self, scale: f64, blur: Blur) -> Option<&Cell> {
        let mut cells = self.cells.iter();
        cells.find(|cell| cell.scale == scale && cell.blur == blur_name(blur))
    }
}
