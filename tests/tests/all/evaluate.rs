//! Evaluation against what it means: every limit and catchment found once more by cutting, reducing, filtering and
//! comparing views one by one; dense projection against single windows; journals and threads.

use std::{collections::HashSet, fs, sync::OnceLock};

use eigenmark::{
    atlas::AtlasBuffer,
    evaluate::{
        Criterion, Deviation, Evaluated, Everywhere, Exact, Journal, JournalError, Judge, Onboard,
        Plan, Site, evaluate,
        localization::{Distinctness, localization_matrices},
        reliability::{End, Measure, Steps},
    },
    learn::{PixelBasis, Settings},
    map::{Integral, Map},
    output::Progress,
    select::{Selection, metric_distance},
    simulate::{Camera, Corner, Occlusion, Scene, seeded},
    train::{Relearned, Trained, train},
};
use eigenmark_core::{
    atlas::{Atlas, Blur},
    eigenspace::Normalize,
    frame::Frame,
    landmark::{Lattice, Metric, Point},
    localizer::Localizer,
    preprocess::{View, reduce},
};
use image::GrayImage;

/// A part of the city with 5×4 and 4×3 views, and what was trained on it.
struct Setup {
    map: Map,
    trained: Trained,
}

impl Setup {
    fn new(scale: f64, normalize: Normalize, metric: Metric) -> Self {
        let city = Map::city();
        let part = image::imageops::crop_imm(city.luminance(), 500, 300, 330, 250).to_image();
        let map = Map::from_luminance("part", part);
        let settings = Settings {
            view_size_px: 60,
            scale,
            blur: Blur::Gauss2,
            dimensions: 6,
            selection: Selection::profile(5),
            normalize,
            highpass_px: 3.0,
            whiten: 0.5,
            metric,
            ..Settings::default()
        };
        let trained = train(&map, &settings, false, &Progress::Hidden).expect("trains");
        Self { map, trained }
    }

    /// A whole ratio of map pixels to view pixels, and a fraction, under all normalizations and metrics.
    fn all() -> &'static [Self; 3] {
        static ALL: OnceLock<[Setup; 3]> = OnceLock::new();
        ALL.get_or_init(|| {
            [
                Self::new(5.0, Normalize::None, Metric::Nssd),
                Self::new(5.0, Normalize::Std, Metric::Cosine),
                Self::new(7.0, Normalize::Mean, Metric::Euclid),
            ]
        })
    }

    fn exact(&self) -> Exact {
        let trained = &self.trained;
        let basis = PixelBasis::new(
            &trained.model,
            trained.candidates.preprocess(),
            trained.settings.whiten,
        );
        let landmarks = &trained.selected.landmarks;
        Exact::new(
            basis,
            trained.settings.metric,
            &trained.coordinates,
            landmarks,
        )
    }

    fn sites(&self) -> Vec<Site> {
        let landmarks = self.trained.selected.landmarks.iter();
        let grid = self.trained.candidates.grid();
        landmarks
            .map(|&view| Site::from(&grid.candidate(view)))
            .collect()
    }

    /// The view that a frame of a scene shows.
    fn view(&self, scene: &Scene) -> View {
        let camera = Camera::finest(60);
        let mut frame = camera.frame();
        camera.render(&self.map, scene, &mut seeded(0, 0), &mut frame);
        self.reduced(&frame.as_frame())
    }

    /// The view of the window at a position.
    fn window(&self, x: u32, y: u32) -> View {
        let stride = self.map.width() as usize;
        let pixels = &self.map.luminance().as_raw()[y as usize * stride + x as usize..];
        self.reduced(&Frame::new(pixels, 60, 60, stride).expect("on the map"))
    }

    fn reduced(&self, frame: &Frame<'_>) -> View {
        let mut view = View::black(self.trained.settings.view_side() as u8);
        reduce(frame, &mut view);
        view
    }

    /// Whether a view is localized at a landmark (0-based) in f64: filtered, projected and compared as the report says.
    fn is_localized(&self, view: &View, landmark: usize, criterion: Criterion) -> bool {
        let trained = &self.trained;
        let Some(x) = trained.candidates.preprocess().of_pixels(view.pixels()) else {
            return false;
        };
        let (model, settings) = (&trained.model, &trained.settings);
        let g = model.rows().map(|row| {
            let centered = x.iter().zip(&model.mean).map(|(x, mean)| x - mean);
            row.iter().zip(centered).map(|(e, x)| e * x).sum::<f64>()
        });
        let g = model.whitened(g.collect(), settings.whiten);
        let k = model.dimensions;
        let point = |landmark: usize| {
            let view = trained.selected.landmarks[landmark] as usize;
            &trained.coordinates[(view - 1) * k..][..k]
        };
        let distance = |a: &[f64], b: &[f64]| metric_distance(settings.metric, a, b);
        let own = distance(&g, point(landmark));
        let others = || (0..5).filter(move |&other| other != landmark);
        match criterion {
            Criterion::Nearest => others().all(|other| own < distance(&g, point(other))),
            Criterion::Guaranteed => {
                let apart = others().map(|other| distance(point(landmark), point(other)));
                own < apart.fold(f64::MAX, f64::min) / 2.0
            }
        }
    }

    /// The same by the core.
    fn is_localized_on_board(&self, view: &View, landmark: usize, criterion: Criterion) -> bool {
        let fix = Localizer::new(self.trained.atlas()).locate_view(view);
        fix.is_some_and(|fix| {
            fix.landmark as usize == landmark
                && match criterion {
                    Criterion::Nearest => fix.distance < fix.second,
                    Criterion::Guaranteed => fix.guaranteed,
                }
        })
    }

    /// The last step before the first failure, and why there is no other.
    fn limit(
        &self,
        scene: impl Fn(i32) -> Option<Scene>,
        passes: impl Fn(&View) -> bool,
    ) -> (i32, End) {
        self.limit_of(|step| scene(step).map(|scene| [scene]), passes)
    }

    /// The same where several scenes have to pass.
    fn limit_of<const N: usize>(
        &self,
        scenes: impl Fn(i32) -> Option<[Scene; N]>,
        passes: impl Fn(&View) -> bool,
    ) -> (i32, End) {
        let camera = Camera::finest(60);
        for step in 0.. {
            let Some(scenes) = scenes(step) else {
                return (step - 1, End::Range);
            };
            if !scenes
                .iter()
                .all(|scene| camera.is_on_map(&self.map, scene))
            {
                return ((step - 1).max(0), End::Map);
            }
            if !scenes.iter().all(|scene| passes(&self.view(scene))) {
                return ((step - 1).max(0), End::Failed);
            }
        }
        unreachable!("ranges end")
    }

    /// The catchment: a spiral over windows that are cut one by one.
    fn catchment(&self, corner: [u32; 2], is_localized: impl Fn(&View) -> bool) -> u64 {
        let (columns, rows) = (self.map.width() - 59, self.map.height() - 59);
        let (x0, y0) = (i64::from(corner[0]), i64::from(corner[1]));
        let on_map = |x: i64, y: i64| {
            (0..i64::from(columns)).contains(&x) && (0..i64::from(rows)).contains(&y)
        };
        let passes =
            |x: i64, y: i64| on_map(x, y) && is_localized(&self.window(x as u32, y as u32));
        let mut counted = HashSet::new();
        if passes(x0, y0) {
            counted.insert((x0, y0));
        }
        for turn in 1.. {
            let before = counted.len();
            // From the right of the middle: down, left, up, right, down.
            let (mut x, mut y) = (x0 + turn, y0);
            let legs = [
                (0, 1, turn),
                (-1, 0, 2 * turn),
                (0, -1, 2 * turn),
                (1, 0, 2 * turn),
                (0, 1, turn),
            ];
            for (dx, dy, length) in legs {
                for _ in 0..length {
                    let near =
                        (-1..=1).any(|i| (-1..=1).any(|j| counted.contains(&(x + i, y + j))));
                    if near && passes(x, y) {
                        counted.insert((x, y));
                    }
                    (x, y) = (x + dx, y + dy);
                }
            }
            if counted.len() == before {
                break;
            }
        }
        counted.len() as u64
    }
}

fn plan() -> Plan {
    Plan {
        measures: Measure::ALL.to_vec(),
        steps: Steps { gamma: 0.25 },
        deviation: Deviation::ROUGH,
        views: 20,
        seed: 3,
    }
}

fn evaluated(setup: &Setup, plan: &Plan, journal: &Journal) -> Vec<Vec<Evaluated>> {
    let (exact, integral) = (setup.exact(), Integral::new(setup.map.luminance()));
    let atlas = setup.trained.atlas();
    let onboard = Onboard::new(&atlas);
    let everywhere = [
        Everywhere::lazily(&onboard, &setup.map, &integral, 60),
        Everywhere::densely(&exact, &setup.map, &integral, 60),
    ];
    let progress = Progress::Hidden;
    let sites = setup.sites();
    evaluate(&setup.map, &sites, &everywhere, plan, journal, &progress).expect("writable")
}

#[test]
fn limits_and_catchments_match_their_literal_twins() {
    for setup in Setup::all() {
        let found = evaluated(setup, &plan(), &Journal::none());
        for (landmark, site) in setup.sites().into_iter().enumerate() {
            let nominal = Scene::nominal(site.place);
            for (judge, evaluated) in found[landmark].iter().enumerate() {
                for criterion in Criterion::ALL {
                    let passes = |view: &View| match judge {
                        0 => setup.is_localized_on_board(view, landmark, criterion),
                        _ => setup.is_localized(view, landmark, criterion),
                    };
                    let one = evaluated.by(criterion);
                    let check = |measure: Measure, side: usize, expected: (f64, End)| {
                        let (value, end) = expected;
                        let what = (landmark, judge, criterion, measure, side);
                        assert!(
                            (one.limits[&measure][side] - value).abs() < 1e-9,
                            "{what:?} {value}"
                        );
                        assert_eq!(one.ends[&measure][side], end, "{what:?}");
                    };
                    for (side, sign) in [(0, -1), (1, 1)] {
                        let degrees = |step: i32| f64::from(sign * step);
                        let turned = |step: i32| {
                            (step <= 180).then(|| Scene {
                                heading_rad: degrees(step).to_radians(),
                                ..nominal
                            })
                        };
                        let (step, end) = setup.limit(turned, passes);
                        check(Measure::Orientation, side, (degrees(step), end));

                        let rolled = |step: i32| {
                            (step <= 45).then(|| Scene {
                                roll_rad: degrees(step).to_radians(),
                                ..nominal
                            })
                        };
                        let (step, end) = setup.limit(rolled, passes);
                        check(Measure::Roll, side, (degrees(step), end));

                        let pitched = |step: i32| {
                            (step <= 45).then(|| Scene {
                                pitch_rad: degrees(step).to_radians(),
                                ..nominal
                            })
                        };
                        let (step, end) = setup.limit(pitched, passes);
                        check(Measure::Pitch, side, (degrees(step), end));

                        let ratio = |step: i32| 1.0 + degrees(step) / 100.0;
                        let climbed = |step: i32| {
                            (0.25..=4.0).contains(&ratio(step)).then(|| Scene {
                                altitude_ratio: ratio(step),
                                ..nominal
                            })
                        };
                        let (step, end) = setup.limit(climbed, passes);
                        check(Measure::Altitude, side, (ratio(step), end));

                        let gamma = |step: i32| (1.0 + 0.25 * f64::from(step)).powi(sign);
                        let lit = |step: i32| {
                            (0.1..=10.0).contains(&gamma(step)).then(|| Scene {
                                gamma: gamma(step),
                                ..nominal
                            })
                        };
                        let (step, end) = setup.limit(lit, passes);
                        check(Measure::Gamma, side, (gamma(step), end));
                    }
                    let hidden = |step: i32| {
                        let share = f64::from(step) / 100.0;
                        let hidden = |corner| Scene {
                            occlusion: Some(Occlusion { corner, share }),
                            ..nominal
                        };
                        (step <= 50).then(|| Corner::ALL.map(hidden))
                    };
                    let (step, end) = setup.limit_of(hidden, passes);
                    check(Measure::Occlusion, 1, (f64::from(step) / 100.0, end));
                    let moved = |step: i32| {
                        let way = f64::from(step) / 50.0 * 60.0;
                        let moved = |motion_px| Scene {
                            motion_px,
                            ..nominal
                        };
                        (step <= 25).then(|| [[way, 0.0], [0.0, way]].map(moved))
                    };
                    let (step, end) = setup.limit_of(moved, passes);
                    check(Measure::Motion, 1, (f64::from(step) / 50.0, end));

                    let area = setup.catchment(site.corner(60), passes);
                    assert_eq!(one.catchment_px, area, "{:?}", (landmark, judge, criterion));
                }
                // ERRATA: guaranteed implies nearest.
                let [nearest, guaranteed] = [&evaluated.nearest, &evaluated.guaranteed];
                assert!(guaranteed.catchment_px <= nearest.catchment_px);
                for (measure, [low, high]) in &guaranteed.limits {
                    assert!(
                        nearest.limits[measure][0] <= *low && *high <= nearest.limits[measure][1]
                    );
                }
            }
        }
    }
}

#[test]
fn views_are_those_of_pictures_cut_large_deformed_and_cut() {
    let setup = &Setup::all()[0];
    let (x, y) = (100, 80);
    let scene = Scene::nominal(Point {
        x_px: x as f32 + 30.0,
        y_px: y as f32 + 30.0,
    });
    let cut =
        |x, y, side| image::imageops::crop_imm(setup.map.luminance(), x, y, side, side).to_image();
    let reduced = |picture: &GrayImage| {
        let side = picture.width() as u16;
        let frame = Frame::new(picture.as_raw(), side, side, usize::from(side));
        setup.reduced(&frame.expect("valid"))
    };
    // Whole turns of a quarter are exact. A heading clockwise turns the picture the other way.
    let quarters: [(f64, GrayImage); 3] = [
        (90.0, image::imageops::rotate270(&cut(x, y, 60))),
        (180.0, image::imageops::rotate180(&cut(x, y, 60))),
        (-90.0, image::imageops::rotate90(&cut(x, y, 60))),
    ];
    for (heading_deg, picture) in quarters {
        let turned = Scene {
            heading_rad: heading_deg.to_radians(),
            ..scene
        };
        assert_eq!(setup.view(&turned), reduced(&picture), "{heading_deg}°");
    }
    // From twice the altitude, twice the window: a bilinear sample takes 2×2 pixels in equal parts.
    let higher = Scene {
        altitude_ratio: 2.0,
        ..scene
    };
    let (found, expected) = (setup.view(&higher), reduced(&cut(x - 30, y - 30, 120)));
    let apart = found
        .pixels()
        .iter()
        .zip(expected.pixels())
        .map(|(a, b)| a.abs_diff(*b));
    assert!(apart.max() <= Some(1), "but for rounding twice");
    // Gamma is the map's before it is reduced.
    let mut darker = cut(x, y, 60);
    for pixel in darker.iter_mut() {
        *pixel = (255.0 * (f64::from(*pixel) / 255.0).powf(1.5)).round() as u8;
    }
    assert_eq!(
        setup.view(&Scene {
            gamma: 1.5,
            ..scene
        }),
        reduced(&darker)
    );
}

#[test]
fn dense_verdicts_and_matrices_match_single_windows() {
    for setup in Setup::all() {
        let (exact, integral) = (setup.exact(), Integral::new(setup.map.luminance()));
        let dense = Everywhere::densely(&exact, &setup.map, &integral, 60);
        let single = Everywhere::lazily(&exact, &setup.map, &integral, 60);
        let (columns, rows) = dense.positions();
        assert_eq!((columns, rows), (330 - 59, 250 - 59));
        for y in 0..rows {
            for x in 0..columns {
                assert_eq!(dense.verdict(x, y), single.verdict(x, y), "{x} {y}");
            }
        }

        let points: Vec<&[f64]> = (0..5).map(|landmark| exact.point(landmark)).collect();
        let sites = setup.sites();
        let done = localization_matrices(&setup.map, 60, &exact, &points, |landmark, matrix| {
            assert_eq!(matrix.size(), (columns as usize, rows as usize));
            for (index, value) in matrix.values().iter().enumerate().step_by(7) {
                let [x, y] = matrix.corner(index);
                let point = exact.basis().project(setup.window(x, y).pixels());
                let expected = exact.dissimilarity(&point.expect("has contrast"), points[landmark]);
                let difference = (f64::from(*value) - expected).abs();
                assert!(
                    difference <= 1e-6 * (1.0 + expected),
                    "{x} {y}: {value} {expected}"
                );
            }
            let found = Distinctness::of(&matrix, 60, Some(sites[landmark].corner(60)));
            let own = found.own.expect("it is similar to itself");
            assert!(found.is_global && f64::from(own.value) < 1e-6, "{found:?}");
            assert_eq!(own.corner, sites[landmark].corner(60));
            Ok::<(), ()>(())
        });
        assert_eq!(done, Ok(()));
    }
}

#[test]
fn an_interrupted_evaluation_goes_on_and_threads_do_not_matter() {
    let setup = &Setup::all()[0];
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("journal");
    let whole = evaluated(setup, &plan(), &Journal::none());
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let alone = alone
        .expect("a thread")
        .install(|| evaluated(setup, &plan(), &Journal::none()));
    assert_eq!(whole, alone);

    let journal = Journal::open(&path, "this").expect("begins");
    assert_eq!(evaluated(setup, &plan(), &journal), whole);
    drop(journal);
    let text = fs::read_to_string(&path).expect("written");
    assert_eq!(text.lines().count(), 6);
    // Interrupted in the middle of the fourth landmark.
    let third = text.match_indices('\n').nth(3).expect("lines").0;
    fs::write(&path, &text[..third + 100]).expect("writable");
    let journal = Journal::open(&path, "this").expect("opens");
    assert_eq!(journal.len(), 3);
    assert_eq!(evaluated(setup, &plan(), &journal), whole);
    drop(journal);
    let mut again: Vec<String> = fs::read_to_string(&path)
        .expect("written")
        .lines()
        .map(str::to_owned)
        .collect();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    again.sort();
    lines.sort();
    assert_eq!(again, lines, "the same to the byte, in any order");

    // What does not fit the question is asked again.
    fs::write(&path, format!("{text}{{\"index\":1,\"evaluated\":[]}}\n")).expect("writable");
    let journal = Journal::open(&path, "this").expect("opens");
    assert_eq!(evaluated(setup, &plan(), &journal), whole);
    drop(journal);

    let other = Journal::open(&path, "that");
    assert!(matches!(other, Err(JournalError::OtherEvaluation { .. })));
    fs::write(&path, "this\n{\"index\":0}\n").expect("writable");
    let damaged = Journal::open(&path, "this");
    assert!(
        matches!(damaged, Err(JournalError::Damaged { line: 2, .. })),
        "{damaged:?}"
    );
}

#[test]
fn relearning_gives_what_was_trained() {
    for setup in Setup::all() {
        let relearned = Relearned::new(&setup.map, &setup.trained.atlas()).expect("the same map");
        assert_eq!(relearned.landmarks, setup.trained.selected.landmarks);
        let largest = setup
            .trained
            .coordinates
            .iter()
            .fold(0.0_f64, |most, g| most.max(g.abs()));
        for (found, expected) in relearned
            .space
            .coordinates
            .iter()
            .zip(&setup.trained.coordinates)
        {
            assert!(
                (found - expected).abs() <= 1e-9 * largest,
                "{found} {expected}"
            );
        }
        let other = Relearned::new(&Map::city(), &setup.trained.atlas());
        let message = other.expect_err("another map").to_string();
        assert!(
            message.contains("trained on a map of 330×250 pixels"),
            "{message}"
        );
    }
}

#[test]
fn an_atlas_of_another_grid_is_refused_for_its_map() {
    // The right size and CRC, but a lattice that leaves the map, or fills memory: nothing an atlas says is trusted.
    let setup = &Setup::all()[0];
    let refused = |change: &dyn Fn(&mut Lattice)| {
        let moved = with_lattice(&setup.trained.atlas(), change);
        let relearned = Relearned::new(&setup.map, &moved.atlas());
        relearned.expect_err("refused").to_string()
    };
    let beyond = refused(&|lattice| lattice.origin.x_px = 20.0);
    assert!(beyond.contains("does not lie on the map"), "{beyond}");
    let many = refused(&|lattice| {
        (lattice.columns, lattice.rows) = (u16::MAX, u16::MAX);
        lattice.stride_px = 0.001;
    });
    assert!(many.contains("whole pixels"), "{many}");
    let between = refused(&|lattice| lattice.origin.x_px += 0.25);
    assert!(between.contains("whole pixels"), "{between}");
}

/// The same atlas with another first lattice.
fn with_lattice(atlas: &Atlas<'_>, change: &dyn Fn(&mut Lattice)) -> AtlasBuffer {
    let mut header = atlas.header().clone();
    change(&mut header.survey.lattices[0]);
    let records = atlas.landmarks().records();
    AtlasBuffer::with(atlas, &header, records).expect("the core does not mind")
}

/// A judge is asked about pixels only: views of another side are no views.
#[test]
fn a_view_of_another_side_has_no_verdict() {
    let setup = &Setup::all()[0];
    let atlas = setup.trained.atlas();
    assert_eq!(Onboard::new(&atlas).judge(&[7; 25]), None);
    assert_eq!(setup.exact().judge(&[7; 25]), None);
}
