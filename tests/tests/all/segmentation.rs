//! What segmentation by color is worth on every map; report section 5.2.1. The measured table is committed in
//! `tests/segmentation.md`; set `EIGENMARK_BLESS` to renew it.

use std::fmt::Write;

use eigenmark::{
    evaluate::{
        Criterion,
        reliability::{Measure, Steps},
    },
    experiment::segmentation::{SegmentationEffect, Variant, segmentation_effect},
    learn::Settings,
    map::open_color,
    output::Progress,
};
use eigenmark_tests::{
    maps::{self, TestMap},
    record::compare_or_bless,
};

/// Colors of a palette.
const COLORS: usize = 6;

/// Seed of the palettes.
const SEED: u64 = 1;

/// Another processor rounds otherwise, and a limit may move by a step.
const TOLERANCE: fn(usize, f64) -> f64 = |_, committed| 0.005 * committed.abs() + 0.002;

fn effect(map: &TestMap) -> SegmentationEffect {
    let picture = open_color(&map.path).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings {
        view_size_px: map.view_size_px,
        ..Settings::default()
    };
    let steps = Steps { gamma: 0.1 };
    let found = segmentation_effect(
        &picture,
        &settings,
        (COLORS, SEED),
        steps,
        &Progress::Hidden,
    );
    found.unwrap_or_else(|error| panic!("{error}"))
}

fn rows(map: &TestMap, found: &SegmentationEffect, out: &mut String) {
    for one in &found.variants {
        let variant = match one.variant {
            Variant::Plain => "plain",
            Variant::Segmented => "segmented",
            Variant::SegmentedMapOnly => "segmented map, plain camera",
        };
        let _ = write!(out, "| {} | {variant} ", map.name);
        for criterion in Criterion::ALL {
            let mean = one.mean.by(criterion);
            for (measure, digits) in Measure::REPORT.into_iter().zip([1, 3, 2]) {
                for side in [0, 1] {
                    let (limit, counted) =
                        (mean.limits[&measure][side], mean.counted[&measure][side]);
                    let of = if counted == 8 {
                        String::new()
                    } else {
                        format!(" ({counted})")
                    };
                    let _ = write!(out, "| {limit:.digits$}{of} ");
                }
            }
            let _ = write!(out, "| {:.3} ", 100.0 * mean.catchment_share);
        }
        out.push_str("|\n");
    }
}

#[test]
fn the_table_of_variants_is_up_to_date() {
    let mut out = HEAD.to_owned();
    let mut palettes = PALETTES.to_owned();
    for map in maps::all() {
        let found = effect(&map);
        rows(&map, &found, &mut out);
        let colors = found.palette.iter().map(|color| {
            let [red, green, blue] = color.rgb;
            format!(
                "#{red:02x}{green:02x}{blue:02x} {:.0} %",
                100.0 * color.share
            )
        });
        let colors: Vec<String> = colors.collect();
        let _ = writeln!(palettes, "| {} | {} |", map.name, colors.join(", "));
    }
    compare_or_bless("segmentation.md", &(out + &palettes), TOLERANCE);
}

const HEAD: &str = "\
# What segmentation by color is worth

Six colors; scale 1/10, gauss1, eight landmarks by profile in 15 dimensions, in double precision; gamma in steps of 0.1.
Each variant has its own landmarks; means over those whose limit does not end at the map's edge (in parentheses how many,
where not all eight are). Segmented: learned on the segmented map and seen on it, light changes before segmentation.
Catchments in percent of the map. Where not even the nominal view passes, limits are nominal and the catchment is empty.

Palettes of other seeds move single figures: over four of them, a segmented catchment with a guarantee is 0.114 to 0.335 %
on the city, 0.074 to 0.083 on wellington, 0.056 to 0.091 on nust, 0.071 to 0.077 on kitsap.

| map | variant | nearest: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % | guaranteed: orientation, ° from | to | altitude from | to | gamma from | to | catchment, % |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const PALETTES: &str = "
## Palettes

From dark to light, with their shares.

| map | colors |
| --- | --- |
";
