//! Judges that look at the same frames.

use super::{Judge, Verdict};
use crate::map::Integral;

/// Judges of the same frames, in a fixed order.
pub(crate) trait Panel: Sync {
    /// How many there are.
    fn judges(&self) -> usize;

    /// Frames that are best judged at once.
    fn batch(&self) -> usize {
        1
    }

    /// What each says of each square frame, `side_px` pixels per side, by frame and judge. The frames are taken around
    /// `landmark` (0-based): whoever knows of no such landmark, or is not `asked`, may say nothing.
    fn judge(
        &self,
        landmark: u32,
        asked: &[bool],
        frames: &[Integral],
        side_px: u32,
    ) -> Vec<Vec<Option<Verdict>>>;
}

impl Panel for &[&dyn Judge] {
    fn judges(&self) -> usize {
        self.len()
    }

    fn judge(
        &self,
        _: u32,
        _: &[bool],
        frames: &[Integral],
        side_px: u32,
    ) -> Vec<Vec<Option<Verdict>>> {
        let of_frame = |frame: &Integral| {
            // Judges of the same side see the same view.
            let mut view = Vec::new();
            let mut verdicts = Vec::with_capacity(self.len());
            for judge in *self {
                let side = judge.side();
                if view.len() != side * side {
                    view.resize(side * side, 0);
                    frame.reduce((0, 0), side_px, side, &mut view);
                }
                verdicts.push(judge.judge(&view));
            }
            verdicts
        };
        frames.iter().map(of_frame).collect()
    }
}
