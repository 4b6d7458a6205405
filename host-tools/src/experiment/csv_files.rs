//! The numbers as CSV files. The first line of each says how to make it again, after a `#`.

use std::{io, path::Path};

use super::{
    Grid, SEVEN,
    claims::{Claim, verdict},
    round,
    segmentation::Segmented,
    seven,
};
use crate::output::{OutputError, write_file};

/// Writes `variance.csv`, `dissimilarities.csv`, `profiles.csv`, `selections.csv`, `reliability.csv`, `clusters.csv`, `silhouettes.csv`,
/// `localization.csv`, `claims.csv` and, where there was one, `segmentation.csv` into `directory`.
///
/// # Errors
/// When a file cannot be written.
pub fn write_csv_files(
    directory: &Path,
    grid: &Grid,
    claims: &[Claim],
    segmented: Option<&Segmented>,
    provenance: &str,
) -> Result<(), OutputError> {
    let write = |name: &str, header: &[&str], rows: Rows| {
        write_file(&directory.join(name), |file| {
            writeln!(file, "# {provenance}")?;
            let mut writer = csv::Writer::from_writer(file);
            writer.write_record(header).map_err(io::Error::other)?;
            for row in rows {
                writer.write_record(row).map_err(io::Error::other)?;
            }
            writer.flush()
        })
    };
    let limits = |first: &[&'static str]| [first, &SEVEN].concat();
    write(
        "variance.csv",
        &["scale", "blur", "dims", "covered_percent"],
        variance(grid),
    )?;
    write(
        "dissimilarities.csv",
        &["scale", "blur", "dims", "mean", "standard_deviation"],
        dissimilarities(grid),
    )?;
    write(
        "profiles.csv",
        &["scale", "blur", "dims", "rank", "view"],
        profiles(grid),
    )?;
    write(
        "selections.csv",
        &["scale", "blur", "dims", "method", "rank", "view"],
        selections(grid),
    )?;
    write(
        "reliability.csv",
        &limits(&["scale", "blur", "dims", "method", "criterion"]),
        reliability(grid),
    )?;
    write(
        "clusters.csv",
        &["scale", "blur", "dims", "dissimilarity", "linkage", "ccc"],
        clusters(grid),
    )?;
    write(
        "silhouettes.csv",
        &[
            "scale",
            "blur",
            "dims",
            "clusters",
            "mean",
            "median",
            "negative_share",
        ],
        silhouettes(grid),
    )?;
    write(
        "localization.csv",
        &[
            "scale",
            "blur",
            "dims",
            "landmark",
            "minima",
            "mean_minima",
            "elsewhere_share",
        ],
        localization(grid),
    )?;
    let of_claims = claims.iter().flat_map(|claim| {
        claim.parts.iter().map(|part| {
            vec![
                claim.claim.to_string(),
                claim.statement.clone(),
                part.what.clone(),
                part.numbers.clone(),
                verdict(part.holds).to_owned(),
            ]
        })
    });
    write(
        "claims.csv",
        &["claim", "statement", "part", "found", "verdict"],
        of_claims.collect(),
    )?;
    let path = directory.join("segmentation.csv");
    let Some(segmented) = segmented else {
        // What an earlier run left is of no segmentation of this one.
        return match std::fs::remove_file(&path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(OutputError { path, source })
            }
            _ => Ok(()),
        };
    };
    let rows = segmented.rows.iter().flat_map(|row| {
        [("nearest", &row.nearest), ("guaranteed", &row.guaranteed)].map(|(criterion, numbers)| {
            with_seven(vec![row.name.clone(), criterion.to_owned()], numbers)
        })
    });
    write(
        "segmentation.csv",
        &limits(&["variant", "criterion"]),
        rows.collect(),
    )
}

/// Rows of fields.
type Rows = Vec<Vec<String>>;

/// Rows of every cell and number of dimensions, after the names of both.
fn of_dims(grid: &Grid, rows: impl Fn(&super::Cell, usize) -> Rows) -> Rows {
    let mut all = Vec::new();
    for cell in &grid.cells {
        for (index, k) in cell.dims.iter().enumerate() {
            for row in rows(cell, index) {
                let names = [cell.scale.to_string(), cell.blur.clone(), k.to_string()];
                all.push(names.into_iter().chain(row).collect());
            }
        }
    }
    all
}

fn variance(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let covered = cell.variance[..cell.dims[index]].iter().sum::<f64>();
        vec![vec![number(100.0 * covered)]]
    })
}

fn dissimilarities(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let spread = cell.dissimilarities[index];
        vec![vec![number(spread.mean), number(spread.deviation)]]
    })
}

fn profiles(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let ranked = cell.profiles[index].iter().zip(1..);
        ranked
            .map(|(view, rank)| vec![rank.to_string(), view.to_string()])
            .collect()
    })
}

fn selections(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let tables = cell.tables.iter();
        let ranked =
            tables.filter_map(|(method, by_dims)| Some((method, by_dims[index].as_ref()?)));
        ranked
            .flat_map(|(method, table)| {
                let views = table.landmarks.iter().zip(1..);
                views.map(move |(view, rank)| {
                    vec![method.clone(), rank.to_string(), view.to_string()]
                })
            })
            .collect()
    })
}

fn reliability(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let tables = cell.tables.iter();
        let found = tables.filter_map(|(method, by_dims)| Some((method, by_dims[index].as_ref()?)));
        found
            .flat_map(|(method, table)| {
                let means = ["nearest", "guaranteed"].into_iter().zip(table.mean());
                means.map(|(criterion, mean)| {
                    with_seven(vec![method.clone(), criterion.to_owned()], &seven(&mean))
                })
            })
            .collect()
    })
}

fn clusters(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let mut rows = Vec::new();
        for (dissimilarity, by_linkage) in cell.clusters.iter().flat_map(|clusters| &clusters.ccc) {
            for (linkage, by_dims) in by_linkage {
                let ccc = by_dims[index].map(number).unwrap_or_default();
                rows.push(vec![dissimilarity.clone(), linkage.clone(), ccc]);
            }
        }
        rows
    })
}

fn silhouettes(grid: &Grid) -> Rows {
    of_dims(grid, |cell, index| {
        let curve = cell
            .clusters
            .iter()
            .flat_map(|clusters| &clusters.k_means[index].curve);
        let rows = curve.zip(1..).map(|(all, count)| {
            let numbers = all.iter().map(|&one| number(one));
            std::iter::once(count.to_string()).chain(numbers).collect()
        });
        rows.collect()
    })
}

fn localization(grid: &Grid) -> Rows {
    let rows = grid.cells.iter().flat_map(|cell| {
        cell.localization.iter().map(|one| {
            vec![
                cell.scale.to_string(),
                cell.blur.clone(),
                one.dims.to_string(),
                one.landmark.to_string(),
                one.minima.to_string(),
                number(one.mean_minima),
                one.elsewhere.map(number).unwrap_or_default(),
            ]
        })
    });
    rows.collect()
}

fn with_seven(mut row: Vec<String>, numbers: &[Option<f64>; 7]) -> Vec<String> {
    row.extend(
        numbers
            .iter()
            .map(|one| one.map(number).unwrap_or_default()),
    );
    row
}

fn number(x: f64) -> String {
    round(x).to_string()
}
