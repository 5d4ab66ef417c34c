//! Whether a machine has changed since its model was made, from the residual of the model, at a few numbers a sample.
//!
//! [`Moments`] sums products of the residual and of what each possible change would add to it, over a block of samples.
//! [`Windows`] merges blocks to windows of all lengths. [`Limits`] decides which changes two successive windows agree upon.
//! All of it runs without std and without a heap; `gpi monitor` and [`crate::monitor`] use the same code.

mod judge;
mod moments;
mod residual;
mod windows;

#[cfg(feature = "identify")]
pub(crate) use judge::POSSIBLE;
pub use judge::{Agreed, Limits};
pub use moments::{Moments, Regression};
pub use residual::{ResidualMonitor, ResidualMonitorState};
pub use windows::{Merge, Windows};
