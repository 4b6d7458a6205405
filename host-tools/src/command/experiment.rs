//! `experiment`: the report's experiments on a map.

use std::{
    io::{self, Write},
    path::PathBuf,
};

use anyhow::{Context, ensure};
use clap::{Args, value_parser};
use eigenmark::{
    experiment::{
        Asked, Grid, Plan, REPORT_BLURS, REPORT_SCALES, SEED, claims, claims::Claim, run,
        segmentation::Segmented, write_csv_files,
    },
    learn::Settings,
    map::{MAX_COLORS, Map, open_color},
    output::{Progress, check_directory, create_dir, write_file},
    report::{Explorer, experiment_report},
};
use serde_json::json;

use super::{choices::BlurChoice, print_json, settings};

/// Views per row of the map, when nothing else is said: the report's.
const COLUMNS: u32 = 8;

/// Pixels per side of a view, at least.
const LEAST_SIDE: u32 = 4;

/// Run the report's experiments on a map: every scale, blur, dimension and selection; as a page to look at, CSV and JSON
#[derive(Debug, Args)]
#[command(
    after_help = "What was computed is kept in DIR/cells: another run computes only what has changed, and an interrupted \
                        one goes on. One cell again: --scales 10 --blurs gauss1 --fresh."
)]
pub struct Cmd {
    /// Aerial map: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    /// Where to write the report, the tables, and what the next run need not compute again
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Side of a view's footprint, in map pixels [default: an eighth of the map's width]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..))]
    view_size: Option<u32>,
    /// Scale factors to compute: map pixels per view pixel [default: table 3.1 of the report, 1 to 20]
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = settings::scale)]
    scales: Vec<f64>,
    /// Blurs to compute [default: all]
    #[arg(long, value_name = "B,…", value_delimiter = ',', value_enum)]
    blurs: Vec<BlurChoice>,
    /// Landmarks of each selection
    #[arg(long, value_name = "L", default_value_t = 8, value_parser = value_parser!(u32).range(2..))]
    landmarks: u32,
    /// Colors of the segmentation whose effect is measured; 0 for none
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = colors)]
    colors: usize,
    /// Compute the cells that are asked for again, even when they are known
    #[arg(long)]
    fresh: bool,
    /// Print the claims and what was written as JSON
    #[arg(long)]
    json: bool,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        check_directory(&self.out)?;
        let map = &Map::open(&self.map)?;
        let picture = open_color(&self.map)?;
        let size = self.view_size.unwrap_or((map.width() / COLUMNS).max(1));
        let plan = Plan::report(map, size, self.landmarks).with_context(|| self.map.clone())?;
        let asked = self.asked(&plan.settings)?;
        let provenance = self.provenance(map, size);
        let progress = Progress::Stderr;
        create_dir(&self.out)?;
        let cells = self.out.join("cells");
        let grid = run(map, &plan, &asked, &cells, &provenance, &progress)
            .with_context(|| self.map.clone())?;
        let segmented = (self.colors > 0)
            .then(|| {
                let kept = (cells.as_path(), provenance.as_str());
                Segmented::measure(
                    map,
                    &picture,
                    &plan,
                    self.colors,
                    kept,
                    self.fresh,
                    &progress,
                )
            })
            .transpose()
            .with_context(|| self.map.clone())?;
        let claims = claims::judge(&grid);
        let provenance = format!("{provenance} · {} cells", grid.cells.len());

        let step = progress.step("writing the report");
        let explorer = Explorer {
            map,
            picture: Some(&picture.into()),
            grid: &plan.settings.grid(map)?,
            plan: &plan,
            cells: &grid.cells,
            claims: &claims,
            segmentation: segmented.as_ref(),
        };
        let page = experiment_report(&explorer, &provenance);
        let path = self.out.join("report.html");
        write_file(&path, |file| file.write_all(page.as_bytes()))?;
        write_csv_files(&self.out, &grid, &claims, segmented.as_ref(), &provenance)?;
        self.write_claims(&claims, &provenance)?;
        self.write_json(&grid, &claims, segmented.as_ref(), &provenance)?;
        drop(step);
        self.print(&grid, &claims)
    }

    /// The cells to compute.
    fn asked(&self, settings: &Settings) -> anyhow::Result<Asked> {
        let side = |scale: f64| {
            Settings {
                scale,
                ..settings.clone()
            }
            .view_side()
        };
        let scales = if self.scales.is_empty() {
            REPORT_SCALES
                .into_iter()
                .filter(|&scale| side(scale) >= LEAST_SIDE)
                .collect()
        } else {
            self.scales.clone()
        };
        for &scale in &scales {
            ensure!(
                side(scale) >= LEAST_SIDE,
                "{}: a view of {} map pixels has {} pixels per side at scale {scale}; expected {LEAST_SIDE} at least",
                self.map,
                settings.view_size_px,
                side(scale)
            );
        }
        let blurs = match &self.blurs[..] {
            [] => REPORT_BLURS.to_vec(),
            some => some.iter().map(|&blur| blur.into()).collect(),
        };
        Ok(Asked {
            scales,
            blurs,
            is_fresh: self.fresh,
        })
    }

    /// How to make the files again.
    fn provenance(&self, map: &Map, size: u32) -> String {
        format!(
            "eigenmark {} · eigenmark experiment --map {} --view-size {size} --landmarks {} --colors {} · map {}×{}, CRC \
             {:08x} · seed {}",
            env!("CARGO_PKG_VERSION"),
            map.title(),
            self.landmarks,
            self.colors,
            map.width(),
            map.height(),
            map.crc(),
            SEED
        )
    }

    fn write_claims(&self, claims: &[Claim], provenance: &str) -> anyhow::Result<()> {
        let table = claims::markdown(claims);
        write_file(&self.out.join("claims.md"), |file| {
            write!(file, "# Claims of the report\n\n{table}\n{provenance}\n")
        })?;
        Ok(())
    }

    fn write_json(
        &self,
        grid: &Grid,
        claims: &[Claim],
        segmented: Option<&Segmented>,
        provenance: &str,
    ) -> anyhow::Result<()> {
        let cells = grid.cells.iter().map(|cell| {
            let tables = cell.tables.iter().map(|(method, by_dims)| {
                let of_dims = cell.dims.iter().zip(by_dims).map(|(k, table)| {
                    let table = table.as_ref();
                    let [nearest, guaranteed] = match table.map(|table| table.mean()) {
                        Some(means) => means.map(Some),
                        None => [None, None],
                    };
                    let landmarks = table.map(|table| &table.landmarks);
                    json!({"dims": k, "landmarks": landmarks, "nearest": nearest, "guaranteed": guaranteed})
                });
                (method.clone(), of_dims.collect())
            });
            json!({
                "scale": cell.scale, "blur": cell.blur, "side": cell.side,
                "tables": tables.collect::<serde_json::Map<_, _>>(),
            })
        });
        let all = json!({
            "provenance": provenance,
            "claims": claims,
            "segmentation": segmented.map(|found| json!({"palette": found.palette, "rows": found.rows})),
            "cells": cells.collect::<Vec<_>>(),
        });
        write_file(&self.out.join("experiment.json"), |file| {
            writeln!(file, "{all}")
        })?;
        Ok(())
    }

    fn print(&self, grid: &Grid, claims: &[Claim]) -> anyhow::Result<()> {
        let mut out = io::stdout().lock();
        let report = self.out.join("report.html");
        if self.json {
            let value = json!({
                "report": report, "cells": grid.cells.len(), "computed": grid.computed, "claims": claims,
            });
            return print_json(&mut out, &value);
        }
        let found = grid.cells.len();
        writeln!(
            out,
            "cells      {found}, of which {} were computed now",
            grid.computed
        )?;
        for claim in claims {
            let verdict = claims::verdict(claim.holds);
            let holding = claim
                .parts
                .iter()
                .filter(|part| part.holds == Some(true))
                .count();
            writeln!(
                out,
                "claim {:>2}   {verdict:<13} ({holding} of {} parts)  {}",
                claim.claim,
                claim.parts.len(),
                claim.statement
            )?;
        }
        writeln!(
            out,
            "wrote      {} (open it in a browser), CSV and JSON beside it",
            report.display()
        )?;
        Ok(())
    }
}

/// None, or as many as a segmentation takes.
fn colors(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Ok(0),
        Ok(colors) if (2..=MAX_COLORS).contains(&colors) => Ok(colors),
        _ => Err(format!("expected 0, or 2 to {MAX_COLORS} colors")),
    }
}
