//! From f64 to the integers that fly, under every setting: coordinates stay within the proven bound, own views are at
//! distance zero, and the guarantee survives.

use eigenmark::{
    atlas::Folded,
    learn::{Preprocess, Settings},
    map::Map,
    output::Progress,
    select::{Selection, dissimilarity, metric_distance},
    simulate::seeded,
    train::{Trained, train},
};
use eigenmark_core::{
    atlas::Blur,
    eigenspace::{Coefficients, Normalize, Projection},
    landmark::{Metric, Width},
    localizer::Localizer,
    preprocess::View,
};
use rand::{Rng, RngExt};

/// Views per setting.
const VIEWS: usize = 500;

/// Coordinates of both sides meet in f32; what that rounds is part of the bound, what the comparison rounds is not.
const SLACK: f64 = 1.0 + 1e-6;

fn settings() -> Vec<Settings> {
    let base = Settings {
        view_size_px: 200,
        ..Settings::default()
    };
    let mut all = Vec::new();
    for normalize in [Normalize::None, Normalize::Mean, Normalize::Std] {
        for (metric, width) in [
            (Metric::Nssd, Width::I16),
            (Metric::Euclid, Width::I8),
            (Metric::Cosine, Width::I8),
        ] {
            all.push(Settings {
                normalize,
                metric,
                width,
                ..base.clone()
            });
        }
    }
    all.push(Settings {
        highpass_px: 3.0,
        whiten: 0.5,
        normalize: Normalize::Std,
        ..base.clone()
    });
    all.push(Settings {
        whiten: 1.0,
        dimensions: 40,
        blur: Blur::Gauss3,
        ..base.clone()
    });
    all.push(Settings {
        scale: 4.0,
        dimensions: 80,
        selection: Selection::All,
        ..base.clone()
    });
    all.push(Settings {
        scale: 15.0,
        dimensions: 1,
        blur: Blur::None,
        ..base
    });
    all
}

/// Views of the map with random contrast and noise, and views that are nothing but noise.
fn random_view(trained: &Trained, random: &mut impl Rng) -> View {
    let count = trained.candidates.grid().count();
    let base = trained.candidates.reduced(random.random_range(1..=count));
    let contrast = random.random_range(0.0..1.5);
    let noise = if random.random_range(0..10) == 0 {
        255
    } else {
        random.random_range(1..60)
    };
    let pixels: Vec<u8> = base
        .iter()
        .map(|&level| (f64::from(level) * contrast) as i32 + random.random_range(-noise..=noise))
        .map(|level| level.clamp(0, 255) as u8)
        .collect();
    View::from_pixels(&pixels).expect("a square")
}

struct Both {
    /// Coordinates in f64.
    exact: Vec<f64>,
    /// The same from the board's integers.
    quantized: Vec<f64>,
    projection: Projection,
}

fn project(
    trained: &Trained,
    settings: &Settings,
    preprocess: &Preprocess,
    view: &View,
) -> Option<Both> {
    let mut coefficients = Coefficients::zeros(settings.dimensions);
    let projection = trained
        .atlas()
        .eigenspace()
        .project(view, &mut coefficients)?;
    let x = preprocess.of_pixels(view.pixels())?;
    let whitening = trained.model.whitening(settings.whiten);
    let exact = trained.model.rows().zip(whitening).map(|(row, whitening)| {
        let g: f64 = row
            .iter()
            .zip(x.iter().zip(&trained.model.mean))
            .map(|(e, (x, mean))| e * (x - mean))
            .sum();
        g * whitening
    });
    let step = f64::from(trained.atlas().landmarks().step());
    let quantized = coefficients
        .values()
        .iter()
        .map(|&steps| f64::from(steps) * step)
        .collect();
    Some(Both {
        exact: exact.collect(),
        quantized,
        projection,
    })
}

#[test]
fn coordinates_stay_within_the_proven_bound_and_own_views_are_found() {
    let city = Map::city();
    for settings in settings() {
        let trained = train(&city, &settings, false, &Progress::Hidden).expect("trains");
        let side = settings.view_side() as usize;
        let preprocess = Preprocess::new(
            side,
            settings.normalize,
            settings.blur,
            settings.highpass_px,
        );
        let bound = Folded::new(
            &trained.model,
            &trained.coordinates,
            &trained.candidates,
            &settings,
        )
        .error();
        let mut localizer = Localizer::new(trained.atlas());
        let landmarks: Vec<&[f64]> = trained
            .selected
            .landmarks
            .iter()
            .map(|&view| &trained.coordinates[(view as usize - 1) * trained.model.dimensions..])
            .map(|rest| &rest[..trained.model.dimensions])
            .collect();

        let mut random = seeded(11, 0);
        let (mut largest, mut guaranteed) = (0.0_f64, 0);
        for _ in 0..VIEWS {
            let view = random_view(&trained, &mut random);
            let Some(both) = project(&trained, &settings, &preprocess, &view) else {
                continue;
            };
            if both.projection.clamped {
                continue;
            }
            let difference = metric_distance(Metric::Euclid, &both.exact, &both.quantized);
            assert!(
                difference <= bound * SLACK,
                "{settings:?}: off by {difference}, bound {bound}"
            );
            largest = largest.max(difference);

            let fix = localizer.locate_view(&view).expect("not flat");
            if fix.guaranteed {
                guaranteed += 1;
                let rho = |landmark: &&[f64]| dissimilarity(settings.metric, &both.exact, landmark);
                let nearest = (0..landmarks.len())
                    .min_by(|&a, &b| rho(&landmarks[a]).total_cmp(&rho(&landmarks[b])));
                assert_eq!(
                    nearest,
                    Some(fix.landmark as usize),
                    "{settings:?}: guaranteed, but not the nearest"
                );
            }
        }
        assert!(largest > 0.0);
        for (&view, rank) in trained.selected.landmarks.iter().zip(0..) {
            let own = trained
                .candidates
                .view(view)
                .expect("small enough for a board");
            let fix = localizer.locate_view(&own).expect("not flat");
            assert_eq!(
                (fix.landmark, fix.view, fix.distance),
                (rank, view, 0.0),
                "{settings:?}"
            );
            assert_eq!(fix.place, trained.candidates.grid().place(view));
        }
        println!(
            "bound {bound:.3}, largest {largest:.3}, {guaranteed} of {VIEWS} guaranteed: {settings:?}"
        );
    }
}
