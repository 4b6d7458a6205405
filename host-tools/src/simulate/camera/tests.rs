use eigenmark_core::landmark::Point;

use super::*;
use crate::simulate::seeded;
use image::GrayImage;

fn map() -> Map {
    let picture = GrayImage::from_fn(400, 300, |x, y| {
        image::Luma([((x * 7 + y * 13) % 256) as u8])
    });
    Map::from_luminance("test", picture)
}

#[test]
fn at_nominal_pose_and_the_maps_scale_pixels_are_copied() {
    let camera = Camera::finest(100);
    let mut frame = camera.frame();
    let scene = Scene::nominal(Point {
        x_px: 150.0,
        y_px: 120.0,
    });
    camera.render(&map(), &scene, &mut seeded(1, 1), &mut frame);
    for (i, &pixel) in frame.pixels.iter().enumerate() {
        let (x, y) = (100 + i as u32 % 100, 70 + i as u32 / 100);
        assert_eq!(pixel, map().luminance().get_pixel(x, y).0[0]);
    }
}

#[test]
fn a_moving_camera_smears_along_its_way() {
    let mut picture = GrayImage::new(400, 300);
    picture.put_pixel(200, 150, image::Luma([210]));
    let map = Map::from_luminance("test", picture);
    let camera = Camera::finest(100);
    let mut frame = camera.frame();
    let scene = Scene {
        motion_px: [20.0, 0.0],
        ..Scene::nominal(Point {
            x_px: 200.0,
            y_px: 150.0,
        })
    };
    camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
    for (x, expected) in [(39, 0), (40, 13), (60, 13), (61, 0)] {
        assert_eq!(frame.pixels[50 * 100 + x], expected, "column {x}");
    }
    assert!(frame.pixels[49 * 100..50 * 100].iter().all(|&p| p == 0));
}

#[test]
fn an_occlusion_hides_its_share_of_its_corner() {
    let white = Map::from_luminance("white", GrayImage::from_pixel(400, 300, image::Luma([255])));
    let scene = Scene::nominal(Point {
        x_px: 200.0,
        y_px: 150.0,
    });
    for (camera, left) in [
        (Camera::finest(100), 0),
        (
            Camera {
                width: 160,
                ..Camera::finest(100)
            },
            30,
        ),
    ] {
        for (corner, x, y) in [
            (Corner::TopLeft, 0, 0),
            (Corner::TopRight, 99, 0),
            (Corner::BottomLeft, 0, 99),
            (Corner::BottomRight, 99, 99),
        ] {
            let occlusion = Some(Occlusion {
                corner,
                share: 0.25,
            });
            let mut frame = camera.frame();
            let scene = Scene { occlusion, ..scene };
            camera.render(&white, &scene, &mut seeded(1, 1), &mut frame);
            let black = frame.pixels.iter().filter(|&&pixel| pixel == 0).count();
            assert_eq!(black, 2500, "{corner:?}");
            assert_eq!(frame.pixels[y * usize::from(camera.width) + left + x], 0);
        }
    }
}

#[test]
fn a_quarter_turn_clockwise_puts_map_right_at_the_top() {
    let mut picture = GrayImage::new(400, 300);
    picture.put_pixel(249, 120, image::Luma([200])); // right of the middle
    let map = Map::from_luminance("test", picture);
    let camera = Camera::finest(100);
    let mut frame = camera.frame();
    let heading_rad = std::f64::consts::FRAC_PI_2;
    let scene = Scene {
        heading_rad,
        ..Scene::nominal(Point {
            x_px: 200.5,
            y_px: 120.5,
        })
    };
    camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
    let brightest = (0..10_000)
        .max_by_key(|&i| frame.pixels[i])
        .expect("pixels");
    assert!(brightest / 100 <= 1, "row {}", brightest / 100);
}

/// A frame of the map in the middle of which a square is bright.
fn tilted(roll_rad: f64, pitch_rad: f64) -> (CameraFrame, Camera) {
    let picture = GrayImage::from_fn(400, 300, |x, y| {
        image::Luma([if x.abs_diff(200) < 3 && y.abs_diff(150) < 3 {
            255
        } else {
            40
        }])
    });
    let camera = Camera {
        width: 160,
        height: 120,
        footprint_px: 120.0,
        field_of_view_rad: FIELD_OF_VIEW_RAD,
    };
    let scene = Scene {
        roll_rad,
        pitch_rad,
        ..Scene::nominal(Point {
            x_px: 200.5,
            y_px: 150.5,
        })
    };
    let map = Map::from_luminance("test", picture);
    let mut frame = camera.frame();
    camera.render(&map, &scene, &mut seeded(1, 1), &mut frame);
    (frame, camera)
}

#[test]
fn a_tilted_camera_sees_what_is_below_off_the_middle() {
    // F·tan 0.1 = 60 / tan 30° · 0.1003 = 10.4 pixels.
    for (roll, pitch, expected) in [(0.1, 0.0, [90.4, 60.0]), (0.0, 0.1, [80.0, 70.4])] {
        let (frame, _) = tilted(roll, pitch);
        let bright = frame.pixels.iter().enumerate().filter(|&(_, &p)| p > 150);
        let (mut sum, mut count) = ([0.0, 0.0], 0.0);
        for (i, _) in bright {
            sum[0] += (i % 160) as f64 + 0.5;
            sum[1] += (i / 160) as f64 + 0.5;
            count += 1.0;
        }
        for axis in 0..2 {
            let found = sum[axis] / count;
            assert!((found - expected[axis]).abs() < 0.5, "{found} {expected:?}");
        }
    }
}

#[test]
fn a_hardly_tilted_frame_is_nearly_the_untilted_one() {
    let largest = |a: &CameraFrame, b: &CameraFrame| {
        let pairs = a.pixels.iter().zip(&b.pixels);
        pairs.map(|(a, b)| a.abs_diff(*b)).max()
    };
    let (level, _) = tilted(0.0, 0.0);
    assert!(largest(&level, &tilted(1e-9, 0.0).0) <= Some(1));
    assert!(largest(&level, &tilted(0.0, 1e-9).0) <= Some(1));
}

#[test]
fn frames_that_leave_the_map_are_noticed() {
    let (_, camera) = tilted(0.0, 0.0);
    let at = |x_px, y_px, pitch_rad| {
        let scene = Scene {
            pitch_rad,
            ..Scene::nominal(Point { x_px, y_px })
        };
        camera.is_on_map(&map(), &scene)
    };
    assert!(at(80.0, 60.0, 0.0) && !at(79.9, 60.0, 0.0));
    assert!(!at(80.0, 60.0, 0.1), "looks over the upper edge");
    assert!(!at(200.0, 150.0, 1.2), "looks beyond the horizon");
}
