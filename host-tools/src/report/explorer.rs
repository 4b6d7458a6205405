//! The interactive part of a report: data, and the script that draws them.
//!
//! The fragment, its style and its scripts stand in files of their own; here the data become what `explorer/cells.js`
//! reads. Numbers are rounded to what a picture shows.

use std::collections::BTreeMap;

use base64::{Engine, engine::general_purpose::STANDARD};
use eigenmark_core::landmark::Metric;
use image::DynamicImage;
use serde_json::{Value, json};

use super::{Page, map_picture};
use crate::{
    experiment::{
        Cell, Clusters, Joined, Means, Method, MethodTable, Plan, START_LISTS, claims::Claim,
        round, segmentation::Segmented, seven,
    },
    learn::blur_name,
    map::{Grid, Map},
};

const FRAGMENT: &str = include_str!("explorer.html");
const STYLE: &str = include_str!("explorer.css");

/// In this order they are one script.
const SCRIPTS: [&str; 11] = [
    include_str!("explorer/cells.js"),
    include_str!("explorer/elements.js"),
    include_str!("explorer/plot.js"),
    include_str!("explorer/state.js"),
    include_str!("explorer/maps.js"),
    include_str!("explorer/variance.js"),
    include_str!("explorer/pictures.js"),
    include_str!("explorer/reliability.js"),
    include_str!("explorer/clusters.js"),
    include_str!("explorer/claims.js"),
    include_str!("explorer.js"),
];

/// What can be explored.
#[derive(Clone, Copy, Debug)]
pub struct Explorer<'a> {
    /// The map.
    pub map: &'a Map,
    /// The map as a person would like to see it, if there is more than its luminance.
    pub picture: Option<&'a DynamicImage>,
    /// Where the candidates lie.
    pub grid: &'a Grid,
    /// What the cells have in common.
    pub plan: &'a Plan,
    /// One or more.
    pub cells: &'a [Cell],
    /// What they say about the report's claims.
    pub claims: &'a [Claim],
    /// What color segmentation changes.
    pub segmentation: Option<&'a Segmented>,
}

impl Explorer<'_> {
    /// Adds everything to a page.
    pub fn add_to(&self, page: &mut Page) {
        page.style(STYLE);
        page.raw(FRAGMENT);
        // Nothing in JSON but a string holds a bracket, and in a string it may be escaped.
        let data = self.data().to_string().replace('<', "\\u003c");
        page.raw(format_args!(
            "<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n\"use strict\";\n{}</script>\n",
            SCRIPTS.concat()
        ));
    }

    fn data(&self) -> Value {
        let Plan {
            settings, methods, ..
        } = self.plan;
        let views: Vec<[f32; 2]> = (1..=self.grid.count())
            .map(|view| {
                let place = self.grid.place(view);
                [place.x_px, place.y_px]
            })
            .collect();
        let lattices = self.grid.survey().lattices.iter();
        let lattices: Vec<u32> = lattices
            .map(|one| u32::from(one.columns) * u32::from(one.rows))
            .collect();
        let names = |of: &dyn Fn(&Cell) -> Value| {
            let mut names: Vec<Value> = Vec::new();
            for cell in self.cells {
                let name = of(cell);
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            names
        };
        let has_starts = methods
            .iter()
            .any(|method| matches!(method, Method::IpcaStart(_)));
        let n = views.len() as u32;
        let starts = START_LISTS
            .iter()
            .filter(|start| has_starts && start.views.iter().all(|&view| view <= n));
        json!({
            "map": {
                "name": self.map.title(),
                "width": self.map.width(),
                "height": self.map.height(),
                "view_px": settings.view_size_px,
                "picture": map_picture(self.map, self.picture),
            },
            "views": views,
            "lattices": lattices,
            "scales": names(&|cell| json!(cell.scale)),
            "blurs": names(&|cell| json!(cell.blur)),
            "methods": methods.iter().map(|method| {
                json!({"id": method.name(), "name": method.name(), "about": method.about()})
            }).collect::<Vec<_>>(),
            "starts": starts.map(|start| {
                json!({"id": start.name, "views": start.views, "about": start.about})
            }).collect::<Vec<_>>(),
            // The page computes distances itself, in nSSD.
            "has_distances": settings.metric == Metric::Nssd,
            "defaults": self.defaults(),
            "cells": self.cells.iter().map(cell).collect::<Vec<_>>(),
            "claims": self.claims,
            "segmentation": self.segmentation,
        })
    }

    /// What is shown first: the report's representative setting, or the nearest to it.
    fn defaults(&self) -> Value {
        let settings = &self.plan.settings;
        let off = |cell: &&Cell| (cell.scale - settings.scale).abs();
        let blur = blur_name(settings.blur);
        let of_blur = self.cells.iter().filter(|cell| cell.blur == blur);
        let nearest = of_blur
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .or(self.cells.first());
        json!({
            "scale": nearest.map(|cell| cell.scale),
            "blur": nearest.map(|cell| &cell.blur),
            "dims": settings.dimensions,
            "method": self.plan.methods.first().map(|method| method.name()),
        })
    }
}

fn cell(cell: &Cell) -> Value {
    let tables = cell.tables.iter().map(|(method, by_dims)| {
        let tables = by_dims.iter().map(|found| found.as_ref().map(table));
        (method, tables.collect::<Vec<_>>())
    });
    let localization = cell.localization.iter().map(|one| {
        json!({
            "dims": one.dims, "landmark": one.landmark, "uri": one.uri,
            "least": round(one.least.into()), "most": round(one.most.into()),
            "minima": one.minima, "peaks": one.peaks, "elsewhere": one.elsewhere,
        })
    });
    json!({
        "scale": cell.scale,
        "blur": cell.blur,
        "side": cell.side,
        "dims": cell.dims,
        "variance": cell.variance.iter().map(|&share| round(share)).collect::<Vec<_>>(),
        "coordinates": base64(cell.coordinates.iter().flat_map(|x| x.to_le_bytes())),
        "eigenimages": cell.eigenimages,
        "recovered": cell.recovered,
        "tables": tables.collect::<BTreeMap<_, _>>(),
        "clusters": cell.clusters.as_ref().map(clusters),
        "localization": localization.collect::<Vec<_>>(),
    })
}

fn table(table: &MethodTable) -> Value {
    let [nearest, guaranteed] = table.mean();
    json!({
        "landmarks": table.landmarks,
        "nearest": seven(&nearest),
        "guaranteed": seven(&guaranteed),
    })
}

fn clusters(clusters: &Clusters) -> Value {
    let linkages = clusters.dendrograms.iter().map(|(linkage, trees)| {
        let ccc = clusters
            .ccc
            .get("euclid")
            .and_then(|by_linkage| by_linkage.get(linkage));
        let trees = trees.iter().enumerate().map(|(index, merges)| {
            json!({
                "ccc": ccc.and_then(|by_dims| by_dims[index]).map(round),
                "merges": base64(merges.iter().flat_map(merge)),
            })
        });
        (linkage, trees.collect::<Vec<_>>())
    });
    json!({
        "linkages": linkages.collect::<BTreeMap<_, _>>(),
        "kmeans": clusters.k_means.iter().map(k_means).collect::<Vec<_>>(),
    })
}

/// Eight bytes: two numbers of clusters, and the height.
fn merge(&(a, b, height): &Joined) -> impl Iterator<Item = u8> {
    let [a, b] = [a, b].map(|cluster| (cluster as u16).to_le_bytes());
    a.into_iter().chain(b).chain(height.to_le_bytes())
}

fn k_means(means: &Means) -> Value {
    let cuts = means.cuts.iter().map(|(count, cut)| {
        let silhouettes = cut
            .silhouettes
            .iter()
            .map(|one| (127.0 * one).round() as i8 as u8);
        let found = json!({
            "of": base64(cut.of.iter().map(|&cluster| cluster as u8)),
            "silhouette": base64(silhouettes),
        });
        (count.to_string(), found)
    });
    json!({
        "curve": base64(means.curve.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes())),
        "cuts": cuts.collect::<BTreeMap<_, _>>(),
    })
}

fn base64(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_merge_is_eight_bytes() {
        let bytes: Vec<u8> = merge(&(3, 258, 1.0)).collect();
        assert_eq!(bytes, [3, 0, 2, 1, 0, 0, 0x80, 0x3f]);
    }
}
