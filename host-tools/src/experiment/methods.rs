//! The selections that are compared: report sections 3.3, 3.4 and 4.1.

use std::collections::BTreeMap;

use crate::{
    learn::{Matrix, Rows, Space},
    select::{Dissimilarity, Eligible, Order, Profile, Route, START_LEN, Until, rank_by_ipca},
};

/// A start list of an IPCA ranking that the report names: table 3.3, with the numbers of tables A.12 to A.15.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartList {
    /// Its name.
    pub name: &'static str,
    /// Candidate numbers in the report's layout of 83 views.
    pub views: [u32; 3],
    /// Why the report chose them on its map.
    pub about: &'static str,
}

/// rnd1 to rnd5.
pub const START_LISTS: [StartList; 5] = [
    StartList {
        name: "rnd1",
        views: [20, 51, 79],
        about: "very different views, on the report's map",
    },
    StartList {
        name: "rnd2",
        views: [2, 29, 69],
        about: "very different views, on the report's map",
    },
    StartList {
        name: "rnd3",
        views: [9, 36, 62],
        about: "two views of one grid-like area, one of another",
    },
    StartList {
        name: "rnd4",
        views: [34, 77, 78],
        about: "distinctive views that overlap as much as any",
    },
    StartList {
        name: "rnd5",
        views: [15, 62, 77],
        about: "two very similar views and a distinctive one",
    },
];

/// A way to select landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// By profile, in the table's own dimensions.
    Profile,
    /// By IPCA from the three best by profile in the table's own dimensions.
    IpcaProfile,
    /// By IPCA from the start list of this index.
    IpcaStart(usize),
    /// The same landmarks in every cell: those that profile selects in the setting of figure 3.8.
    Fixed,
    /// The representatives of clusters by average linkage.
    Linkage,
    /// The representatives of k-means clusters.
    KMeans,
    /// What an atlas has.
    Atlas,
}

impl Method {
    /// All that a grid compares.
    pub const GRID: [Self; 10] = [
        Self::Profile,
        Self::IpcaProfile,
        Self::IpcaStart(0),
        Self::IpcaStart(1),
        Self::IpcaStart(2),
        Self::IpcaStart(3),
        Self::IpcaStart(4),
        Self::Fixed,
        Self::Linkage,
        Self::KMeans,
    ];

    /// Those that the report evaluates.
    pub const REPORT: [Self; 7] = [
        Self::Profile,
        Self::IpcaProfile,
        Self::IpcaStart(0),
        Self::IpcaStart(1),
        Self::IpcaStart(2),
        Self::IpcaStart(3),
        Self::IpcaStart(4),
    ];

    /// A short name, in files and pages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Profile => "profile",
            Self::IpcaProfile => "ipca",
            Self::IpcaStart(index) => START_LISTS[index].name,
            Self::Fixed => "fixed",
            Self::Linkage => "linkage",
            Self::KMeans => "k-means",
            Self::Atlas => "atlas",
        }
    }

    /// What it is, in a few words.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            Self::Profile => "by profile: most dissimilar on average",
            Self::IpcaProfile => "by IPCA from the best three by profile",
            Self::IpcaStart(index) => START_LISTS[index].about,
            Self::Fixed => "those that profile selects at 1/10, gauss1, k = 15, in every setting",
            Self::Linkage => "representatives of clusters by average linkage",
            Self::KMeans => "representatives of k-means clusters",
            Self::Atlas => "the landmarks of the atlas",
        }
    }
}

/// Selects from one space, in any of its dimensions.
pub(super) struct Selector<'a> {
    space: &'a Space,
    count: usize,
    vectors: Vec<f32>,
    eligible: Eligible,
    /// By start list.
    ranked: BTreeMap<Vec<u32>, Option<Vec<u32>>>,
}

impl<'a> Selector<'a> {
    pub fn new(space: &'a Space, count: usize) -> Self {
        let mut vectors = vec![0.0; space.count() * space.candidates.pixels()];
        space.candidates.read(0, &mut vectors);
        Self {
            space,
            count,
            vectors,
            eligible: Eligible::all(space.count() as u32),
            ranked: BTreeMap::new(),
        }
    }

    /// All candidates by profile, most dissimilar first.
    pub fn profile(&self, coordinates: &[f64], dimensions: usize) -> Vec<u32> {
        let dissimilarity = Dissimilarity::from(self.space.metric);
        let route = Route::automatic(dissimilarity, self.space.count());
        let profile = Profile::new(dissimilarity, coordinates, dimensions, route);
        profile
            .rank(Order::MostDissimilar, self.space.count())
            .candidates
    }

    /// The first landmarks by IPCA from a start list; `None` when it names views that there are not, or landmarks express
    /// every view before there are as many.
    pub fn ipca(&mut self, start: &[u32]) -> Option<Vec<u32>> {
        let start = &start[..START_LEN.min(self.count)];
        if let Some(known) = self.ranked.get(start) {
            return known.clone();
        }
        let rows = Matrix::new(&self.vectors, self.space.candidates.pixels());
        let until = Until::landmarks(self.count);
        let ranking = rank_by_ipca(&rows, &self.eligible, start, until);
        let landmarks = ranking.ok().map(|ranked| ranked.ranking);
        let landmarks = landmarks.filter(|landmarks| landmarks.len() == self.count);
        self.ranked.insert(start.to_vec(), landmarks.clone());
        landmarks
    }
}
