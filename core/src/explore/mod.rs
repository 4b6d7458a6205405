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
//!    matrices. That one takes 160,000 instructions for 16×16 instead of 62,000 at most, which alone would break the
//!    budget of 400,000, may not converge, and errs by rounding of the largest eigenvalue: after 10,000 updates of 15
//!    dimensions the smallest eigenvalue, 4·10⁻⁵ of the largest, was off by 0.9 % instead of 0.0002 %.
//! 3. Each update also straightens one basis vector, in turn: without it, the error of orthogonality grows by
//!    2·10⁻⁸ to 4·10⁻⁸ with every update.
//!
//! **Cost.** An update is m·(k + 1)·k multiply-adds to rotate and about 5·m·k for the rest; instructions in
//! [`IncrementalPca`]. Memory is 4·(m + 1)·(k + 2) bytes and some 20 more: 27 KB for 400 pixels and 15 dimensions.
//!
//! **Limits.** Errors are bounded in the tests of this layer. Means are single precision: past some million views they
//! stand still.

mod carry;
mod explorer;
mod ipca;
mod pixels;
mod rank_one;
#[cfg(test)]
mod tests;

pub use carry::Carry;
pub use explorer::{Explorer, Memory, Sighting};
pub use ipca::{
    Change, Coordinates, Growth, IncrementalPca, MAX_ENERGY, Projection, RESIDUAL_TOLERANCE, Step,
};
