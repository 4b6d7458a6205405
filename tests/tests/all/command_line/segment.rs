//! `segment`: a map in color becomes a map of a few grays.

use std::fs;

use eigenmark::map::{city, load_color};
use eigenmark_tests::cli::run;
use image::{DynamicImage, ImageFormat, RgbImage, imageops::crop_imm};

use super::Fixture;

fn small_city() -> RgbImage {
    crop_imm(&city::draw(), 100, 100, 400, 300).to_image()
}

fn fixture() -> Fixture {
    let fixture = Fixture::empty();
    small_city()
        .save(fixture.path("color.png"))
        .expect("writable");
    fixture
}

#[test]
fn segmented_maps_are_maps_like_any_other() {
    let fixture = fixture();
    let [map, out, atlas] = ["color.png", "gray.png", "gray.atlas"].map(|name| fixture.name(name));
    let segment = |more: &[&str]| {
        let base = ["segment", "--map", &map, "--out", &out];
        let output = run(&[&base[..], more].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        output.stdout
    };
    let printed: serde_json::Value =
        serde_json::from_slice(&segment(&["--colors", "4", "--json"])).expect("one object");
    assert_eq!(
        (&printed["width"], &printed["height"]),
        (&400.into(), &300.into())
    );
    let palette = printed["palette"].as_array().expect("a list");
    let grays: Vec<u64> = palette
        .iter()
        .map(|color| color["gray"].as_u64().expect("a level"))
        .collect();
    assert_eq!(grays, [0, 85, 170, 255]);
    let shares = palette
        .iter()
        .map(|color| color["share"].as_f64().expect("a share"));
    assert!((shares.sum::<f64>() - 1.0).abs() < 1e-12);
    let rgb = palette[0]["rgb"].as_str().expect("a color");
    assert!(rgb.len() == 7 && rgb.starts_with('#'), "{rgb}");

    let picture = image::open(&out).expect("a picture");
    let DynamicImage::ImageLuma8(gray) = &picture else {
        panic!("gray");
    };
    assert_eq!(gray.dimensions(), (400, 300));
    assert!(gray.iter().all(|&level| grays.contains(&level.into())));
    let bytes = fs::read(&out).expect("written");
    segment(&["--colors", "4"]);
    assert!(fs::read(&out).expect("written") == bytes, "other bytes");

    let arguments = ["--view-size", "100", "--scale", "5", "--dims", "5"];
    let train = ["train", "--map", &out, "--out", &atlas];
    assert!(run(&[&train[..], &arguments].concat()).status.success());

    let text = String::from_utf8(segment(&[])).expect("utf-8");
    assert!(text.contains("400×300 pixels of 6 colors"), "{text}");
    // A head, and a line per color.
    assert_eq!(text.lines().count(), 2 + 6, "{text}");
}

#[test]
fn what_cannot_be_segmented_is_refused() {
    let fixture = fixture();
    fs::write(fixture.path("text.png"), "this is no picture\n").expect("writable");
    let refuses = |map: &str, out: &str, more: &[&str], expected: &str| {
        let base = ["segment", "--map", map, "--out", out];
        fixture.refuses(&[&base[..], more].concat(), expected);
    };
    let colors = "is not in 2..=64";
    refuses("@color.png", "@new.png", &["--colors", "1"], colors);
    refuses("@color.png", "@new.png", &["--colors", "65"], colors);
    refuses(
        "@absent.png",
        "@new.png",
        &[],
        "absent.png: cannot read the picture",
    );
    refuses(
        "@text.png",
        "@new.png",
        &[],
        "text.png: expected a PNG, JPEG or TIFF picture",
    );
    refuses("builtin:village", "@new.png", &[], "no such built-in map");
    refuses("@color.png", "@no/such/dir.png", &[], "cannot write");
    fixture.refuses(&["segment", "--map", "@color.png"], "--out <PNG>");
}

#[test]
fn every_kind_of_color_picture_has_the_same_colors() {
    let fixture = Fixture::empty();
    let picture = small_city();
    let color = DynamicImage::from(picture.clone());
    for (name, other, format) in [
        ("rgb8.png", color.clone(), ImageFormat::Png),
        ("rgba8.png", color.to_rgba8().into(), ImageFormat::Png),
        ("rgb16.png", color.to_rgb16().into(), ImageFormat::Png),
        ("rgba16.tif", color.to_rgba16().into(), ImageFormat::Tiff),
    ] {
        let path = fixture.path(name);
        other.save_with_format(&path, format).expect("writable");
        assert!(load_color(&path).expect("a picture") == picture, "{name}");
    }
    let gray = color.to_luma8();
    let path = fixture.path("gray16.png");
    DynamicImage::from(gray.clone())
        .to_luma16()
        .save(&path)
        .expect("writable");
    let found = load_color(&path).expect("a picture");
    assert!(
        found
            .pixels()
            .zip(gray.pixels())
            .all(|(rgb, level)| rgb.0 == [level.0[0]; 3])
    );
}
