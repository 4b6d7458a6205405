//! `compare`: which selection is better for a map, and how much do selections agree?

use std::io::{self, Write};

use anyhow::Context;
use clap::Args;
use eigenmark::{
    evaluate::{Comparison, REPORT_DIMENSIONS, compare_selections},
    map::Map,
    output::Progress,
    select::{Method, Selection, Stability},
    train::learn,
};

use super::{
    print_json,
    settings::{BestArgs, SettingsArgs},
};

/// Compare the ways to select landmarks: how large their radii are, and how much they agree
#[derive(Debug, Args)]
pub struct Cmd {
    /// Aerial map: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    #[command(flatten)]
    settings: SettingsArgs,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    best: BestArgs,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let best = self.best.by(Method::Profile);
        let settings = self.settings.settings(Selection::Best(best.clone()))?;
        let map = Map::open(&self.map)?;
        let settings = self
            .settings
            .counted(&map, settings)
            .with_context(|| self.map.clone())?;
        let most = REPORT_DIMENSIONS.into_iter().fold(0, usize::max);
        let progress = Progress::Stderr;
        let (candidates, model) =
            learn(&map, &settings, most, &progress).with_context(|| self.map.clone())?;
        let seed = self.best.seed;
        let comparison =
            compare_selections(&map, &candidates, &model, &settings, &best, seed, &progress)
                .with_context(|| self.map.clone())?;
        let mut out = io::stdout().lock();
        if self.json {
            return print_json(&mut out, &comparison);
        }
        print(&mut out, &self.map, &comparison)
    }
}

fn print(out: &mut impl Write, map: &str, comparison: &Comparison) -> anyhow::Result<()> {
    writeln!(
        out,
        "{map}: {} landmarks of {} views, {} dimensions ({:.1} % of the variance)",
        comparison.landmarks,
        comparison.kept,
        comparison.dims,
        100.0 * comparison.covered_variance
    )?;

    writeln!(
        out,
        "\n{:<12} smallest radius  mean radius  views",
        "method"
    )?;
    for selection in &comparison.selections {
        let views: Vec<String> = selection.landmarks.iter().map(u32::to_string).collect();
        writeln!(
            out,
            "{:<12} {:>15.5}  {:>11.5}  {}",
            selection.method,
            selection.smallest_radius,
            selection.mean_radius,
            views.join(", ")
        )?;
    }

    write!(out, "\n{:<12}", "in common")?;
    for selection in &comparison.selections {
        write!(out, " {:>11}", selection.method)?;
    }
    writeln!(out)?;
    for (selection, overlaps) in comparison.selections.iter().zip(&comparison.overlaps) {
        write!(out, "{:<12}", selection.method)?;
        for overlap in overlaps {
            write!(out, " {overlap:>11.2}")?;
        }
        writeln!(out)?;
    }
    print_across(out, comparison)
}

/// One line per number of dimensions and the next.
fn print_across(out: &mut impl Write, comparison: &Comparison) -> anyhow::Result<()> {
    let across = &comparison.across;
    let (Some(profile), Some(reliable)) = (&across.profile, &across.reliable) else {
        return Ok(());
    };
    writeln!(
        out,
        "\n{:<12} kendall's tau  spearman's rho  profile in common  reliable in common",
        "dimensions"
    )?;
    let line = |out: &mut dyn Write, name: &str, numbers: [f64; 4]| {
        let [tau, rho, profile, reliable] = numbers;
        writeln!(
            out,
            "{name:<12} {tau:>13.2}  {rho:>14.2}  {profile:>17.2}  {reliable:>18.2}"
        )
    };
    for (index, pair) in across.dims.windows(2).enumerate() {
        let in_common = |stability: &Stability| stability.overlaps[index][index + 1];
        let numbers = [
            across.kendall_tau[index],
            across.spearman_rho[index],
            in_common(profile),
            in_common(reliable),
        ];
        line(out, &format!("{} and {}", pair[0], pair[1]), numbers)?;
    }
    let mean = |numbers: &[f64]| numbers.iter().sum::<f64>() / numbers.len() as f64;
    let means = [
        mean(&across.kendall_tau),
        mean(&across.spearman_rho),
        profile.mean_of_neighbors,
        reliable.mean_of_neighbors,
    ];
    line(out, "mean", means)?;
    writeln!(
        out,
        "\nAn ipca ranking depends on the dimensions only through its start list."
    )?;
    Ok(())
}
