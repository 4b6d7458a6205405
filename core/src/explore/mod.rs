//! Exploring: an eigenspace that grows with every view, and landmarks chosen on the way.
//!
//! **What.** The batch method needs all views before the first fix, and keeps them. Here an eigenspace takes in one
//! view after the other ([`IncrementalPca`], report 2.1.2) and forgets each; [`Explorer`] adds the criterion of
//! algorithm 2.4 online: a view that the eigenspace cannot express becomes a landmark, any other one is told which
//! landmark it is near to.
//!
//! **Notation.** m pixels (`PIXELS`), k dimensions, `SLOTS` = k + 1 at most: one slot is the residual's. x̄ mean, T
//! basis, Λ eigenvalues of the covariance (1/n)·A·Aᵀ, g coordinates, r residual, γ = ‖r‖, D and R as in report (2.25)
//! and (2.26). Everything is in gray levels when views are.
//!
//! **Method.** Report (2.19)–(2.27) as corrected, in single precision, in a fixed order; see the files. Shapes live in
//! types: matrices are nalgebra's, of fixed size. Deviations:
//! 1. r = (x − x̄) − Tg, the negative of (2.21), so that γ is positive.
//! 2. D is diagonal plus rank one and is decomposed as such (`rank_one.rs`), not by nalgebra's solver for symmetric
//!    matrices. That one takes 160,000 to 168,000 instructions for 16×16 where this takes 62,000, and an update would
//!    be above its budget of 400,000; nothing bounds its iterations; and its error is a share of the *largest*
//!    eigenvalue, in every update anew. Measured in its place: after 10,000 updates of 15 dimensions the smallest
//!    eigenvalue, 4·10⁻⁵ of the largest, is off by 8.8·10⁻³ instead of 2.6·10⁻⁶.
//! 3. Each update also straightens one basis vector, in turn. With the second Gram-Schmidt pass alone the error of
//!    orthogonality grows with every update, to 2 to 4·10⁻⁴ after 10,000; with this it stays at 10⁻⁶.
//!
//! **Cost.** An update is m·(k + 1)·k multiply-adds to rotate and 5·m·k for the rest: 358,000 instructions of a
//! Cortex-M4F for 400 pixels and 15 dimensions. Memory is 4·(m + 1)·(k + 2) bytes and some 20 more, 27 KB for the same,
//! and 6.7 KB of stack during an update; 16 KB of flash
//! (stack, flash and the figures of parts are of a build made fast throughout).
//!
//! **Limits.** The tests of this layer state and check the errors. The mean is single precision: a view's part in it
//! is lost after some million views.

mod carry;
mod digest;
mod explorer;
mod ipca;
mod pixels;
mod rank_one;
#[cfg(test)]
mod tests;

pub use carry::Carry;
pub use digest::digest;
pub use explorer::{Explorer, Memory, Sighting};
pub use ipca::{
    Change, Coordinates, Growth, IncrementalPca, MAX_ENERGY, Projection, RESIDUAL_TOLERANCE, Step,
};
