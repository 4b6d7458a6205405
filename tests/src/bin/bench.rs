//! Our side of `tests/peers/benchmark.py`: reads vectors from a NumPy file, computes a few times, prints the best time,
//! the peak memory and the result as one JSON object.
//!
//! ```text
//! bench candidates MAP VIEW_PX SCALE STRIDE_PX EVERY OUT   every so many candidates of a map; stride 0: the report's layout
//! bench coordinates VECTORS OUT                            their coordinates in 15 dimensions
//! bench pca VECTORS REPETITIONS                            the first 15 eigenvalues
//! bench profile COORDINATES REPETITIONS                    the first 50 of the profile ranking
//! bench ipca|ipca-literal VECTORS REPETITIONS LANDMARKS    the IPCA ranking from candidates 1, 2, 3
//! ```

use std::{
    fs::{self, File},
    io::BufReader,
    path::Path,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use eigenmark::{
    learn::{Candidates, Matrix, Model, Preprocess, Rows, Settings},
    map::Map,
    output::{write_file, write_npy},
    select::{
        Dissimilarity, Eligible, Order, Profile, Route, Until, rank_by_ipca, rank_by_ipca_literally,
    },
};
use npyz::WriterBuilder;
use serde::Serialize;
use serde_json::json;

/// Dimensions, k.
const DIMENSIONS: usize = 15;

/// Best candidates of the profile ranking that are compared.
const BEST: usize = 50;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["candidates", map, view_px, scale, stride_px, every, out] => {
            let settings = Settings {
                view_size_px: view_px.parse()?,
                scale: scale.parse()?,
                stride_px: Some(stride_px.parse()?).filter(|&stride_px| stride_px > 0),
                ..Settings::default()
            };
            candidates(map, &settings, every.parse()?, Path::new(out))
        }
        ["coordinates", vectors, out] => {
            let (vectors, pixels) = read::<f32>(vectors)?;
            let rows = Matrix::new(&vectors, pixels);
            let coordinates = Model::learn(&rows, DIMENSIONS)?.project(&rows);
            let shape = [rows.count() as u64, DIMENSIONS as u64];
            write_npy(Path::new(out), &shape, coordinates)?;
            say(&json!({}), Duration::ZERO)
        }
        ["pca", vectors, repetitions] => {
            let (vectors, pixels) = read::<f32>(vectors)?;
            let rows = Matrix::new(&vectors, pixels);
            timed(repetitions, || {
                let model = Model::learn(&rows, DIMENSIONS)?;
                std::hint::black_box(model.project(&rows));
                Ok(model.eigenvalues[..DIMENSIONS].to_vec())
            })
        }
        ["profile", coordinates, repetitions] => {
            let (points, dimensions) = read::<f64>(coordinates)?;
            timed(repetitions, || {
                let profile = Profile::new(Dissimilarity::Nssd, &points, dimensions, Route::Fast);
                Ok(profile.rank(Order::MostDissimilar, BEST).candidates)
            })
        }
        [
            what @ ("ipca" | "ipca-literal"),
            vectors,
            repetitions,
            landmarks,
        ] => {
            let (vectors, pixels) = read::<f32>(vectors)?;
            let rows = Matrix::new(&vectors, pixels);
            let eligible = Eligible::all(rows.count() as u32);
            let until = Until::landmarks(landmarks.parse()?);
            timed(repetitions, || {
                let ranked = if what == "ipca" {
                    rank_by_ipca(&rows, &eligible, &[1, 2, 3], until)
                } else {
                    rank_by_ipca_literally(&rows, &eligible, &[1, 2, 3], until)
                };
                Ok(ranked?.ranking)
            })
        }
        _ => bail!("unknown arguments {arguments:?}; see tests/src/bin/bench.rs"),
    }
}

fn candidates(map: &str, settings: &Settings, every: usize, out: &Path) -> Result<()> {
    let map = Map::open(map)?;
    let preprocess = Preprocess::new(
        settings.view_side() as usize,
        settings.normalize,
        settings.blur,
        settings.highpass_px,
    );
    let rows = Candidates::new(&map, &settings.grid(&map)?, &preprocess)?;
    let chosen: Vec<usize> = (0..rows.count()).step_by(every.max(1)).collect();
    let shape = [chosen.len() as u64, rows.pixels() as u64];
    write_file(out, |file| {
        let options = npyz::WriteOptions::new().default_dtype().shape(&shape);
        let mut writer = options.writer(file).begin_nd()?;
        let mut row = vec![0.0_f32; rows.pixels()];
        for &first in &chosen {
            rows.read(first, &mut row);
            writer.extend(row.iter().copied())?;
        }
        writer.finish()
    })?;
    say(&json!({}), Duration::ZERO)
}

/// A matrix, row by row, and its number of columns.
fn read<T: npyz::Deserialize>(path: &str) -> Result<(Vec<T>, usize)> {
    let file = File::open(path).with_context(|| path.to_owned())?;
    let array = npyz::NpyFile::new(BufReader::new(file))?;
    let columns = *array.shape().last().context("a matrix")? as usize;
    Ok((array.into_vec()?, columns))
}

fn timed<T: Serialize>(repetitions: &str, compute: impl Fn() -> Result<T>) -> Result<()> {
    let mut best = Duration::MAX;
    let mut result = None;
    for _ in 0..repetitions.parse::<u32>()?.max(1) {
        let start = Instant::now();
        result = Some(compute()?);
        best = best.min(start.elapsed());
    }
    say(&json!(result), best)
}

fn say(result: &serde_json::Value, best: Duration) -> Result<()> {
    let line = json!({"seconds": best.as_secs_f64(), "peak_mib": peak_mib()?, "result": result});
    println!("{line}");
    Ok(())
}

/// The most memory this process ever had.
fn peak_mib() -> Result<f64> {
    let status = fs::read_to_string("/proc/self/status")?;
    let peak = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"))
        .context("the system says how much memory there was")?;
    Ok(peak.trim().parse::<f64>()? / 1024.0)
}
