//! A monitor of one residual.

use super::{Agreed, Limits, Merge, Moments, Windows};
use crate::operators::error::{require_finite, require_length, require_not_negative};
use crate::operators::{OperatorError, Sample, Storage};

impl<S: Storage> Merge for Moments<S> {
    fn merged(&self, later: &Self) -> Self {
        self.with(later)
    }
}

/// Tests the residual of a model for changes, sample by sample.
///
/// With the offset and the gain as possible changes, the regressors of a sample are 1 and the model's output:
///
/// ```
/// use gpi_core::operators::{Limits, ResidualMonitor};
/// let limits = Limits {
///     noise: 0.01, deviations: 4.0, least_noise: 0.1, hidden: 0.004, fast: 0, of_draws: 0.0,
/// };
/// // two changes: six products
/// let monitor = ResidualMonitor::<[f64; 6], 16>::new(limits, &[0.0; 6], 2, 100)?;
/// let mut state = monitor.rest();
/// let mut found = None;
/// for k in 0..2000 {
///     let t = f64::from(k);
///     let predicted = (0.05 * t).sin();
///     let measured = predicted * if k < 1000 { 1.0 } else { 1.02 } + 0.014 * (7.1 * t * t).sin();
///     if let Some(agreed) = monitor.step(&mut state, &[1.0, predicted], &[], measured - predicted, 0.0) {
///         found.get_or_insert((k, agreed));
///     }
/// }
/// let (k, agreed) = found.unwrap();
/// assert!(k < 1600 && agreed.has(1) && !agreed.has(0)); // the gain
/// # Ok::<(), gpi_core::operators::OperatorError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualMonitor<S: Storage, const LEVELS: usize> {
    limits: Limits<S::Item>,
    empty: Moments<S>,
    changes: usize,
    draws: usize,
    block: u32,
}

/// The state of a [`ResidualMonitor`].
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualMonitorState<S: Storage, const LEVELS: usize> {
    current: Moments<S>,
    samples: u32,
    windows: Windows<Moments<S>, LEVELS>,
}

impl<S: Storage, const LEVELS: usize> ResidualMonitor<S, LEVELS> {
    /// A monitor of `changes` possible changes, with blocks of `block` samples.
    ///
    /// `products` is the storage for sums of products, whose values do not count: [`Moments::length`] numbers for as many draws
    /// of the error as [`ResidualMonitor::step`] is to get.
    /// The longest window has `2^LEVELS` blocks.
    ///
    /// # Errors
    /// Another number of products, more than 32 changes, limits that are negative or not finite, noise or a block of zero.
    pub fn new(
        limits: Limits<S::Item>,
        products: &S,
        changes: usize,
        block: u32,
    ) -> Result<Self, OperatorError> {
        let all = changes.min(32);
        require_length("changes", changes, all)?;
        let (given, least) = (products.values().len(), Moments::<S>::length(all, 0));
        let draws = given.saturating_sub(least).checked_div(all).unwrap_or(0);
        require_length("products", given, Moments::<S>::length(all, draws))?;
        let Limits { noise, deviations, least_noise, hidden, of_draws, .. } = limits;
        for (name, value) in [
            ("noise", noise),
            ("deviations", deviations),
            ("least_noise", least_noise),
            ("hidden", hidden),
            ("of_draws", of_draws),
        ] {
            require_finite(name, &[value])?;
            require_not_negative(name, &[value])?;
        }
        if noise <= S::Item::ZERO || block == 0 {
            let parameter = if block == 0 { "block" } else { "noise" };
            return Err(OperatorError::Zero { parameter });
        }
        Ok(Self { limits, empty: Moments::like(products), changes, draws, block })
    }

    /// The limits.
    pub fn limits(&self) -> &Limits<S::Item> {
        &self.limits
    }

    /// The state before the first sample.
    pub fn rest(&self) -> ResidualMonitorState<S, LEVELS> {
        ResidualMonitorState {
            current: self.empty.clone(),
            samples: 0,
            windows: Windows::default(),
        }
    }

    /// Counts one sample: what each possible change would add to the residual, the draws of the error, the residual (measured
    /// minus predicted), and the square of the error that may have any shape. A sample that is not finite, or that has another
    /// number of changes or draws than the monitor, is left out.
    ///
    /// At the end of a block, the changes upon which two successive windows agree, of all lengths that end here: those of
    /// the windows with most evidence.
    #[inline]
    pub fn step(
        &self,
        state: &mut ResidualMonitorState<S, LEVELS>,
        regressors: &[S::Item],
        draws: &[S::Item],
        residual: S::Item,
        known: S::Item,
    ) -> Option<Agreed> {
        let are_all = regressors.len() == self.changes && draws.len() == self.draws;
        let mut values = regressors.iter().chain(draws);
        if are_all && residual.finite() && known.finite() && values.all(|value| value.finite()) {
            state.current.add(regressors, draws, residual, known);
        }
        state.samples += 1;
        if state.samples < self.block {
            return None;
        }
        state.samples = 0;
        let block = core::mem::replace(&mut state.current, self.empty.clone());
        self.push(&mut state.windows, block)
    }

    /// Counts one block of any length, see [`ResidualMonitor::step`].
    pub fn push(
        &self,
        windows: &mut Windows<Moments<S>, LEVELS>,
        block: Moments<S>,
    ) -> Option<Agreed> {
        let mut most: Option<Agreed> = None;
        windows.push(block, |_, earlier, later| {
            // windows without a sample say nothing
            if earlier.samples <= S::Item::ZERO || later.samples <= S::Item::ZERO {
                return;
            }
            let found = self.limits.agreed(earlier, later, self.changes);
            if !found.is_nothing() && most.is_none_or(|most| found.evidence > most.evidence) {
                most = Some(found);
            }
        });
        most
    }
}
