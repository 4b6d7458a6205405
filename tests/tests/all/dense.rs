//! Dense tables on the maps: how near positions between landmarks come, and how little 8-bit coefficients lose.
//!
//! Small noise of pose and light, of the size that calibration calls slight: ±2°, altitude ±2 %, gamma ±5 %, two gray
//! levels; places anywhere between the landmarks of a grid of 8 map pixels.

use eigenmark::{
    learn::{Preprocess, Settings},
    map::Map,
    output::Progress,
    select::{Selection, dissimilarity},
    simulate::{Camera, Scene, seeded},
    train::{Trained, train},
};
use eigenmark_core::{
    eigenspace::Normalize,
    landmark::{Metric, Point, Width},
    localizer::Localizer,
    preprocess::{View, reduce},
};
use eigenmark_tests::maps::{self, TestMap};
use image::imageops;
use rand::RngExt;

/// Side of the part of a map that is gone over, in pixels: a whole map at this step would take minutes to train.
const PART_PX: u32 = 600;

/// Step of the grid, in map pixels.
const STRIDE_PX: u32 = 8;

/// Views per table.
const VIEWS: usize = 500;

/// Most that the refined error may be of the unrefined one.
const MAX_RATIO: f64 = 0.5;

/// How much larger than with exact arithmetic errors may be, per width.
const MAX_LOSS: [(Width, f64); 2] = [(Width::I16, 1.01), (Width::I8, 1.1)];

/// Mean distances from the truth, in map pixels.
struct Errors {
    landmark: f64,
    refined: f64,
    /// Nearest landmark with coordinates in f64, from the same frames.
    exact: f64,
    /// Share of the fixes that name the same landmark.
    same: f64,
}

fn part_of(map: &TestMap) -> Map {
    let whole = map.open();
    let corner = |side: u32| (side - PART_PX) / 2;
    let (x, y) = (corner(whole.width()), corner(whole.height()));
    let part = imageops::crop_imm(whole.luminance(), x, y, PART_PX, PART_PX).to_image();
    Map::from_luminance(map.name, part)
}

fn settings(map: &TestMap) -> Settings {
    Settings {
        stride_px: Some(STRIDE_PX),
        view_size_px: map.view_size_px,
        scale: f64::from(map.view_size_px) / 20.0,
        selection: Selection::All,
        normalize: Normalize::Std,
        metric: Metric::Euclid,
        dimensions: 50,
        ..Settings::default()
    }
}

fn measure(map: &Map, trained: &Trained, settings: &Settings) -> Errors {
    let atlas = trained.atlas();
    let camera = Camera::for_atlas(&atlas);
    let mut localizer = Localizer::new(atlas.clone());
    let mut view = View::black(atlas.eigenspace().side());
    let preprocess = Preprocess::new(
        settings.view_side() as usize,
        settings.normalize,
        settings.blur,
        settings.highpass_px,
    );
    let mut frame = camera.frame();
    let mut random = seeded(8, 8);
    let mut errors = [0.0; 4];
    // Room for the footprint, turned and seen from higher up.
    let margin = settings.view_size_px as f32 * 0.55;
    for _ in 0..VIEWS {
        let mut at = || random.random_range(margin..PART_PX as f32 - margin);
        let place = Point {
            x_px: at(),
            y_px: at(),
        };
        let mut small = |most: f64| random.random_range(-most..=most);
        let scene = Scene {
            heading_rad: small(2_f64.to_radians()),
            altitude_ratio: 1.0 + small(0.02),
            gamma: 1.0 + small(0.05),
            noise: 2.0,
            ..Scene::nominal(place)
        };
        camera.render(map, &scene, &mut random, &mut frame);
        let fix = localizer
            .locate(&frame.as_frame())
            .expect("there is contrast");
        reduce(&frame.as_frame(), &mut view);
        let exact =
            trained
                .candidates
                .grid()
                .place(nearest_exactly(trained, settings, &preprocess, &view));
        let distance = |to: Point| f64::from((to.x_px - place.x_px).hypot(to.y_px - place.y_px));
        let same = f64::from(u8::from(exact == fix.place));
        let found = [
            distance(fix.place),
            distance(fix.position),
            distance(exact),
            same,
        ];
        for (sum, value) in errors.iter_mut().zip(found) {
            *sum += value / VIEWS as f64;
        }
    }
    let [landmark, refined, exact, same] = errors;
    Errors {
        landmark,
        refined,
        exact,
        same,
    }
}

/// The candidate nearest to a view, with nothing rounded.
fn nearest_exactly(
    trained: &Trained,
    settings: &Settings,
    preprocess: &Preprocess,
    view: &View,
) -> u32 {
    let model = &trained.model;
    let x = preprocess
        .of_pixels(view.pixels())
        .expect("there is contrast");
    let rows = model.rows().zip(model.whitening(settings.whiten));
    let project = |(row, whitening): (&[f64], f64)| {
        let deviations = x.iter().zip(&model.mean).map(|(x, mean)| x - mean);
        let g: f64 = row.iter().zip(deviations).map(|(e, x)| e * x).sum();
        g * whitening
    };
    let g: Vec<f64> = rows.map(project).collect();
    let distances = trained
        .coordinates
        .chunks_exact(model.dimensions)
        .map(|candidate| dissimilarity(settings.metric, &g, candidate));
    let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or(0, |(index, _)| index as u32 + 1)
}

#[test]
fn positions_between_landmarks_are_at_least_twice_as_near_and_narrow_coefficients_lose_little() {
    for map in maps::all() {
        let part = part_of(&map);
        for (width, most) in MAX_LOSS {
            let settings = Settings {
                width,
                ..settings(&map)
            };
            let errors = checked(&map, &part, &settings);
            let loss = errors.landmark / errors.exact;
            assert!(loss <= most, "{}: {width:?} loses {loss:.3}", map.name);
        }
    }
}

#[test]
fn the_high_passed_cosine_table_is_refined_as_well() {
    for map in maps::all() {
        let settings = Settings {
            metric: Metric::Cosine,
            highpass_px: 3.0,
            whiten: 0.5,
            dimensions: 96,
            width: Width::I8,
            ..settings(&map)
        };
        checked(&map, &part_of(&map), &settings);
    }
}

fn checked(map: &TestMap, part: &Map, settings: &Settings) -> Errors {
    let trained = train(part, settings, false, &Progress::Hidden).expect("trains");
    let errors = measure(part, &trained, settings);
    let ratio = errors.refined / errors.landmark;
    println!(
        "{}: {} landmarks, {} dimensions, {:?}, {:?}: error of the landmark {:.2} map pixels ({:.2} in f64, \
         {:.1} % the same), refined {:.2}, ratio {ratio:.2}",
        map.name,
        trained.selected.landmarks.len(),
        settings.dimensions,
        settings.metric,
        settings.width,
        errors.landmark,
        errors.exact,
        100.0 * errors.same,
        errors.refined,
    );
    assert!(ratio <= MAX_RATIO, "{}: {ratio:.2}", map.name);
    errors
}
