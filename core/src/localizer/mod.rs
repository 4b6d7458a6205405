//! Frame → fix: where the vehicle is, and how far to trust that.

mod digest;
mod fix;

use crate::{
    atlas::Atlas,
    eigenspace::Coefficients,
    frame::Frame,
    preprocess::{View, reduce},
};

pub use digest::{digest, reduction_matches_reference};
pub use fix::Fix;

/// Finds frames in an atlas. Holds one view and its coefficients as scratch, and nothing else; every frame is answered on its own.
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
}

const _: () = assert!(size_of::<Localizer<'_>>() <= 4096);

impl<'a> Localizer<'a> {
    /// A localizer for `atlas`.
    #[must_use]
    pub fn new(atlas: Atlas<'a>) -> Self {
        let view = View::black(atlas.eigenspace().side());
        let coefficients = Coefficients::zeros(atlas.eigenspace().dimensions());
        Self {
            atlas,
            view,
            coefficients,
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
        reduce(frame, &mut self.view);
        Fix::new(&self.atlas, &self.view, &mut self.coefficients)
    }

    /// Where a view was taken that is already reduced; `None` also when its side is not the atlas's.
    #[must_use]
    pub fn locate_view(&mut self, view: &View) -> Option<Fix> {
        Fix::new(&self.atlas, view, &mut self.coefficients)
    }
}
