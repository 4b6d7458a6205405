//! Our side of `tests/peers/benchmark.py`: reads vectors from a NumPy file, computes a few times, prints the best time,
//! the peak memory and the result as one JSON object.
//!
//! ```text
//! bench candidates MAP VIEW_PX SCALE STRIDE_PX EVERY OUT   every so many candidates of a map; stride 0: the report's layout
//! bench coordinates VECTORS OUT                            their coordinates in 15 dimensions
//! bench pca VECTORS REPETITIONS                            the first 15 eigenvalues
//! bench profile COORDINATES REPETITIONS                    the first 50 of the profile ranking
//! bench luminance MAP OUT                                 its pixels
//! bench eigenimages VECTORS OUT                            the first 15 eigenvectors
//! bench dense PIXELS REPETITIONS EIGENIMAGES               them at every position: largest, mean and some dots
//! bench ipca|ipca-literal VECTORS REPETITIONS LANDMARKS    the IPCA ranking from candidates 1, 2, 3
//! bench clusters COORDINATES SEED                         every dendrogram with its cuts; k-means and silhouettes
//! bench tracks MAP VIEW_PX FRAMES OUT                     frames of a flight; where it was, and corners in each of them
//! ```

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::BufReader,
    path::Path,
    sync::Mutex,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use eigenmark::{
    dense::Dense,
    learn::{Candidates, Matrix, Model, Preprocess, Rows, Settings},
    map::Map,
    output::{write_file, write_npy},
    select::{
        Dissimilarity, Eligible, Order, Profile, Route, Until,
        cluster::{Dendrogram, Linkage, Pairwise, k_means, silhouette_curve, silhouettes},
        rank_by_ipca, rank_by_ipca_literally,
    },
    simulate::{Camera, Scene, seeded},
};
use eigenmark_core::{landmark::Point, track::Odometry};
use image::GrayImage;
use npyz::WriterBuilder;
use serde::Serialize;
use serde_json::json;

/// Dimensions, k.
const DIMENSIONS: usize = 15;

/// Best candidates of the profile ranking that are compared.
const BEST: usize = 50;

/// One in so many dots of a dense projection is compared.
const DOTS: usize = 997;

/// Numbers of clusters that are compared, and as many as there are points.
const CLUSTERS: [usize; 6] = [1, 2, 8, 15, 40, 70];

/// Starts of k-means that are compared on average.
const STARTS: u64 = 10;

/// The way between two frames that are tracked, as a share of the footprint, and the noise of the sensor in gray levels.
const TRACKED_STEP: f64 = 0.02;
const TRACKED_NOISE: f64 = 1.0;

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
        ["luminance", map, out] => {
            let map = Map::open(map)?;
            let shape = [map.height(), map.width()].map(u64::from);
            let pixels = map.luminance().as_raw().iter();
            write_npy(Path::new(out), &shape, pixels.copied().map(f64::from))?;
            say(&json!({}), Duration::ZERO)
        }
        ["eigenimages", vectors, out] => {
            let (vectors, pixels) = read::<f32>(vectors)?;
            let model = Model::learn(&Matrix::new(&vectors, pixels), DIMENSIONS)?;
            let shape = [DIMENSIONS as u64, pixels as u64];
            write_npy(Path::new(out), &shape, model.basis)?;
            say(&json!({}), Duration::ZERO)
        }
        ["dense", pixels, repetitions, eigenimages] => {
            let (pixels, width) = read::<f64>(pixels)?;
            let height = pixels.len() / width;
            let pixels = pixels.iter().map(|&pixel| pixel as u8).collect();
            let picture = GrayImage::from_raw(width as u32, height as u32, pixels);
            let picture = picture.context("a picture")?;
            let (eigenimages, pixels) = read::<f64>(eigenimages)?;
            let (planes, best) = best_of(repetitions, || {
                Ok(planes(&picture, pixels.isqrt(), &eigenimages))
            })?;
            let largest = planes
                .iter()
                .fold(0.0, |most: f64, dot| most.max(dot.abs()));
            let mean = planes.iter().map(|dot| dot.abs()).sum::<f64>() / planes.len() as f64;
            let mut result = vec![largest, mean];
            result.extend(planes.iter().step_by(DOTS));
            say(&json!(result), best)
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
        ["clusters", coordinates, seed] => {
            let (points, dimensions) = read::<f64>(coordinates)?;
            clusters(&points, dimensions, seed.parse()?)
        }
        ["tracks", map, view_px, frames, out] => tracks(
            &Map::open(map)?,
            view_px.parse()?,
            frames.parse()?,
            Path::new(out),
        ),
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

/// Everything that can be said about groups of points; timed is the whole curve of silhouettes.
/// Flies across the middle of a map, turning and climbing, and tracks corners.
fn tracks(map: &Map, view_px: u32, frames: u32, out: &Path) -> Result<()> {
    let camera = Camera::square_of(view_px.into());
    let (mut frame, mut random) = (camera.frame(), seeded(1, 1));
    let mut odometry = Box::new(Odometry::whole());
    let (mut pixels, mut flight) = (Vec::new(), Vec::new());
    for number in 0..frames {
        let at = f64::from(number);
        let way = (at - f64::from(frames) / 2.0) * TRACKED_STEP * f64::from(view_px);
        let place = Point {
            x_px: (f64::from(map.width()) / 2.0 + 0.8 * way) as f32,
            y_px: (f64::from(map.height()) / 2.0 - 0.6 * way) as f32,
        };
        let scene = Scene {
            heading_rad: 0.9 + 0.15 * (at / 12.0).sin(),
            altitude_ratio: 1.0 + 0.04 * (at / 9.0).sin(),
            noise: TRACKED_NOISE,
            ..Scene::nominal(place)
        };
        camera.render(map, &scene, &mut random, &mut frame);
        let displacement = odometry.advance(&frame.as_frame(), None);
        pixels.extend_from_slice(&frame.pixels);
        let tracks = odometry.tracks().iter();
        let tracks: Vec<_> = tracks
            .map(|track| json!({"age": track.age, "at": track.at_px, "before": track.before_px}))
            .collect();
        flight.push(json!({
            "place": [place.x_px, place.y_px],
            "heading_rad": scene.heading_rad,
            "altitude_ratio": scene.altitude_ratio,
            "related": displacement.is_some(),
            "tracks": tracks,
        }));
    }
    let shape = [frames, frame.height.into(), frame.width.into()].map(u64::from);
    write_npy(out, &shape, pixels)?;
    say(&json!({"flight": flight}), Duration::ZERO)
}

fn clusters(points: &[f64], dimensions: usize, seed: u64) -> Result<()> {
    let pairwise = Pairwise::new(Dissimilarity::Euclid, points, dimensions)?;
    let squares = Pairwise::new(Dissimilarity::Ssd, points, dimensions)?;
    let n = pairwise.count();
    let counts = CLUSTERS.into_iter().filter(|&count| count < n);
    let counts: Vec<usize> = counts.chain([n]).collect();
    let mut linkages = BTreeMap::new();
    for linkage in Linkage::ALL {
        let dendrogram = Dendrogram::new(linkage, &pairwise)?;
        let mut cuts = BTreeMap::new();
        for &count in &counts {
            cuts.insert(count, dendrogram.cut(count)?.of().to_vec());
        }
        let found = json!({
            "merges": dendrogram.merges(),
            "cophenetic": dendrogram.cophenetic_distances(),
            "correlation": dendrogram.cophenetic_correlation(&pairwise),
            "cuts": cuts,
        });
        linkages.insert(linkage, found);
    }
    let mut means = BTreeMap::new();
    for &count in &counts {
        let ssd = |seed| Ok(k_means(points, dimensions, count, seed)?.ssd);
        let of_starts: Result<Vec<f64>> = (seed..seed + STARTS).map(ssd).collect();
        let found = k_means(points, dimensions, count, seed)?;
        let found = json!({
            "ssd_of_starts": of_starts?,
            "of": found.partition.of(),
            "centroids": found.centroids,
            "ssd": found.ssd,
            "silhouettes": silhouettes(&squares, &found.partition)?,
        });
        means.insert(count, found);
    }
    let (curve, best) = best_of("3", || Ok(silhouette_curve(points, dimensions, seed)?))?;
    let result = json!({"linkages": linkages, "k_means": means, "curve": curve});
    say(&result, best)
}

/// A matrix, row by row, and its number of columns.
fn read<T: npyz::Deserialize>(path: &str) -> Result<(Vec<T>, usize)> {
    let file = File::open(path).with_context(|| path.to_owned())?;
    let array = npyz::NpyFile::new(BufReader::new(file))?;
    let columns = *array.shape().last().context("a matrix")? as usize;
    Ok((array.into_vec()?, columns))
}

/// The dots of every eigenimage with the window at every position, one plane after the other.
fn planes(picture: &GrayImage, side: usize, eigenimages: &[f64]) -> Vec<f64> {
    let dense = Dense::new(picture, side as u32, side, eigenimages);
    let [columns, rows] = [dense.positions().0, dense.positions().1].map(|count| count as usize);
    let mut planes = vec![0.0; dense.rows() * rows * columns];
    let lines: Vec<Mutex<&mut [f64]>> = planes.chunks_mut(columns).map(Mutex::new).collect();
    dense.project(|part| {
        let (left, top) = part.corner(0);
        for plane in 0..dense.rows() {
            let lines = &lines[plane * rows + top as usize..];
            for (line, dots) in lines.iter().zip(part.plane(plane).chunks(part.columns())) {
                let mut line = line.lock().expect("no panics");
                line[left as usize..][..dots.len()].copy_from_slice(dots);
            }
        }
    });
    drop(lines);
    planes
}

fn timed<T: Serialize>(repetitions: &str, compute: impl Fn() -> Result<T>) -> Result<()> {
    let (result, best) = best_of(repetitions, compute)?;
    say(&json!(result), best)
}

/// What was computed, and the best time.
fn best_of<T>(repetitions: &str, compute: impl Fn() -> Result<T>) -> Result<(T, Duration)> {
    let start = Instant::now();
    let mut result = compute()?;
    let mut best = start.elapsed();
    for _ in 1..repetitions.parse::<u32>()? {
        drop(result);
        let start = Instant::now();
        result = compute()?;
        best = best.min(start.elapsed());
    }
    Ok((result, best))
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
