//! The atlas as it flies.

use eigenmark_core::{atlas::Atlas, localizer::Localizer, preprocess::View};

use super::{Judge, Verdict};

/// The core, with an atlas: what a board says.
#[derive(Clone, Debug)]
pub struct Onboard<'a>(Localizer<'a>);

impl<'a> Onboard<'a> {
    /// The core with this atlas.
    #[must_use]
    pub fn new(atlas: &Atlas<'a>) -> Self {
        Self(Localizer::new(atlas.clone()))
    }
}

impl Judge for Onboard<'_> {
    fn side(&self) -> usize {
        usize::from(self.0.atlas().eigenspace().side())
    }

    fn landmarks(&self) -> usize {
        self.0.atlas().landmarks().len()
    }

    fn judge(&self, view: &[u8]) -> Option<Verdict> {
        let fix = self.0.clone().locate_view(&View::from_pixels(view)?)?;
        Some(Verdict {
            landmark: fix.landmark,
            is_strict: fix.distance < fix.second,
            is_guaranteed: fix.guaranteed,
        })
    }
}
