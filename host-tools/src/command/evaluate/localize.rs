//! Localization matrices into files.

use std::{io, path::Path};

use anyhow::{Context, ensure};
use eigenmark::{
    evaluate::{
        Exact, Judge, Site,
        localization::{Distinctness, LocalizationMatrix, final_evaluation, localization_matrices},
    },
    map::{Integral, Map, load},
    output::{Progress, create_dir, write_file, write_npy},
};
use eigenmark_core::{atlas::Atlas, frame::MAX_SIDE};
use image::codecs::png::PngEncoder;
use serde::Serialize;

/// How distinct a view is, and what it is called.
#[derive(Serialize)]
pub struct Named {
    pub name: String,
    #[serde(flatten)]
    pub distinctness: Distinctness,
}

/// A view whose localization matrix is asked for.
pub struct Subject {
    name: String,
    site: Option<Site>,
    point: Vec<f64>,
}

/// Writes the matrix of a subject: an array and a picture. No picture that is asked about has such a name.
fn write_matrix(directory: &Path, name: &str, matrix: &LocalizationMatrix) -> anyhow::Result<()> {
    let path = |ending| directory.join(format!("matrix-of-{name}.{ending}"));
    let (columns, rows) = matrix.size();
    let shape = [rows as u64, columns as u64];
    write_npy(&path("npy"), &shape, matrix.values().iter().copied())?;
    write_file(&path("png"), |file| {
        let written = matrix.picture().write_with_encoder(PngEncoder::new(file));
        written.map_err(io::Error::other)
    })?;
    Ok(())
}

/// What matrices are made of.
pub struct Ground<'a> {
    pub map: &'a Map,
    pub atlas: &'a Atlas<'a>,
    pub integral: &'a Integral,
    pub exact: &'a Exact,
    pub footprint_px: u32,
}

impl Ground<'_> {
    /// Writes the matrices of the landmarks, or of other subjects if there are any; how distinct each is.
    pub fn localize(
        &self,
        directory: &Path,
        sites: &[Site],
        subjects: &[Subject],
    ) -> anyhow::Result<Vec<Named>> {
        create_dir(directory)?;
        if subjects.is_empty() {
            let keep = |landmark: usize, matrix: &LocalizationMatrix| {
                write_matrix(directory, &format!("landmark-{}", landmark + 1), matrix)
            };
            let (map, footprint_px) = (self.map, self.footprint_px);
            let progress = Progress::Stderr;
            let found = final_evaluation(map, footprint_px, self.exact, sites, &progress, keep)?;
            let named = found.into_iter().map(|distinctness| Named {
                name: format!("landmark {}", distinctness.landmark),
                distinctness,
            });
            return Ok(named.collect());
        }
        let points: Vec<&[f64]> = subjects.iter().map(|one| one.point.as_slice()).collect();
        let mut found = Vec::with_capacity(subjects.len());
        let (map, footprint_px) = (self.map, self.footprint_px);
        localization_matrices(map, footprint_px, self.exact, &points, |index, matrix| {
            let Subject { name, site, .. } = &subjects[index];
            write_matrix(directory, name, &matrix)?;
            let corner = site.map(|site| site.corner(footprint_px));
            found.push(Named {
                name: name.clone(),
                distinctness: Distinctness {
                    view: site.map_or(0, |site| site.view),
                    ..Distinctness::of(&matrix, footprint_px, corner)
                },
            });
            anyhow::Ok(())
        })?;
        Ok(found)
    }

    /// What is asked about, by name.
    pub fn subjects(&self, of: &[String]) -> anyhow::Result<Vec<Subject>> {
        let mut subjects: Vec<Subject> = Vec::with_capacity(of.len());
        for name in of {
            let subject = self.subject(name)?;
            let is_new = subjects.iter().all(|other| other.name != subject.name);
            ensure!(
                is_new,
                "{name}: its matrix would overwrite that of another {}",
                subject.name
            );
            subjects.push(subject);
        }
        Ok(subjects)
    }

    /// A candidate by its number, or a picture by its path.
    fn subject(&self, name: &str) -> anyhow::Result<Subject> {
        let side = self.exact.side();
        let mut view = vec![0; side * side];
        let (name, site) = if let Ok(number) = name.parse::<u32>() {
            let survey = self.atlas.survey();
            let candidate = survey.find(number);
            let candidate = candidate
                .with_context(|| format!("view {number}: expected 1 to {}", survey.count()))?;
            let site = Site::from(&candidate);
            let [x, y] = site.corner(self.footprint_px);
            self.integral
                .reduce((x, y), self.footprint_px, side, &mut view);
            (format!("view-{number}"), Some(site))
        } else {
            let picture = load(Path::new(name))?;
            let square_px = picture.width().min(picture.height());
            ensure!(
                (32..=u32::from(MAX_SIDE)).contains(&square_px),
                "{name}: expected a picture of 32 to {MAX_SIDE} pixels per side"
            );
            let left = (picture.width() - square_px) / 2;
            let top = (picture.height() - square_px) / 2;
            Integral::new(&picture).reduce((left, top), square_px, side, &mut view);
            let stem = Path::new(name).file_stem().unwrap_or_default();
            (stem.to_string_lossy().into_owned(), None)
        };
        let point = self.exact.basis().project(&view);
        Ok(Subject {
            point: point.with_context(|| format!("{name}: no contrast to normalize"))?,
            name,
            site,
        })
    }
}
