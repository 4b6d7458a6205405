//! How distinct each landmark is on the whole map, from the peaks of its localization matrix: `final_evaluation` of table
//! C.5, selection and peaks combined.

use serde::Serialize;

use super::{Flooding, LocalizationMatrix, Peak, Peaks, find_peaks, localization_matrices};
use crate::{
    evaluate::{evaluation::Site, judge::Exact},
    map::Map,
    output::Progress,
};

/// What the peaks of a localization matrix say about the view it is of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Distinctness {
    /// Its rank in the table, 1-based; 0 for a view that is no landmark.
    pub landmark: u32,
    /// Its candidate number, 1-based.
    pub view: u32,
    /// Number of peaks up to the threshold; a thousand are found at most.
    pub peaks: usize,
    /// The threshold: half the mean dissimilarity to the map.
    pub threshold: f32,
    /// The peak that the view's own position belongs to; `None` when that is above the threshold. For a view whose position
    /// is not known, the global minimum: where a search of the whole map would find it.
    pub own: Option<Peak>,
    /// Whether that is the global minimum.
    pub is_global: bool,
    /// The lowest peak at least half a footprint away from there: the place on the map that the view is most easily taken
    /// for.
    pub rival: Option<Peak>,
    /// Dissimilarity of the rival less that of its own peak; the threshold less its own without a rival. The larger, the
    /// more distinct is the landmark.
    pub contrast: f32,
}

impl Distinctness {
    /// Reads a matrix of windows of `window_px`; `corner` is the view's own position, if it has one.
    ///
    /// # Panics
    /// When that is not in the matrix.
    #[must_use]
    pub fn of(matrix: &LocalizationMatrix, window_px: u32, corner: Option<[u32; 2]>) -> Self {
        let flooding = Flooding::of(matrix);
        let Peaks { peaks, regions } = find_peaks(matrix, flooding);
        let (columns, _) = matrix.size();
        let home = corner.map_or(0, |[x, y]| regions[y as usize * columns + x as usize]);
        let own = peaks.get(home as usize).copied();
        let from = corner.or(own.map(|peak| peak.corner));
        let is_away = |peak: &&Peak| {
            from.is_none_or(|[x, y]| {
                let [px, py] = peak.corner;
                let away = f64::from(x.abs_diff(px)).hypot(f64::from(y.abs_diff(py)));
                away >= f64::from(window_px) / 2.0
            })
        };
        let rival = peaks.iter().find(is_away).copied();
        let value = |peak: Option<Peak>| peak.map_or(flooding.threshold, |peak| peak.value);
        Self {
            landmark: 0,
            view: 0,
            peaks: peaks.len(),
            threshold: flooding.threshold,
            own,
            is_global: home == 0,
            rival,
            contrast: value(rival) - value(own),
        }
    }
}

/// How distinct every landmark of `exact` is, most distinct first. `keep` gets every matrix, with the landmark's rank
/// (0-based), in the order of the table.
///
/// # Errors
/// What `keep` fails with; the rest is then left undone.
///
/// # Panics
/// When there are more sites than landmarks, or the window does not fit into the map.
pub fn final_evaluation<E>(
    map: &Map,
    window_px: u32,
    exact: &Exact,
    sites: &[Site],
    progress: &Progress,
    mut keep: impl FnMut(usize, &LocalizationMatrix) -> Result<(), E>,
) -> Result<Vec<Distinctness>, E> {
    let bar = progress.bar("localization", sites.len() as u64);
    let points: Vec<&[f64]> = (0..sites.len())
        .map(|landmark| exact.point(landmark))
        .collect();
    let mut found = Vec::with_capacity(sites.len());
    localization_matrices(map, window_px, exact, &points, |landmark, matrix| {
        let site = sites[landmark];
        found.push(Distinctness {
            landmark: landmark as u32 + 1,
            view: site.view,
            ..Distinctness::of(&matrix, window_px, Some(site.corner(window_px)))
        });
        bar.inc(1);
        keep(landmark, &matrix)
    })?;
    found.sort_by(|a, b| {
        b.contrast
            .total_cmp(&a.contrast)
            .then(a.landmark.cmp(&b.landmark))
    });
    Ok(found)
}
