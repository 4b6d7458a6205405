//! `evaluate`: how far each landmark of an atlas can be trusted.

mod localize;
mod print;

use std::{io, path::PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum, value_parser};
use eigenmark::{
    atlas::{AtlasBuffer, Summary},
    evaluate::{
        Deviation, EvaluatedTable, Everywhere, Exact, Journal, JudgeDifference, Onboard, Plan,
        Score, Site, evaluate,
        reliability::{Measure, Steps},
    },
    map::{Integral, Map},
    output::{Progress, check_directory, check_target},
    train::Relearned,
};
use eigenmark_core::{atlas::Atlas, landmark::Record};
use serde::Serialize;
use serde_json::json;

use self::{
    localize::{Ground, Named},
    print::{print, print_difference, print_distinctness},
};
use super::{Unmet, choices::DeviationChoice, print_json, train::write_report};

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
    /// Also write it as a page, with views, eigenspace, distances and localization matrices
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
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
    core_against_f64: Option<&'a JudgeDifference>,
    #[serde(skip_serializing_if = "Option::is_none")]
    distinctness: Option<&'a [Named]>,
}

impl Cmd {
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(
            self.min_score.is_none() || self.views > 0,
            "--min-score needs --views above 0"
        );
        if let Some(directory) = &self.localization {
            check_directory(directory)?;
        }
        if let Some(report) = &self.report {
            check_target(report)?;
        }
        let buffer = AtlasBuffer::read(&self.atlas)?;
        let atlas = buffer.atlas();
        // Catchments and localization matrices are of upright windows.
        let survey = atlas.survey();
        let altitudes: Vec<String> = survey.altitudes.iter().map(f32::to_string).collect();
        ensure!(
            survey.headings == 1 && survey.altitudes[..] == [1.0],
            "{}: expected an atlas of one heading at the nominal altitude, found one of {} headings, altitude {}",
            self.atlas.display(),
            survey.headings,
            altitudes.join(", ")
        );
        let map = Map::open(&self.map)?;
        let progress = Progress::Stderr;

        let step = progress.step("learning the eigenspace again");
        let relearned = Relearned::new(&map, &atlas)
            .with_context(|| format!("{} for {}", self.map, self.atlas.display()))?;
        let integral = Integral::new(map.luminance());
        drop(step);
        if let Some(report) = &self.report {
            let (summary, space) = (Summary::of(&atlas), &relearned.space);
            write_report(&self.map, &map, &summary, space, "evaluate", report)?;
        }
        let (onboard, exact) = (Onboard::new(&atlas), exact(&relearned));
        let footprint_px = atlas.header().footprint_px as u32;
        let ground = Ground {
            map: &map,
            atlas: &atlas,
            integral: &integral,
            exact: &exact,
            footprint_px,
        };
        let subjects = ground.subjects(&self.of)?;

        let sites = sites(&atlas);
        let plan = self.plan();
        let journal = self.journal(&map, &atlas, &plan)?;

        let step = progress.step("projecting the map");
        let mut everywhere = Vec::new();
        if self.through != Through::F64 {
            everywhere.push(Everywhere::lazily(&onboard, &map, &integral, footprint_px));
        }
        if self.through != Through::Core {
            everywhere.push(Everywhere::densely(&exact, &map, &integral, footprint_px));
        }
        drop(step);

        let found = evaluate(&map, &sites, &everywhere, &plan, &journal, &progress)?;
        let table = |judge: usize| EvaluatedTable::new(found.iter().map(|by| by[judge].clone()));
        let first = table(0);
        let second = (self.through == Through::Both).then(|| table(1));
        let difference = second.as_ref().map(|second| first.against(second));
        let distinctness = match &self.localization {
            Some(directory) => Some(ground.localize(directory, &sites, &subjects)?),
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
                core_against_f64: difference.as_ref(),
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
fn exact(relearned: &Relearned) -> Exact {
    let Relearned { space, landmarks } = relearned;
    let basis = space.basis.clone();
    Exact::new(basis, space.metric, &space.coordinates, landmarks)
}

fn sites(atlas: &Atlas<'_>) -> Vec<Site> {
    let site = |record: &Record| {
        let candidate = atlas.survey().find(record.view);
        Site::from(&candidate.expect("an atlas's landmarks are of its survey"))
    };
    atlas.landmarks().records().iter().map(site).collect()
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
