//! Measured tables that are committed beside the tests, and compared with what is measured now.

use std::fs;

use crate::maps;

/// Compares `measured`, Markdown, with the committed `tests/<name>`, or renews that when `EIGENMARK_BLESS` is set.
/// `tolerance` gives how far a number may be from the committed one, from its column (the first is 1) and that number;
/// everything else must be the same.
///
/// Without the real maps there are fewer lines, and nothing is compared.
///
/// # Panics
/// When something differs, or the record is absent.
pub fn compare_or_bless(name: &str, measured: &str, tolerance: impl Fn(usize, f64) -> f64) {
    let path = maps::workspace().join("tests").join(name);
    if std::env::var_os("EIGENMARK_BLESS").is_some() {
        fs::write(&path, measured).expect("writable");
        return;
    }
    let committed = fs::read_to_string(&path).expect("the committed table");
    if measured.lines().count() < committed.lines().count() {
        println!("skipped: real maps are absent, so the committed {name} is not compared");
        return;
    }
    assert_eq!(measured.lines().count(), committed.lines().count());
    for (measured, committed) in measured.lines().zip(committed.lines()) {
        let [now, then] = [measured, committed].map(|line| line.split('|').collect::<Vec<_>>());
        let is_near = |column: usize| {
            let [now, then] = [now[column].trim(), then[column].trim()];
            match (now.parse::<f64>(), then.parse::<f64>()) {
                (Ok(now), Ok(then)) => (now - then).abs() <= tolerance(column, then),
                _ => now == then,
            }
        };
        assert!(
            now.len() == then.len() && (0..now.len()).all(is_near),
            "measured {measured}\ncommitted {committed}\nEIGENMARK_BLESS=1 renews {name}"
        );
    }
}
