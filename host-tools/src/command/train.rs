//! `train`: a map becomes an atlas.

use std::{
    io,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap::{Args, value_parser};
use eigenmark::{
    atlas::Summary,
    learn::{Rows, Selection, Settings},
    map::Map,
    output::{Progress, check_directory, check_target, create_dir, write_file, write_npy},
    select::dissimilarity,
    train::{Trained, train},
};
use serde_json::json;

use super::{
    choices::{BlurChoice, MetricChoice, NormalizeChoice, SelectChoice, WidthChoice},
    inspect, print_json,
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
    /// Map pixels per view pixel: 10 is the report's scale factor 1/10
    #[arg(long, default_value_t = 10.0, value_parser = scale)]
    scale: f64,
    /// Gaussian blur of the views
    #[arg(long, value_enum, default_value = "gauss1")]
    blur: BlurChoice,
    /// Dimensions of the eigenspace
    #[arg(long, value_name = "K", default_value_t = 15, value_parser = value_parser!(u8).range(1..=128))]
    dims: u8,
    /// Number of landmarks [default: 8]
    #[arg(long, value_name = "L", value_parser = value_parser!(u32).range(1..))]
    landmarks: Option<u32>,
    /// Which views become landmarks
    #[arg(long, value_enum, default_value = "profile")]
    select: SelectChoice,
    /// Side of a view's footprint, in map pixels
    #[arg(long, value_name = "PX", default_value_t = 200, value_parser = value_parser!(u32).range(1..))]
    view_size: u32,
    /// Distance between views in map pixels [default: the report's layout, side by side and on the corners]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..))]
    stride: Option<u32>,
    /// Contrast normalization of every view
    #[arg(long, value_enum, default_value = "none")]
    normalize: NormalizeChoice,
    /// Subtract a Gaussian blur of this sigma, in view pixels
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0, value_parser = not_negative)]
    highpass: f64,
    /// Multiply coefficients by λ^(−ALPHA/2)
    #[arg(long, value_name = "ALPHA", default_value_t = 0.0, value_parser = whitening)]
    whiten: f64,
    /// How views are compared
    #[arg(long, value_enum, default_value = "nssd")]
    metric: MetricChoice,
    /// Width of the landmarks' coefficients
    #[arg(long, value_enum, default_value = "i16")]
    coefficients: WidthChoice,
    /// Also write views, eigenspace, distances and ranking as NumPy files into this directory
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Print what was made as JSON
    #[arg(long)]
    json: bool,
}

/// The largest distance matrix that is exported: 8192² numbers are 512 MiB.
const MAX_EXPORTED_VIEWS: u32 = 8192;

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        let settings = self.settings()?;
        check_target(&self.out)?;
        if let Some(directory) = &self.export {
            check_directory(directory)?;
        }
        let map = Map::open(&self.map)?;
        if self.export.is_some() {
            let views = settings
                .grid(&map)
                .with_context(|| self.map.clone())?
                .count();
            ensure!(
                views <= MAX_EXPORTED_VIEWS,
                "--export writes a distance matrix of at most {MAX_EXPORTED_VIEWS} views, this map has {views}; raise --stride"
            );
        }
        let with_profile = self.export.is_some();
        let trained = train(&map, &settings, with_profile, &Progress::Stderr)
            .with_context(|| self.map.clone())?;

        if let Some(directory) = &self.export {
            export(&trained, &settings, directory)?;
        }
        write_file(&self.out, |file| file.write_all(trained.atlas.bytes()))?;

        let mut out = io::stdout().lock();
        let summary = Summary::of(&trained.atlas());
        if self.json {
            return print_json(&mut out, &summary);
        }
        inspect::print(&mut out, &self.out, &summary)
    }

    fn settings(&self) -> anyhow::Result<Settings> {
        let selection = match (self.select, self.landmarks) {
            (SelectChoice::Profile, landmarks) => Selection::Profile {
                landmarks: landmarks.unwrap_or(8),
            },
            (SelectChoice::All, None) => Selection::All,
            (SelectChoice::All, Some(_)) => {
                anyhow::bail!("--landmarks has no meaning with --select all")
            }
        };
        Ok(Settings {
            scale: self.scale,
            blur: self.blur.into(),
            dimensions: self.dims,
            selection,
            view_size_px: self.view_size,
            stride_px: self.stride,
            normalize: self.normalize.into(),
            highpass_px: self.highpass,
            whiten: self.whiten,
            metric: self.metric.into(),
            width: self.coefficients.into(),
        })
    }
}

/// Everything training computed, one row per candidate.
fn export(trained: &Trained, settings: &Settings, directory: &Path) -> anyhow::Result<()> {
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
    let mut distances =
        rows().flat_map(|a| rows().map(move |b| dissimilarity(settings.metric, a, b)));
    write("distances.npy", &[n, n], &mut distances)?;
    let places =
        (1..=trained.candidates.grid().count()).map(|view| trained.candidates.grid().place(view));
    write(
        "places.npy",
        &[n, 2],
        &mut places.flat_map(|place| [place.x_px.into(), place.y_px.into()]),
    )?;
    let Some((profile, ranking)) = &trained.profile else {
        return Ok(());
    };
    write("profile.npy", &[n], &mut profile.iter().copied())?;
    let ranking = json!({
        "ranking": ranking,
        "landmarks": trained.landmarks,
        "covered_variance": model.covered_variance(),
    });
    write_file(&directory.join("ranking.json"), |file| {
        writeln!(file, "{ranking:#}")
    })?;
    Ok(())
}

fn scale(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(scale) if (1.0..=1000.0).contains(&scale) => Ok(scale),
        _ => Err("expected a number from 1 to 1000".to_owned()),
    }
}

fn whitening(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(alpha) if (0.0..=2.0).contains(&alpha) => Ok(alpha),
        _ => Err("expected a number from 0 to 2".to_owned()),
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if (0.0..=1000.0).contains(&number) => Ok(number),
        _ => Err("expected a number from 0 to 1000".to_owned()),
    }
}
