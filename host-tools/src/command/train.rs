//! `train`: a map becomes an atlas.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap::Args;
use eigenmark::{
    atlas::Summary,
    learn::{Rows, Settings, Space},
    map::{Map, open_color},
    output::{Progress, check_directory, check_target, create_dir, write_file, write_npy},
    report::{AtlasReport, atlas_cell, atlas_report},
    topology::{self, Network},
    train::{Shard, Trained, fold_shard, train},
};
use serde_json::json;

use super::{
    inspect, print_json,
    settings::{SelectionArgs, SettingsArgs},
};

/// Build an atlas from an aerial map
#[derive(Debug, Args)]
pub struct Cmd {
    /// Aerial map: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    /// Where to write the atlas
    #[arg(long, value_name = "ATLAS")]
    out: PathBuf,
    #[command(flatten)]
    settings: SettingsArgs,
    /// Only fold this share of the views, such as 2/4; --out is then a part for `merge`
    #[arg(long, value_name = "I/N", conflicts_with_all = ["export", "places"])]
    shard: Option<Shard>,
    /// Also write views, eigenspace, distances and ranking as NumPy files into this directory
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Also write what there is to see of it as a page: views, eigenspace, distances, landmarks and what they tolerate
    #[arg(long, value_name = "HTML", conflicts_with = "shard")]
    report: Option<PathBuf>,
    #[command(flatten)]
    places: PlacesArgs,
    /// Print what was made as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    selection: SelectionArgs,
}

/// Where the places of the topological map come from.
#[derive(Debug, Args)]
pub struct PlacesArgs {
    /// Places and legs of the topological map: auto (landmarks that are recognized in flight, half a view apart), none, or
    /// a JSON file as `route --json` prints it [default: auto with --stride, else none]
    #[arg(long, value_name = "auto|none|FILE")]
    places: Option<String>,
}

/// The topological map that is asked for.
#[derive(Debug)]
pub enum Places {
    /// None.
    None,
    /// To be found when the atlas is there.
    Auto,
    /// What a file says.
    Given(Network),
}

impl PlacesArgs {
    /// Before long work: reads the file, if there is one.
    pub fn read(&self, map: &Map, settings: &Settings) -> anyhow::Result<Places> {
        let default = match settings.stride_px {
            Some(_) => "auto",
            None => "none",
        };
        Ok(match self.places.as_deref().unwrap_or(default) {
            "none" => Places::None,
            "auto" => Places::Auto,
            file => {
                let map_px = (map.width(), map.height());
                let footprint_px = settings.view_size_px as f32;
                Places::Given(topology::read(Path::new(file), map_px, footprint_px)?)
            }
        })
    }
}

impl Places {
    /// Adds them to what was trained.
    pub fn add_to(self, map: &Map, trained: &mut Trained) -> anyhow::Result<()> {
        let atlas = trained.atlas.atlas();
        let network = match self {
            Self::None => return Ok(()),
            Self::Auto => topology::lay_out(map, &atlas, &Progress::Stderr),
            Self::Given(network) => network,
        };
        let charted = network.add_to(&atlas)?;
        trained.atlas = charted;
        Ok(())
    }
}

/// The largest distance matrix that is exported: 8192² numbers are 512 MiB.
const MAX_EXPORTED_VIEWS: u32 = 8192;

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let selection = self.selection.selection(&self.settings)?;
        let settings = self.settings.settings(selection)?;
        check_target(&self.out)?;
        if let Some(report) = &self.report {
            ensure!(
                settings.is_nominal(),
                "--report shows views at one heading and the nominal altitude; leave it out, or --headings and --altitudes"
            );
            check_target(report)?;
        }
        let map = Map::open(&self.map)?;
        let settings = self
            .settings
            .counted(&map, settings)
            .with_context(|| self.map.clone())?;
        if let Some(shard) = self.shard {
            return self.fold(&map, &settings, shard);
        }
        if let Some(directory) = &self.export {
            check_export(&map, &settings, directory).with_context(|| self.map.clone())?;
        }
        let places = self.places.read(&map, &settings)?;
        let with_profile = self.export.is_some();
        let mut trained = train(&map, &settings, with_profile, &Progress::Stderr)
            .with_context(|| self.map.clone())?;
        places.add_to(&map, &mut trained)?;
        deliver(&trained, &self.out, self.export.as_deref(), self.json)?;
        if let Some(report) = &self.report {
            let summary = Summary::of(&trained.atlas());
            write_report(&self.map, &map, &summary, &space(&trained), "train", report)?;
        }
        Ok(())
    }

    /// Writes a part instead of an atlas.
    fn fold(&self, map: &Map, settings: &Settings, shard: Shard) -> anyhow::Result<()> {
        let part = fold_shard(map, settings, shard, &Progress::Stderr)
            .with_context(|| self.map.clone())?;
        let bytes = part.emit();
        write_file(&self.out, |file| file.write_all(&bytes))?;
        let mut out = io::stdout().lock();
        if self.json {
            let value = json!({
                "shard": shard.to_string(), "views": part.fold.count(), "bytes": bytes.len(),
            });
            return print_json(&mut out, &value);
        }
        writeln!(
            out,
            "{}: part {shard}, {} views, {} bytes",
            self.out.display(),
            part.fold.count(),
            bytes.len()
        )?;
        Ok(())
    }
}

/// What a trained atlas was made in.
pub fn space(trained: &Trained) -> Space {
    let Settings { whiten, metric, .. } = trained.settings;
    Space::new(
        trained.candidates.clone(),
        trained.model.clone(),
        whiten,
        metric,
    )
}

/// Writes the page of an atlas, made by `command` from the map that was opened as `name`.
pub fn write_report(
    name: &str,
    map: &Map,
    summary: &Summary,
    space: &Space,
    command: &str,
    path: &Path,
) -> anyhow::Result<()> {
    let cell =
        atlas_cell(map, summary, space, &Progress::Stderr).with_context(|| name.to_owned())?;
    let provenance = format!(
        "eigenmark {} · eigenmark {command} --map {} · map CRC {:08x} · settings {}",
        env!("CARGO_PKG_VERSION"),
        map.title(),
        map.crc(),
        serde_json::to_string(&summary.settings)?
    );
    let page = atlas_report(&AtlasReport {
        map,
        picture: Some(&open_color(name)?.into()),
        summary,
        space,
        cell: cell.as_ref(),
        trials: &[],
        flight: None,
        provenance: &provenance,
    });
    write_file(path, |file| file.write_all(page.as_bytes()))?;
    Ok(())
}

/// Writes the atlas, and what it was made from where that is asked for, and says what is in it.
pub fn deliver(
    trained: &Trained,
    path: &Path,
    directory: Option<&Path>,
    json: bool,
) -> anyhow::Result<()> {
    if let Some(directory) = directory {
        export(trained, directory)?;
    }
    write_file(path, |file| file.write_all(trained.atlas.bytes()))?;
    let mut out = io::stdout().lock();
    let summary = Summary::of(&trained.atlas());
    if json {
        return print_json(&mut out, &summary);
    }
    inspect::print(&mut out, path, &summary)
}

/// Before long work: whether the export could be written at all.
pub fn check_export(map: &Map, settings: &Settings, directory: &Path) -> anyhow::Result<()> {
    check_directory(directory)?;
    let views = settings.grid(map)?.count();
    ensure!(
        views <= MAX_EXPORTED_VIEWS,
        "--export writes a distance matrix of at most {MAX_EXPORTED_VIEWS} views, this map has {views}; raise --stride"
    );
    Ok(())
}

/// Everything training computed, one row per candidate.
fn export(trained: &Trained, directory: &Path) -> anyhow::Result<()> {
    create_dir(directory)?;
    let model = &trained.model;
    let (n, k, m) = (
        u64::from(trained.candidates.grid().count()),
        model.dimensions as u64,
        model.pixels as u64,
    );
    let write = |name: &str, shape: &[u64], values: &mut dyn Iterator<Item = f64>| {
        write_npy(&directory.join(name), shape, values)
    };
    let mut vectors = vec![0.0; trained.candidates.count() * model.pixels];
    trained.candidates.read(0, &mut vectors);
    write(
        "views.npy",
        &[n, m],
        &mut vectors.into_iter().map(f64::from),
    )?;
    write("mean.npy", &[m], &mut model.mean.iter().copied())?;
    write("basis.npy", &[k, m], &mut model.basis.iter().copied())?;
    write(
        "eigenvalues.npy",
        &[k],
        &mut model.eigenvalues.iter().copied().take(model.dimensions),
    )?;
    write(
        "spectrum.npy",
        &[model.eigenvalues.len() as u64],
        &mut model.eigenvalues.iter().copied(),
    )?;
    write(
        "coefficients.npy",
        &[n, k],
        &mut trained.coordinates.iter().copied(),
    )?;
    let rows = || trained.coordinates.chunks_exact(model.dimensions);
    let dissimilarity = trained.settings.dissimilarity();
    let mut distances = rows().flat_map(|a| rows().map(move |b| dissimilarity.between(a, b)));
    write("distances.npy", &[n, n], &mut distances)?;
    let places =
        (1..=trained.candidates.grid().count()).map(|view| trained.candidates.grid().place(view));
    write(
        "places.npy",
        &[n, 2],
        &mut places.flat_map(|place| [place.x_px.into(), place.y_px.into()]),
    )?;
    if !trained.settings.is_nominal() {
        let layers = (1..=trained.candidates.grid().count())
            .map(|view| trained.candidates.grid().candidate(view).layer);
        let headings = layers.clone().map(|layer| layer.heading_rad.into());
        write("headings.npy", &[n], &mut headings.into_iter())?;
        let altitudes = layers.map(|layer| layer.altitude_ratio.into());
        write("altitudes.npy", &[n], &mut altitudes.into_iter())?;
    }
    let Some(profiled) = &trained.selected.profiled else {
        return Ok(());
    };
    write("profile.npy", &[n], &mut profiled.values.iter().copied())?;
    // Of all views; landmarks are the first of it unless they are selected otherwise, preselected, or spaced.
    let ranking = json!({
        "dissimilarity": dissimilarity,
        "ranking": profiled.ranking,
        "landmarks": trained.selected.landmarks,
        "residuals": trained.selected.residuals,
        "covered_variance": model.covered_variance(),
    });
    write_file(&directory.join("ranking.json"), |file| {
        writeln!(file, "{ranking:#}")
    })?;
    Ok(())
}
