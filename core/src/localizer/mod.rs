//! Frame → fix: where the vehicle is, and how far to trust that.

mod digest;
mod fix;

use core::ops::Range;

use crate::{
    atlas::Atlas,
    eigenspace::Coefficients,
    frame::Frame,
    preprocess::{Coverage, Pose, View, level, reduce},
};

pub use digest::{DIGEST_LEN, digest, reduction_matches_reference};
pub use fix::Fix;

/// Finds frames in an atlas. Holds one view, its coefficients, and how much of it was seen; every frame is answered on
/// its own.
///
/// # Examples
/// ```no_run
/// use eigenmark_core::{atlas::Atlas, frame::Frame, localizer::Localizer};
/// # fn run(flash: &[u8], pixels: &[u8]) -> Result<(), Box<dyn std::error::Error>> {
/// let mut localizer = Localizer::new(Atlas::parse(flash)?);
/// if let Some(fix) = localizer.locate(&Frame::new(pixels, 160, 120, 160)?) {
///     println!("({}, {}), guaranteed: {}", fix.position.x_px, fix.position.y_px, fix.guaranteed);
/// }
/// # Ok(()) }
/// ```
#[derive(Clone, Debug)]
pub struct Localizer<'a> {
    atlas: Atlas<'a>,
    view: View,
    coefficients: Coefficients,
    coverage: Coverage,
}

const _: () = assert!(size_of::<Localizer<'_>>() <= 4096);

impl<'a> Localizer<'a> {
    /// A localizer for `atlas`.
    #[must_use]
    pub fn new(atlas: Atlas<'a>) -> Self {
        let view = View::black(atlas.eigenspace().side());
        let coefficients = Coefficients::zeros(atlas.eigenspace().dimensions());
        let coverage = Coverage::whole(&view);
        Self {
            atlas,
            view,
            coefficients,
            coverage,
        }
    }

    /// The atlas it was made with.
    #[must_use]
    pub fn atlas(&self) -> &Atlas<'a> {
        &self.atlas
    }

    /// Where the frame was taken, or `None` when the frame shows nothing to go by (it is flat and the atlas
    /// normalizes contrast).
    #[must_use]
    pub fn locate(&mut self, frame: &Frame<'_>) -> Option<Fix> {
        self.look(frame);
        self.fix(self.atlas.landmarks().everywhere())
    }

    /// Where a view was taken that is already reduced; `None` also when its side is not the atlas's.
    #[must_use]
    pub fn locate_view(&mut self, view: &View) -> Option<Fix> {
        let everywhere = self.atlas.landmarks().everywhere();
        Fix::new(&self.atlas, view, &mut self.coefficients, everywhere)
    }

    /// Where a frame of known pose was taken. Heading and altitude of the fix are relative to the pose. The nominal pose gives the bits of [`locate`](Self::locate), at its
    /// cost; any other takes the general view path ([`level`](level())).
    ///
    /// `None` as in `locate`, and when less than half of the view was seen. What a frame does not show is guessed, so
    /// a fix whose view was not seen wholly is never `guaranteed`.
    #[must_use]
    pub fn locate_at(&mut self, frame: &Frame<'_>, pose: &Pose) -> Option<Fix> {
        self.locate_among(frame, pose, self.atlas.landmarks().everywhere())
    }

    /// The same among some ranges of the landmarks only, such as those that are
    /// [`plausible`](crate::landmark::LandmarkTable::plausible); `None` also when there is none. `second` and `margin` are among them, too; a `guaranteed` landmark is the
    /// nearest of all.
    #[must_use]
    pub fn locate_among(
        &mut self,
        frame: &Frame<'_>,
        pose: &Pose,
        among: impl IntoIterator<Item = Range<u32>>,
    ) -> Option<Fix> {
        if pose.is_nominal() {
            self.look(frame);
        } else {
            self.coverage = level(frame, pose, &mut self.view);
        }
        if !self.coverage.is_half() {
            return None;
        }
        self.fix(among)
    }

    /// Reduces a frame of nominal pose.
    fn look(&mut self, frame: &Frame<'_>) {
        reduce(frame, &mut self.view);
        self.coverage = Coverage::whole(&self.view);
    }

    /// Finds the view.
    fn fix(&mut self, among: impl IntoIterator<Item = Range<u32>>) -> Option<Fix> {
        let mut fix = Fix::new(&self.atlas, &self.view, &mut self.coefficients, among)?;
        fix.guaranteed &= self.coverage.is_whole();
        Some(fix)
    }

    /// The coefficients of the last view that had any; zeros before the first.
    #[must_use]
    pub fn coefficients(&self) -> &Coefficients {
        &self.coefficients
    }

    /// How much of its view the last frame showed; all of it before the first.
    #[must_use]
    pub fn coverage(&self) -> Coverage {
        self.coverage
    }
}
