//! The options that say how an atlas is trained; shared by every command that trains.

use anyhow::ensure;
use clap::{Args, value_parser};
use eigenmark::{
    learn::{ALTITUDES, HEADINGS, HIGHPASSES, SCALES, Settings, WHITENINGS},
    map::Map,
    output::Progress,
    select::{Best, Method, Preselection, Selection, Start},
    train::measure_headings,
};
use eigenmark_core::landmark::MAX_ALTITUDES;

use super::choices::{
    AttentionChoice, BlurChoice, DissimilarityChoice, MethodChoice, MetricChoice, NormalizeChoice,
    SelectChoice, WidthChoice,
};

/// Landmarks that are selected when nothing else is said.
const LANDMARKS: u32 = 8;

/// How an atlas is trained.
#[derive(Clone, Debug, Args)]
pub struct SettingsArgs {
    /// Map pixels per view pixel: 10 is the report's scale factor 1/10
    #[arg(long, default_value_t = 10.0, value_parser = scale)]
    pub scale: f64,
    /// Gaussian blur of the views
    #[arg(long, value_enum, default_value = "gauss1")]
    pub blur: BlurChoice,
    /// Dimensions of the eigenspace
    #[arg(long, value_name = "K", default_value_t = 15, value_parser = value_parser!(u8).range(1..=128))]
    pub dims: u8,
    /// Side of a view's footprint, in map pixels
    #[arg(long, value_name = "PX", default_value_t = 200, value_parser = value_parser!(u32).range(1..))]
    pub view_size: u32,
    /// Distance between views in map pixels [default: the report's layout, side by side and on the corners]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(1..))]
    pub stride: Option<u32>,
    /// See every view at so many headings, so that a fix says the heading, too; auto, or nothing, is as many as the
    /// orientation that landmarks tolerate asks for. Views whose turned square would leave the map are left out
    #[arg(long, value_name = "N|auto", default_value = "1", num_args = 0..=1, default_missing_value = "auto", value_parser = headings)]
    headings: HeadingsChoice,
    /// See every view from these altitudes over the nominal one, ascending, four at most, ¼ to 4; the view of altitude 2
    /// shows twice the footprint, and is left out where that would leave the map
    #[arg(long, value_name = "RATIO,…", value_delimiter = ',', default_value = "1", value_parser = altitude)]
    pub altitudes: Vec<f32>,
    /// Contrast normalization of every view
    #[arg(long, value_enum, default_value = "none")]
    pub normalize: NormalizeChoice,
    /// Subtract a Gaussian blur of this sigma, in view pixels
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0, value_parser = not_negative)]
    pub highpass: f64,
    /// Multiply coefficients by λ^(−ALPHA/2)
    #[arg(long, value_name = "ALPHA", default_value_t = 0.0, value_parser = whitening)]
    pub whiten: f64,
    /// How views are compared
    #[arg(long, value_enum, default_value = "nssd")]
    pub metric: MetricChoice,
    /// Width of the landmarks' coefficients
    #[arg(long, value_enum, default_value = "i16")]
    pub coefficients: WidthChoice,
}

/// Which views become landmarks.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Selection")]
pub struct SelectionArgs {
    /// Which views become landmarks
    #[arg(long, value_enum, default_value = "profile")]
    select: SelectChoice,
    #[command(flatten)]
    best: BestArgs,
    /// Landmarks that an IPCA ranking starts from: profile (the best three of that ranking), random, or views i,j,k
    #[arg(long, value_name = "VIEWS", value_parser = start)]
    start: Option<StartChoice>,
    /// End an IPCA ranking when every view is represented to within this error: root mean square per pixel, in gray levels,
    /// or in standard deviations with --normalize std
    #[arg(long, value_name = "LEVELS", value_parser = not_negative)]
    stop_residual: Option<f64>,
    /// Fast routes, or the report's algorithms as they are written; both give the same ranking
    #[arg(long, value_enum, default_value = "fast")]
    method: MethodChoice,
}

/// What every selection of the best views goes by, whatever its method.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Selection")]
pub struct BestArgs {
    /// Number of landmarks [default: 8]
    #[arg(long, value_name = "L", value_parser = value_parser!(u32).range(1..))]
    landmarks: Option<u32>,
    /// Seed of a random start
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// What a profile averages [default: as the metric]
    #[arg(long, value_enum)]
    dissimilarity: Option<DissimilarityChoice>,
    /// Rank only the views that attract attention by this
    #[arg(long, value_enum)]
    preselect: Option<AttentionChoice>,
    /// Views that are kept by --preselect [default: a quarter]
    #[arg(long, value_name = "N", requires = "preselect", value_parser = value_parser!(u32).range(1..))]
    keep: Option<u32>,
    /// Distance between landmarks on the map, at least
    #[arg(long, value_name = "METERS", default_value_t = 0.0, value_parser = length)]
    spacing: f64,
    /// Size of a map pixel
    #[arg(long, value_name = "METERS", default_value_t = 1.0, value_parser = pixel_size)]
    meters_per_pixel: f64,
}

/// What `--headings` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HeadingsChoice {
    Measured,
    Given(u8),
}

/// What `--start` says.
#[derive(Clone, Debug, PartialEq, Eq)]
enum StartChoice {
    Profile,
    Random,
    Given(Vec<u32>),
}

impl SettingsArgs {
    /// The settings, with a selection; headings are still to be [`counted`](Self::counted).
    pub fn settings(&self, selection: Selection) -> anyhow::Result<Settings> {
        let altitudes = &self.altitudes;
        ensure!(
            altitudes.len() <= MAX_ALTITUDES && altitudes.is_sorted_by(|a, b| a < b),
            "--altitudes: expected at most {MAX_ALTITUDES} ratios, ascending, found {}",
            altitudes
                .iter()
                .map(f32::to_string)
                .collect::<Vec<_>>()
                .join(",")
        );
        Ok(Settings {
            scale: self.scale,
            blur: self.blur.into(),
            dimensions: self.dims,
            selection,
            view_size_px: self.view_size,
            stride_px: self.stride,
            headings: match self.headings {
                HeadingsChoice::Measured => *HEADINGS.end(),
                HeadingsChoice::Given(headings) => headings,
            },
            altitudes: altitudes.iter().copied().collect(),
            normalize: self.normalize.into(),
            highpass_px: self.highpass,
            whiten: self.whiten,
            metric: self.metric.into(),
            width: self.coefficients.into(),
        })
    }

    /// The same settings with as many headings as the map asks for, if the user leaves it to that.
    pub fn counted(&self, map: &Map, settings: Settings) -> anyhow::Result<Settings> {
        if self.headings != HeadingsChoice::Measured {
            return Ok(settings);
        }
        let measured = measure_headings(map, &settings, &Progress::Stderr)?;
        let [left, right] = measured.orientation_deg;
        eprintln!(
            "{} headings: landmarks tolerate turns from {left:.1}° to {right:.1}°",
            measured.headings
        );
        Ok(Settings {
            headings: measured.headings,
            ..settings
        })
    }

    /// Pixels per side of a view.
    fn view_side(&self) -> u32 {
        let nominal = Settings {
            scale: self.scale,
            view_size_px: self.view_size,
            ..Settings::default()
        };
        nominal.view_side()
    }
}

impl SelectionArgs {
    /// The selection, with these settings.
    pub fn selection(&self, settings: &SettingsArgs) -> anyhow::Result<Selection> {
        if self.select == SelectChoice::All {
            ensure!(
                self.best.landmarks.is_none(),
                "--landmarks has no meaning with --select all"
            );
            ensure!(
                self.best.preselect.is_none() && self.best.spacing == 0.0,
                "--preselect and --spacing have no meaning with --select all"
            );
        }
        if self.select != SelectChoice::Ipca {
            ensure!(
                self.start.is_none() && self.stop_residual.is_none(),
                "--start and --stop-residual need --select ipca"
            );
        }
        if let SelectChoice::Reliable | SelectChoice::All = self.select {
            ensure!(
                self.method == MethodChoice::Fast,
                "--method literal needs --select profile or ipca"
            );
        }
        if let Some(StartChoice::Given(views)) = &self.start {
            let landmarks = self.best.landmarks.unwrap_or(LANDMARKS);
            ensure!(
                views.len() <= landmarks as usize,
                "--start names {} views, more than the {landmarks} of --landmarks",
                views.len()
            );
        }
        let method = match self.select {
            SelectChoice::All => return Ok(Selection::All),
            SelectChoice::Profile => Method::Profile,
            SelectChoice::Reliable => Method::Reliable,
            SelectChoice::Ipca => Method::Ipca {
                start: match self.start.clone().unwrap_or(StartChoice::Profile) {
                    StartChoice::Profile => Start::Profile,
                    StartChoice::Random => Start::Random {
                        seed: self.best.seed,
                    },
                    StartChoice::Given(views) => Start::Given(views),
                },
                // Of v² pixels, the norm is v times the root mean square.
                stop_residual: self
                    .stop_residual
                    .map(|rms| rms * f64::from(settings.view_side())),
            },
        };
        Ok(Selection::Best(Best {
            is_literal: self.method == MethodChoice::Literal,
            ..self.best.by(method)
        }))
    }
}

impl BestArgs {
    /// The best views by a method.
    pub fn by(&self, method: Method) -> Best {
        Best {
            dissimilarity: self.dissimilarity.map(Into::into),
            preselection: self.preselect.map(|attention| Preselection {
                attention: attention.into(),
                keep: self.keep,
            }),
            spacing_px: (self.spacing / self.meters_per_pixel) as f32,
            ..Best::new(self.landmarks.unwrap_or(LANDMARKS), method)
        }
    }
}

pub fn scale(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(scale) if SCALES.contains(&scale) => Ok(scale),
        _ => Err("expected a number from 1 to 1000".to_owned()),
    }
}

fn headings(text: &str) -> Result<HeadingsChoice, String> {
    match text.parse() {
        _ if text == "auto" => Ok(HeadingsChoice::Measured),
        Ok(headings) if HEADINGS.contains(&headings) => Ok(HeadingsChoice::Given(headings)),
        _ => Err(format!(
            "expected auto, or a number from {} to {}",
            HEADINGS.start(),
            HEADINGS.end()
        )),
    }
}

fn altitude(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(ratio) if ALTITUDES.contains(&ratio) => Ok(ratio),
        _ => Err(format!(
            "expected numbers from {} to {}",
            ALTITUDES.start(),
            ALTITUDES.end()
        )),
    }
}

fn whitening(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(alpha) if WHITENINGS.contains(&alpha) => Ok(alpha),
        _ => Err("expected a number from 0 to 2".to_owned()),
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if HIGHPASSES.contains(&number) => Ok(number),
        _ => Err("expected a number from 0 to 1000".to_owned()),
    }
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if (0.0..=1e6).contains(&number) => Ok(number),
        _ => Err("expected a number of meters from 0 to 1000000".to_owned()),
    }
}

fn pixel_size(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(number) if (1e-3..=1e3).contains(&number) => Ok(number),
        _ => Err("expected a number of meters from 0.001 to 1000".to_owned()),
    }
}

fn start(text: &str) -> Result<StartChoice, String> {
    match text {
        "profile" => Ok(StartChoice::Profile),
        "random" => Ok(StartChoice::Random),
        _ => text
            .split(',')
            .map(str::parse)
            .collect::<Result<_, _>>()
            .map(StartChoice::Given)
            .map_err(|_| {
                "expected profile, random, or numbers of views such as 20,51,79".to_owned()
            }),
    }
}
