//! `evaluate` as scripts and people meet it.

use std::fs;

use eigenmark_tests::cli::run;

use super::{Fixture, small_map};

/// The numbers of a JSON list.
fn numbers(list: &serde_json::Value) -> Vec<f64> {
    let list = list.as_array().expect("a list").iter();
    list.map(|number| number.as_f64().expect("a number"))
        .collect()
}

#[test]
fn evaluation_says_how_far_landmarks_can_be_trusted() {
    let fixture = Fixture::new();
    let [map, atlas] = ["map.png", "good.atlas"].map(|name| fixture.name(name));
    let base = [
        "evaluate",
        "--map",
        &map,
        "--atlas",
        &atlas,
        "--report-only",
        "--views",
        "40",
    ];
    let evaluate = |more: &[&str]| run(&[&base[..], more].concat());
    let json = |more: &[&str]| {
        let output = evaluate(&[&["--json"], more].concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let text = String::from_utf8(output.stdout).expect("utf-8");
        assert_eq!(text.lines().count(), 1);
        text
    };

    let text = json(&[]);
    let both: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let landmarks = both["landmarks"].as_array().expect("landmarks");
    assert_eq!(landmarks.len(), 8);
    for (landmark, rank) in landmarks.iter().zip(1..) {
        assert_eq!(landmark["landmark"], rank);
        assert!(
            landmark["view"]
                .as_u64()
                .is_some_and(|view| (1..=18).contains(&view))
        );
        let [nearest, guaranteed] = ["nearest", "guaranteed"].map(|by| &landmark[by]);
        for (measure, nominal) in [
            ("orientation_deg", 0.0),
            ("altitude_ratio", 1.0),
            ("gamma", 1.0),
        ] {
            let [wide, narrow] = [nearest, guaranteed].map(|by| numbers(&by[measure]));
            assert!(wide[0] <= narrow[0] && narrow[0] <= nominal, "{landmark}");
            assert!(wide[1] >= narrow[1] && narrow[1] >= nominal, "{landmark}");
            assert_eq!(nearest["ends"][measure].as_array().map(Vec::len), Some(2));
        }
        assert!(nearest["catchment_px"].as_u64() >= guaranteed["catchment_px"].as_u64());
    }
    // Views at the edge of the map cannot be turned without showing what lies beyond.
    let at_edge = landmarks
        .iter()
        .filter(|one| one["nearest"]["ends"]["orientation_deg"][0] == "map");
    assert!(at_edge.count() > 0);
    for by in ["nearest", "guaranteed"] {
        let gammas = landmarks.iter().map(|one| numbers(&one[by]["gamma"])[1]);
        let mean = numbers(&both["mean"][by]["gamma"])[1];
        assert!((gammas.sum::<f64>() / 8.0 - mean).abs() < 1e-9);
        assert!(both["mean"][by]["catchment_px"].as_f64() > Some(0.0));
    }
    let score = &both["mean"]["score"];
    let interval = numbers(&score["right_interval"]);
    assert!(
        score["right"]
            .as_f64()
            .is_some_and(|right| interval[0] < right && right < interval[1])
    );
    assert_eq!(both["f64"]["landmarks"].as_array().map(Vec::len), Some(8));
    assert!(both["core_against_f64"]["nearest"]["equal"].is_u64());

    let core: serde_json::Value =
        serde_json::from_str(&json(&["--through", "core"])).expect("JSON");
    assert_eq!(core["landmarks"], both["landmarks"]);
    let exact: serde_json::Value =
        serde_json::from_str(&json(&["--through", "f64"])).expect("JSON");
    assert_eq!(exact["mean"], both["f64"]["mean"]);

    // Interrupted after some landmarks, it goes on.
    let journal = fixture.name("journal");
    assert_eq!(json(&["--journal", &journal]), text);
    let lines = fs::read_to_string(&journal).expect("written");
    fs::write(&journal, &lines[..lines.len() / 2]).expect("writable");
    assert_eq!(json(&["--journal", &journal]), text);

    let output = evaluate(&[]);
    let text = String::from_utf8(output.stdout).expect("utf-8");
    for word in [
        "nearest",
        "guaranteed",
        "orientation",
        "catchment",
        "score",
        "mean",
        "against f64",
    ] {
        assert!(text.contains(word), "{word} is not in {text}");
    }
    assert_eq!(evaluate(&["--min-score", "0.01"]).status.code(), Some(0));
    let unmet = evaluate(&["--min-score", "1"]);
    assert_eq!(unmet.status.code(), Some(1));
    let stderr = String::from_utf8(unmet.stderr).expect("utf-8");
    assert!(
        stderr.starts_with("error: expected a score of at least 1, found 0."),
        "{stderr}"
    );
}

#[test]
fn localization_matrices_are_written() {
    let fixture = Fixture::new();
    let [map, atlas, out] = ["map.png", "good.atlas", "matrices"].map(|name| fixture.name(name));
    let base = [
        "evaluate",
        "--map",
        &map,
        "--atlas",
        &atlas,
        "--report-only",
        "--views",
        "0",
    ];
    let localize = |more: &[&str]| {
        let output = run(&[
            &base[..],
            &["--through", "f64", "--localization", &out],
            more,
        ]
        .concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).expect("utf-8")
    };
    assert!(localize(&[]).contains("landmark 8"));
    let picture =
        image::open(fixture.path("matrices/matrix-of-landmark-1.png")).expect("a picture");
    assert_eq!((picture.width(), picture.height()), (301, 201));
    let array = fs::read(fixture.path("matrices/matrix-of-landmark-8.npy")).expect("written");
    assert!(array.starts_with(b"\x93NUMPY") && array.len() > 4 * 301 * 201);

    // A candidate, and a picture of its window: the same place.
    let refused = run(&[&base[..], &["--localization", &out, "--of", "7", "7"]].concat());
    assert_eq!(refused.status.code(), Some(2));

    let window = image::imageops::crop_imm(&small_map(), 200, 100, 100, 100).to_image();
    window.save(fixture.path("window.png")).expect("writable");
    let text = localize(&["--json", "--of", "7", &fixture.name("window.png")]);
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let [view, picture] = [0, 1].map(|index| &found["distinctness"][index]);
    assert_eq!(view["name"], "view-7");
    assert_eq!(picture["name"], "window");
    for one in [view, picture] {
        assert_eq!(
            one["own"]["corner"],
            serde_json::json!([200, 100]),
            "{found}"
        );
        assert_eq!(one["is_global"], true);
    }
}

#[test]
fn evaluation_refuses_what_it_cannot_use() {
    let fixture = Fixture::new();
    let refuses = |more: &[&str], expected: &str| {
        let base = ["evaluate", "--map", "@map.png", "--atlas", "@good.atlas"];
        fixture.refuses(&[&base[..], more].concat(), expected);
    };
    refuses(&["--gamma-step", "0"], "expected a number from 0.01 to 9");
    refuses(&["--min-score", "2"], "expected a share from 0 to 1");
    refuses(
        &["--min-score", "0.5", "--views", "0"],
        "--min-score needs --views above 0",
    );
    refuses(&["--of", "3"], "--localization <DIR>");
    refuses(&["--localization", "@map.png"], "map.png: cannot write");
    refuses(
        &["--localization", "@new", "--of", "19"],
        "view 19: expected 1 to 18",
    );
    refuses(
        &["--localization", "@new", "--of", "@text.png"],
        "text.png: expected a PNG, JPEG or TIFF picture",
    );
    refuses(
        &["--localization", "@new", "--of", "@tiny.png"],
        "expected a picture of 32",
    );
    refuses(
        &["--journal", "@text.png", "--report-only"],
        "a journal of another evaluation",
    );
    refuses(
        &["--journal", "@no/such", "--report-only"],
        "cannot read or write the journal",
    );
    fixture.refuses(
        &[
            "evaluate",
            "--map",
            "builtin:city",
            "--atlas",
            "@good.atlas",
        ],
        "the atlas was trained on a map of 400×300 pixels with CRC",
    );
    fixture.refuses(
        &["evaluate", "--map", "@map.png", "--atlas", "@cut.atlas"],
        "cut.atlas",
    );
}
