//! `evaluate`: how far each landmark of an atlas can be trusted.

use std::{
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum, value_parser};
use eigenmark::{
    atlas::AtlasBuffer,
    evaluate::{
        Criterion, Deviation, EvaluatedTable, Everywhere, Exact, Journal, Judge, JudgeDifference,
        Onboard, Plan, Score, Site, evaluate,
        localization::{Distinctness, LocalizationMatrix, final_evaluation, localization_matrices},
        reliability::{End, Measure, Reliability, Steps},
    },
    map::{Integral, Map, load},
    output::{OutputError, Progress, create_dir, write_file, write_npy},
    train::Relearned,
};
use eigenmark_core::{
    atlas::Atlas,
    frame::MAX_SIDE,
    landmark::lattice::{candidate_count, place},
};
use image::codecs::png::PngEncoder;
use serde::Serialize;
use serde_json::json;

use super::{Unmet, choices::DeviationChoice, print_json};

/// Say how far every landmark can be trusted: orientation, altitude, brightness, position, and more
#[derive(Debug, Args)]
pub struct Cmd {
    /// The map that the atlas was trained on: a PNG, JPEG or TIFF file, or builtin:city
    #[arg(long, value_name = "FILE")]
    map: String,
    /// The atlas
    #[arg(long, value_name = "ATLAS")]
    atlas: PathBuf,
    /// Who is asked: the core with the atlas, the eigenspace in f64 that it was made of, or both and how they differ
    #[arg(long, value_enum, default_value = "both")]
    through: Through,
    /// Only orientation, altitude, brightness and position, as in the report; no tilt, noise, motion and occlusion
    #[arg(long)]
    report_only: bool,
    /// Steps of gamma: 1 + STEP, 1 + 2·STEP, …, and their reciprocals
    #[arg(long, value_name = "STEP", default_value_t = 0.5, value_parser = gamma_step)]
    gamma_step: f64,
    /// The distribution of errors that the score is the probability of a right fix under
    #[arg(long, value_enum, default_value = "moderate")]
    deviation: DeviationChoice,
    /// Views drawn per landmark for its score; 0 for no score
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = value_parser!(u32).range(..=1_000_000))]
    views: u32,
    /// Seed of the draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fail with exit code 1 when the score of all landmarks is below this share
    #[arg(long, value_name = "SHARE", value_parser = share)]
    min_score: Option<f64>,
    /// Write the localization matrix of every landmark into this directory: how dissimilar it is to every position of the
    /// map in f64 (NumPy, and a picture in which black is similar); and say which places it could be taken for
    #[arg(long, value_name = "DIR")]
    localization: Option<PathBuf>,
    /// Write the matrices of these views instead: numbers of candidates, or picture files that show one footprint
    #[arg(long, value_name = "VIEW|FILE", requires = "localization", num_args = 1..)]
    of: Vec<String>,
    /// Write finished landmarks here, and go on from what is there already
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Print it as JSON
    #[arg(long)]
    json: bool,
}

/// Who is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Through {
    Core,
    F64,
    Both,
}

/// Landmarks that are listed for people; JSON has all.
const LISTED: usize = 100;

/// What is printed as JSON: the tables' fields stand at the top.
#[derive(Serialize)]
struct Report<'a> {
    map: &'a str,
    atlas_crc: String,
    through: &'static str,
    plan: &'a Plan,
    #[serde(flatten)]
    table: &'a EvaluatedTable,
    #[serde(skip_serializing_if = "Option::is_none")]
    f64: Option<&'a EvaluatedTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    core_minus_f64: Option<&'a JudgeDifference>,
    #[serde(skip_serializing_if = "Option::is_none")]
    distinctness: Option<&'a [Named]>,
}

/// How distinct a view is, and what it is called.
#[derive(Serialize)]
struct Named {
    name: String,
    #[serde(flatten)]
    distinctness: Distinctness,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(
            self.min_score.is_none() || self.views > 0,
            "--min-score needs --views above 0"
        );
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let atlas = buffer.atlas();
        let map = Map::open(&self.map)?;
        let progress = Progress::Stderr;

        let step = progress.step("learning the eigenspace again");
        let relearned = Relearned::new(&map, &atlas)
            .with_context(|| format!("{} for {}", self.map, self.atlas.display()))?;
        let integral = Integral::new(map.luminance());
        drop(step);
        let (onboard, exact) = (Onboard::new(&atlas), exact(&atlas, relearned));
        let footprint_px = atlas.header().footprint_px as u32;
        let step = progress.step("projecting the map");
        let mut everywhere = Vec::new();
        if self.through != Through::F64 {
            everywhere.push(Everywhere::lazily(&onboard, &map, &integral, footprint_px));
        }
        if self.through != Through::Core {
            everywhere.push(Everywhere::densely(&exact, &map, &integral, footprint_px));
        }
        drop(step);

        let sites = sites(&atlas);
        let plan = self.plan();
        let journal = self.journal(&map, &atlas, &plan)?;
        let found = evaluate(&map, &sites, &everywhere, &plan, &journal, &progress)?;
        let table = |judge: usize| EvaluatedTable::new(found.iter().map(|by| by[judge].clone()));
        let first = table(0);
        let second = (self.through == Through::Both).then(|| table(1));
        let difference = second.as_ref().map(|second| first.minus(second));
        let distinctness = match &self.localization {
            Some(directory) => {
                let ground = Ground {
                    map: &map,
                    atlas: &atlas,
                    integral: &integral,
                    exact: &exact,
                    footprint_px,
                };
                Some(ground.localize(directory, &sites, &self.of)?)
            }
            None => None,
        };

        let mut out = io::stdout().lock();
        if self.json {
            let report = Report {
                map: map.name(),
                atlas_crc: format!("{:08x}", atlas.crc()),
                through: if self.through == Through::F64 {
                    "f64"
                } else {
                    "core"
                },
                plan: &plan,
                table: &first,
                f64: second.as_ref(),
                core_minus_f64: difference.as_ref(),
                distinctness: distinctness.as_deref(),
            };
            print_json(&mut out, &report)?;
        } else {
            print(&mut out, &plan, &first)?;
            if let Some(difference) = &difference {
                print_difference(&mut out, difference, first.landmarks.len())?;
            }
            if let Some(distinctness) = &distinctness {
                print_distinctness(&mut out, distinctness, footprint_px)?;
            }
        }
        self.check(first.mean.score)
    }

    fn plan(&self) -> Plan {
        Plan {
            measures: if self.report_only {
                Measure::REPORT.to_vec()
            } else {
                Measure::ALL.to_vec()
            },
            steps: Steps {
                gamma: self.gamma_step,
            },
            deviation: Deviation::from(self.deviation),
            views: u64::from(self.views),
            seed: self.seed,
        }
    }

    fn journal(&self, map: &Map, atlas: &Atlas<'_>, plan: &Plan) -> anyhow::Result<Journal> {
        let Some(path) = &self.journal else {
            return Ok(Journal::none());
        };
        let of = json!({
            "eigenmark": env!("CARGO_PKG_VERSION"),
            "map_crc": map.crc(),
            "atlas_crc": atlas.crc(),
            "through": format!("{:?}", self.through),
            "plan": plan,
        });
        let journal = Journal::open(path, &of.to_string())?;
        if !journal.is_empty() {
            eprintln!("{}: {} landmarks are known", path.display(), journal.len());
        }
        Ok(journal)
    }

    fn check(&self, score: Option<Score>) -> anyhow::Result<()> {
        let Some(least) = self.min_score else {
            return Ok(());
        };
        let found = score.map_or(0.0, |score| score.right);
        if found < least {
            return Err(Unmet(format!(
                "expected a score of at least {least}, found {found:.4}"
            ))
            .into());
        }
        Ok(())
    }
}

/// The eigenspace and the landmarks of an atlas in f64.
fn exact(atlas: &Atlas<'_>, relearned: Relearned) -> Exact {
    let metric = atlas.landmarks().metric();
    Exact::new(
        relearned.basis,
        metric,
        &relearned.coordinates,
        &relearned.landmarks,
    )
}

/// A view whose localization matrix is asked for.
struct Subject {
    name: String,
    site: Option<Site>,
    point: Vec<f64>,
}

/// Writes the matrix of a subject: an array and a picture.
fn write_matrix(directory: &Path, name: &str, matrix: &LocalizationMatrix) -> anyhow::Result<()> {
    let path = |ending| directory.join(format!("{name}.{ending}"));
    let (columns, rows) = matrix.size();
    let shape = [rows as u64, columns as u64];
    write_npy(&path("npy"), &shape, matrix.values().iter().copied())?;
    write_file(&path("png"), |file| {
        let written = matrix.picture().write_with_encoder(PngEncoder::new(file));
        written.map_err(io::Error::other)
    })?;
    Ok(())
}

/// What the reader of an evaluation needs to know about places.
struct Ground<'a> {
    map: &'a Map,
    atlas: &'a Atlas<'a>,
    integral: &'a Integral,
    exact: &'a Exact,
    footprint_px: u32,
}

impl Ground<'_> {
    /// Writes the matrices of the landmarks, or of the views that `of` names; how distinct each is.
    fn localize(
        &self,
        directory: &Path,
        sites: &[Site],
        of: &[String],
    ) -> anyhow::Result<Vec<Named>> {
        create_dir(directory)?;
        if of.is_empty() {
            let keep = |landmark: usize, matrix: &LocalizationMatrix| {
                write_matrix(directory, &format!("landmark-{}", landmark + 1), matrix)
            };
            let (map, footprint_px) = (self.map, self.footprint_px);
            let progress = Progress::Stderr;
            let found = final_evaluation(map, footprint_px, self.exact, sites, &progress, keep)?;
            let named = found.into_iter().map(|distinctness| Named {
                name: format!("landmark {}", distinctness.landmark),
                distinctness,
            });
            return Ok(named.collect());
        }
        let subjects: Vec<Subject> = of
            .iter()
            .map(|name| self.subject(name))
            .collect::<anyhow::Result<_>>()?;
        let points: Vec<&[f64]> = subjects
            .iter()
            .map(|subject| subject.point.as_slice())
            .collect();
        let mut found = Ok(Vec::new());
        localization_matrices(
            self.map,
            self.footprint_px,
            self.exact,
            &points,
            |index, matrix| {
                let subject = &subjects[index];
                let corner = subject.site.map(|site| site.corner(self.footprint_px));
                let named = write_matrix(directory, &subject.name, &matrix).map(|()| Named {
                    name: subject.name.clone(),
                    distinctness: Distinctness {
                        view: subject.site.map_or(0, |site| site.view),
                        ..Distinctness::of(&matrix, self.footprint_px, corner)
                    },
                });
                match (&mut found, named) {
                    (Ok(found), Ok(named)) => found.push(named),
                    (Ok(_), Err(error)) => found = Err(error),
                    (Err(_), _) => {}
                }
            },
        );
        found
    }

    /// A candidate by its number, or a picture by its path.
    fn subject(&self, name: &str) -> anyhow::Result<Subject> {
        let side = self.exact.side();
        let mut view = vec![0; side * side];
        let (name, site) = if let Ok(number) = name.parse::<u32>() {
            let count = candidate_count(self.atlas.lattices());
            let place = place(self.atlas.lattices(), number)
                .with_context(|| format!("view {number}: expected 1 to {count}"))?;
            let site = Site {
                view: number,
                place,
            };
            let [x, y] = site.corner(self.footprint_px);
            self.integral
                .reduce((x, y), self.footprint_px, side, &mut view);
            (format!("view-{number}"), Some(site))
        } else {
            let picture = load(Path::new(name))?;
            let square_px = picture.width().min(picture.height());
            ensure!(
                (32..=u32::from(MAX_SIDE)).contains(&square_px),
                "{name}: expected a picture of 32 to {MAX_SIDE} pixels per side"
            );
            let left = (picture.width() - square_px) / 2;
            let top = (picture.height() - square_px) / 2;
            Integral::new(&picture).reduce((left, top), square_px, side, &mut view);
            let stem = Path::new(name).file_stem().unwrap_or_default();
            (stem.to_string_lossy().into_owned(), None)
        };
        let point = self.exact.basis().project(&view);
        Ok(Subject {
            point: point.with_context(|| format!("{name}: no contrast to normalize"))?,
            name,
            site,
        })
    }
}

fn sites(atlas: &Atlas<'_>) -> Vec<Site> {
    let records = atlas.landmarks().records().iter();
    records
        .filter_map(|record| {
            let place = place(atlas.lattices(), record.view)?;
            Some(Site {
                view: record.view,
                place,
            })
        })
        .collect()
}

fn print(out: &mut impl Write, plan: &Plan, table: &EvaluatedTable) -> anyhow::Result<()> {
    for (criterion, what) in [
        (
            Criterion::Nearest,
            "nearest: the landmark is the nearest one",
        ),
        (
            Criterion::Guaranteed,
            "guaranteed: the landmark is nearer than its radius",
        ),
    ] {
        writeln!(out, "{what}")?;
        writeln!(
            out,
            "{:>8}{:>7}{:>16}{:>16}{:>18}{:>16}{:>8}  score, 95 %",
            "landmark", "view", "orientation, °", "altitude", "gamma", "catchment, px", "of map"
        )?;
        for landmark in table.landmarks.iter().take(LISTED) {
            let one = landmark.evaluated.by(criterion);
            let range = |measure, digits| range(one, measure, digits);
            writeln!(
                out,
                "{:>8}{:>7}{:>16}{:>16}{:>18}{:>15}{}{:>6.2} %  {}",
                landmark.evaluated.landmark,
                landmark.evaluated.view,
                range(Measure::Orientation, 0),
                range(Measure::Altitude, 2),
                range(Measure::Gamma, 2),
                one.catchment_px,
                mark(one.catchment_end),
                100.0 * one.catchment_share,
                Shown(landmark.score, criterion)
            )?;
        }
        if table.landmarks.len() > LISTED {
            let more = table.landmarks.len() - LISTED;
            writeln!(out, "{:>8} {more} more; --json lists all", "…")?;
        }
        let mean = match criterion {
            Criterion::Nearest => &table.mean.nearest,
            Criterion::Guaranteed => &table.mean.guaranteed,
        };
        let range = |measure: Measure, digits: usize| {
            let show = |limit: Option<f64>| {
                limit.map_or("-".to_owned(), |limit| format!("{limit:.digits$}"))
            };
            let [low, high] = mean.limits[&measure].map(show);
            format!("{low} … {high} ")
        };
        writeln!(
            out,
            "{:>8}{:>7}{:>16}{:>16}{:>18}{:>15.0} {:>6.2} %  {}",
            "mean",
            "",
            range(Measure::Orientation, 1),
            range(Measure::Altitude, 3),
            range(Measure::Gamma, 2),
            mean.catchment_px,
            100.0 * mean.catchment_share,
            Shown(table.mean.score, criterion)
        )?;
        for (measure, name, digits) in [
            (Measure::Roll, "roll, °", 1),
            (Measure::Pitch, "pitch, °", 1),
            (Measure::Noise, "noise, gray levels", 1),
            (Measure::Motion, "motion, share of the footprint", 3),
            (Measure::Occlusion, "occlusion, share of the frame", 3),
        ] {
            if plan.measures.contains(&measure) {
                writeln!(
                    out,
                    "{:>8}  {name}: {}",
                    "",
                    range(measure, digits).trim_end()
                )?;
            }
        }
        writeln!(out)?;
    }
    writeln!(
        out,
        "+ at least: the next step would show what lies beyond the map, or is not tried; means leave the first out."
    )?;
    Ok(())
}

fn print_difference(
    out: &mut impl Write,
    difference: &JudgeDifference,
    landmarks: usize,
) -> anyhow::Result<()> {
    writeln!(
        out,
        "\nquantization, and calibration of radii: the core with the atlas minus f64"
    )?;
    for (name, by) in [
        ("nearest", &difference.nearest),
        ("guaranteed", &difference.guaranteed),
    ] {
        let [orientation, altitude, gamma] =
            Measure::REPORT.map(|measure| by.mean.get(&measure).copied().unwrap_or_default());
        writeln!(
            out,
            "  {name:<10} {} of {landmarks} landmarks equal; on average orientation {:+.2}° … {:+.2}°, altitude {:+.3} … \
             {:+.3}, gamma {:+.2} … {:+.2}, catchment {:+.1} px",
            by.equal,
            orientation[0],
            orientation[1],
            altitude[0],
            altitude[1],
            gamma[0],
            gamma[1],
            by.catchment_px
        )?;
    }
    if let Some(score) = difference.score {
        writeln!(out, "  score      {:+.2} %", 100.0 * score)?;
    }
    Ok(())
}

fn print_distinctness(
    out: &mut impl Write,
    distinctness: &[Named],
    footprint_px: u32,
) -> anyhow::Result<()> {
    writeln!(
        out,
        "\nhow distinct on the whole map, in f64, most distinct first"
    )?;
    writeln!(
        out,
        "{:>16}{:>7}{:>8}{:>12}{:>12}{:>20}{:>12}",
        "", "view", "peaks", "slope, /px", "contrast", "most like it at", "by"
    )?;
    for Named {
        name,
        distinctness: one,
    } in distinctness.iter().take(LISTED)
    {
        let half = footprint_px / 2;
        let (rival, by) = one.rival.map_or(("-".to_owned(), "-".to_owned()), |peak| {
            let [x, y] = peak.corner.map(|at| at + half);
            (format!("{x}, {y}"), format!("{:.4}", peak.value))
        });
        let slope = one
            .own
            .map_or("-".to_owned(), |peak| format!("{:.5}", peak.slope));
        writeln!(
            out,
            "{name:>16}{:>7}{:>8}{slope:>12}{:>12.4}{rival:>20}{by:>12}{}",
            one.view,
            one.peaks,
            one.contrast,
            if one.is_global || one.own.is_none() {
                ""
            } else {
                "  not the global minimum"
            }
        )?;
    }
    Ok(())
}

/// "-12 … 30+".
fn range(one: &Reliability, measure: Measure, digits: usize) -> String {
    let [low, high] = one.limits[&measure];
    let [low_mark, high_mark] = one.ends[&measure].map(mark);
    format!(
        "{low:.digits$}{} … {high:.digits$}{high_mark}",
        low_mark.trim_end()
    )
}

fn mark(end: End) -> &'static str {
    match end {
        End::Failed => " ",
        End::Map | End::Range => "+",
    }
}

/// A score by a criterion, for people.
struct Shown(Option<Score>, Criterion);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(score) = self.0 else {
            return write!(f, "-");
        };
        let (share, [low, high]) = match self.1 {
            Criterion::Nearest => (score.right, score.right_interval),
            Criterion::Guaranteed => (score.guaranteed, score.guaranteed_interval),
        };
        let [share, low, high] = [share, low, high].map(|share| 100.0 * share);
        write!(f, "{share:.1} % ({low:.1} to {high:.1})")
    }
}

fn gamma_step(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(step) if (0.01..=9.0).contains(&step) => Ok(step),
        _ => Err("expected a number from 0.01 to 9".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("expected a share from 0 to 1".to_owned()),
    }
}
