//! Tables of several headings and altitudes on every map: a fix finds out how the vehicle heads, and how high it flies.
//!
//! Frames at random places and headings, anywhere between the landmarks of a grid; noise of light as calibration calls
//! slight. A fix is right within a quarter of the footprint and 45° of the truth.

use eigenmark::{
    learn::Settings,
    map::Map,
    output::Progress,
    select::Selection,
    simulate::{Camera, Scene, seeded},
    train::{MeasuredHeadings, measure_headings, train},
};
use eigenmark_core::{
    atlas::Atlas,
    eigenspace::Normalize,
    landmark::{Metric, Point, Prior, Sector},
    localizer::{Fix, Localizer},
    math::turn,
    preprocess::{MAX_HEADING_RAD, Pose},
};
use eigenmark_tests::maps::{self, TestMap};
use image::imageops;
use rand::{Rng, RngExt};

/// Side of the part of a map that is gone over, in pixels.
const PART_PX: u32 = 600;

/// Frames per table.
const FRAMES: usize = 400;

/// How far off a compass is, at most, in degrees.
const COMPASS_DEG: f64 = 10.0;

/// Least share of known fixes, in percent. Measured: 98.75 to 100.
const MIN_KNOWN_PERCENT: f64 = 97.0;

/// Largest median error of the position, as a share of the footprint. Measured: 0.011 (city) to 0.055 (kitsap).
const MAX_POSITION: f64 = 0.1;

/// A table, and what it must reach.
struct Case {
    /// Step of the grid, in map pixels.
    stride_px: u32,
    headings: u8,
    altitudes: &'static [f32],
    /// Least share of right fixes in percent, without and with a compass.
    right_percent: [f64; 2],
    /// Largest median error of the heading, in degrees.
    heading_deg: f64,
    /// Most that it may be of the error before refinement.
    refined_ratio: f64,
    /// Largest median error of the altitude, in percent.
    altitude_percent: f64,
    /// Most of the table that a compass may leave to be looked at, in percent, on average.
    plausible_percent: f64,
}

/// What was measured.
#[derive(Debug, Default)]
struct Measured {
    right_percent: f64,
    known_percent: f64,
    /// Median errors of the right fixes.
    heading_deg: f64,
    /// The same of the landmarks' own headings.
    unrefined_deg: f64,
    position_px: f64,
    /// Of the logarithm.
    altitude_percent: f64,
    /// Mean share of the landmarks that was looked at.
    plausible_percent: f64,
}

fn part_of(map: &TestMap) -> Map {
    let whole = map.open();
    let corner = |side: u32| (side - PART_PX) / 2;
    let (x, y) = (corner(whole.width()), corner(whole.height()));
    let part = imageops::crop_imm(whole.luminance(), x, y, PART_PX, PART_PX).to_image();
    Map::from_luminance(map.name, part)
}

fn settings(map: &TestMap, stride_px: u32, headings: u8, altitudes: &[f32]) -> Settings {
    Settings {
        stride_px: Some(stride_px),
        view_size_px: map.view_size_px,
        scale: f64::from(map.view_size_px) / 20.0,
        selection: Selection::All,
        normalize: Normalize::Std,
        metric: Metric::Euclid,
        dimensions: 50,
        headings,
        altitudes: altitudes.iter().copied().collect(),
        ..Settings::default()
    }
}

/// A scene somewhere on the grid of an atlas, at any heading and an altitude between its own.
fn draw(atlas: &Atlas<'_>, random: &mut impl Rng) -> Scene {
    let survey = atlas.survey();
    let lattice = survey.lattices[0];
    let last = lattice.point(u32::from(lattice.columns) - 1, u32::from(lattice.rows) - 1);
    let place = Point {
        x_px: random.random_range(lattice.origin.x_px..=last.x_px),
        y_px: random.random_range(lattice.origin.y_px..=last.y_px),
    };
    let (lowest, highest) = (
        survey.altitudes[0],
        survey.altitudes[survey.altitudes.len() - 1],
    );
    Scene {
        heading_rad: random.random_range(0.0..std::f64::consts::TAU),
        altitude_ratio: random.random_range(f64::from(lowest) / 1.02..=f64::from(highest) * 1.02),
        gamma: random.random_range(0.95..=1.05),
        noise: 2.0,
        ..Scene::nominal(place)
    }
}

/// Fixes of the same scenes, with nothing known and with a compass.
fn measure(map: &Map, atlas: &Atlas<'_>) -> [Measured; 2] {
    let camera = Camera::for_atlas(atlas);
    let mut localizer = Localizer::new(atlas.clone());
    let mut frame = camera.frame();
    let mut random = seeded(8, 8);
    let mut fixes: [Vec<(Scene, Fix)>; 2] = Default::default();
    let mut looked_at = [0; 2];
    for _ in 0..FRAMES {
        let scene = draw(atlas, &mut random);
        camera.render(map, &scene, &mut random, &mut frame);
        let error_deg = random.random_range(-COMPASS_DEG..=COMPASS_DEG);
        let compass = Sector {
            heading_rad: (scene.heading_rad + error_deg.to_radians()) as f32,
            tolerance_rad: COMPASS_DEG.to_radians() as f32,
        };
        for (index, heading) in [None, Some(compass)].into_iter().enumerate() {
            let prior = Prior {
                heading,
                ..Prior::NONE
            };
            let plausible = atlas.landmarks().plausible(atlas.survey(), &prior);
            looked_at[index] += plausible.clone().map(|run| run.len()).sum::<usize>();
            let fix = localizer.locate_among(&frame.as_frame(), &Pose::NOMINAL, plausible);
            fixes[index].push((scene, fix.expect("there is contrast")));
        }
    }
    let all = (FRAMES * atlas.landmarks().len()) as f64;
    [0, 1].map(|index| Measured {
        plausible_percent: 100.0 * looked_at[index] as f64 / all,
        ..Measured::of(atlas, &fixes[index])
    })
}

impl Measured {
    fn of(atlas: &Atlas<'_>, fixes: &[(Scene, Fix)]) -> Self {
        let percent = |count: usize| 100.0 * count as f64 / fixes.len() as f64;
        let heading_error = |scene: &Scene, heading_rad: f32| {
            f64::from(
                turn(scene.heading_rad as f32, heading_rad)
                    .abs()
                    .to_degrees(),
            )
        };
        let away = |scene: &Scene, fix: &Fix| {
            let (from, to) = (scene.place, fix.position);
            f64::from((from.x_px - to.x_px).hypot(from.y_px - to.y_px))
        };
        let nearest_px = f64::from(atlas.header().footprint_px) / 4.0;
        let is_right = |scene: &Scene, fix: &Fix| {
            away(scene, fix) < nearest_px && heading_error(scene, fix.heading_rad) < 45.0
        };
        let right: Vec<&(Scene, Fix)> = fixes.iter().filter(|(s, fix)| is_right(s, fix)).collect();
        let of_right = |error: &dyn Fn(&Scene, &Fix) -> f64| {
            median(right.iter().map(|(scene, fix)| error(scene, fix)).collect())
        };
        Self {
            right_percent: percent(right.len()),
            known_percent: percent(fixes.iter().filter(|(_, fix)| fix.known).count()),
            heading_deg: of_right(&|scene, fix| heading_error(scene, fix.heading_rad)),
            unrefined_deg: of_right(&|scene, fix| {
                let landmark = atlas.survey().heading_rad(fix.view);
                heading_error(scene, landmark.expect("a candidate"))
            }),
            position_px: of_right(&away),
            altitude_percent: of_right(&|scene, fix| {
                100.0
                    * (f64::from(fix.altitude_ratio) / scene.altitude_ratio)
                        .ln()
                        .abs()
            }),
            ..Self::default()
        }
    }
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

fn check(case: &Case) {
    for map in maps::all() {
        let part = part_of(&map);
        let settings = settings(&map, case.stride_px, case.headings, case.altitudes);
        let trained = train(&part, &settings, false, &Progress::Hidden).expect("trains");
        let atlas = trained.atlas();
        let found = measure(&part, &atlas);
        let name = map.name;
        println!("{name}: {} landmarks", atlas.landmarks().len());
        for (what, found) in ["no compass", "compass"].iter().zip(&found) {
            println!("  {what:<11} {found:.2?}");
        }
        for (found, least) in found.iter().zip(case.right_percent) {
            assert!(found.right_percent >= least, "{name}: {found:?}");
            assert!(
                found.known_percent >= MIN_KNOWN_PERCENT,
                "{name}: {found:?}"
            );
            let most_px = MAX_POSITION * f64::from(map.view_size_px);
            assert!(found.position_px <= most_px, "{name}: {found:?}");
            assert!(found.heading_deg <= case.heading_deg, "{name}: {found:?}");
            let ratio = found.heading_deg / found.unrefined_deg;
            assert!(ratio <= case.refined_ratio, "{name}: {ratio:.2}");
            assert!(
                found.altitude_percent <= case.altitude_percent,
                "{name}: {found:?}"
            );
        }
        assert_eq!(found[0].plausible_percent, 100.0);
        assert!(
            found[1].plausible_percent <= case.plausible_percent,
            "{name}: {found:?}"
        );
    }
}

#[test]
fn twelve_headings_find_out_the_heading() {
    check(&Case {
        stride_px: 16,
        headings: 12,
        altitudes: &[1.0],
        right_percent: [80.0, 88.0],
        heading_deg: 4.5,
        refined_ratio: 0.6,
        altitude_percent: 1.5,
        plausible_percent: 16.0,
    });
}

#[test]
fn more_headings_are_more_exact() {
    check(&Case {
        stride_px: 16,
        headings: 18,
        altitudes: &[1.0],
        right_percent: [94.0, 95.0],
        heading_deg: 2.6,
        refined_ratio: 0.5,
        altitude_percent: 1.5,
        plausible_percent: 13.0,
    });
}

#[test]
fn altitudes_are_found_out_beside_headings() {
    check(&Case {
        stride_px: 16,
        headings: 12,
        altitudes: &[0.9, 1.1],
        right_percent: [78.0, 85.0],
        heading_deg: 4.8,
        refined_ratio: 0.65,
        altitude_percent: 5.5,
        plausible_percent: 16.0,
    });
}

/// A vehicle that knows its heading but for a few degrees: what levelling leaves is what the fix says.
#[test]
fn headings_are_relative_to_the_pose_of_a_frame() {
    let map = TestMap::city();
    let part = part_of(&map);
    let settings = settings(&map, 16, 12, &[1.0]);
    let trained = train(&part, &settings, false, &Progress::Hidden).expect("trains");
    let atlas = trained.atlas();
    let camera = Camera::for_atlas(&atlas);
    let mut localizer = Localizer::new(atlas.clone());
    let mut frame = camera.frame();
    let mut random = seeded(9, 9);
    let mut errors_deg = Vec::new();
    for _ in 0..100 {
        let scene = draw(&atlas, &mut random);
        camera.render(&part, &scene, &mut random, &mut frame);
        // A compass that is wrong by far more than levelling would bear.
        let said_rad = scene.heading_rad + random.random_range(-2.0..=2.0);
        let pose = Pose::new(said_rad as f32 % MAX_HEADING_RAD, 1.0).expect("in range");
        let Some(fix) = localizer.locate_at(&frame.as_frame(), &pose) else {
            continue;
        };
        let error = turn(scene.heading_rad as f32, fix.heading_from(&pose));
        errors_deg.push(f64::from(error.abs().to_degrees()));
    }
    assert!(errors_deg.len() > 90, "{}", errors_deg.len());
    let median = median(errors_deg);
    println!("{median:.2}°");
    assert!(median <= 5.0, "{median:.2}°");
}

#[test]
fn the_number_of_headings_follows_from_what_landmarks_tolerate() {
    for map in maps::all() {
        let opened = map.open();
        let of = |settings: &Settings| {
            measure_headings(&opened, settings, &Progress::Hidden).expect("learns")
        };
        let sparse = Settings {
            view_size_px: map.view_size_px,
            ..Settings::default()
        };
        let [sparse, dense] = [of(&sparse), of(&settings(&map, 16, 1, &[1.0]))];
        println!("{}: {sparse:.1?} {dense:.1?}", map.name);
        for MeasuredHeadings {
            headings,
            orientation_deg: [left, right],
        } in [sparse, dense]
        {
            let width = right - left;
            assert!(
                f64::from(headings) * width >= 360.0,
                "the whole circle is tolerated"
            );
            let is_least = headings == 4 || f64::from(headings - 1) * width < 360.0;
            assert!(is_least, "with one less it would not be");
        }
        assert!(dense.headings > sparse.headings);
    }
}
