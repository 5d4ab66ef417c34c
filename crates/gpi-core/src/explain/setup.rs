//! What never changes during a search.

use super::policy::SearchPolicy;
use crate::chain::point::Point;
use crate::chain::table::Table;
use crate::effects::{CATALOGUE, Entry, entries};
use crate::fit::RefineOptions;
use crate::fit::joint::fit_options;
use crate::fit::minimize::FitOptions;
use crate::fit::preparation::Prepared;
use crate::fit::representatives::representatives;
use crate::optimize::Loss;
use crate::spectrum::is_one_sine;
use crate::{Error, Record};

/// What a search is given.
#[derive(Clone)]
pub(super) struct SearchSetup {
    /// The prepared record as it was measured, wrong samples included.
    pub measured: Record,
    /// The record in which the samples are scored that the training holds out.
    pub test: Record,
    /// How trials are fitted, the grids held.
    pub options: FitOptions,
    /// The same with all grids free that were not given.
    pub moving_grids: FitOptions,
    /// Which grids may move and become finer.
    pub moving: RefineOptions,
    /// The effects that may be added.
    pub allowed: Vec<&'static Entry>,
    /// Whether the order of G or its delay was given, so that more of it is an effect.
    pub order_is_given: bool,
    /// Whether the record is one cycle that repeats.
    pub is_one_sine: bool,
    /// The declared model with the range of a sensor that clips, where the output stands at a limit.
    pub clipping: Option<Point>,
    /// The tolerances.
    pub policy: SearchPolicy,
}

impl SearchSetup {
    /// For a prepared record with the weights of its outputs.
    pub(super) fn new(
        prepared: &Prepared,
        weights: &[f64],
        measured: Record,
        allowed: Vec<&'static Entry>,
        order_is_given: bool,
        moving: RefineOptions,
        policy: SearchPolicy,
    ) -> Result<Self, Error> {
        let options = |free: &RefineOptions, gain: f64| {
            let mut options = fit_options(prepared, free, policy.fits.steps);
            options.loss.scales = weights.to_vec();
            FitOptions { gain, ..options }
        };
        Ok(Self {
            measured,
            test: prepared.record.held_out_part()?,
            options: options(&RefineOptions::default(), policy.fits.gain),
            moving_grids: options(&moving, policy.grid.gain),
            moving,
            allowed,
            order_is_given,
            is_one_sine: is_one_sine(&prepared.record),
            clipping: None,
            policy,
        })
    }

    /// The same setup where residuals count by another loss.
    pub(super) fn with_loss(&self, loss: &Loss) -> Self {
        let mut other = self.clone();
        other.options.loss.clone_from(loss);
        other.moving_grids.loss.clone_from(loss);
        other
    }

    /// How many unknowns a point has.
    pub(super) fn unknowns(&self, point: &Point) -> usize {
        Table::new(point, self.options.freedom).len
    }

    /// How many of them are not held.
    pub(super) fn estimated(&self, point: &Point) -> usize {
        let freedom = self.options.freedom;
        let table = Table::new(point, freedom);
        point.bounds(&table, &self.measured, freedom).estimated().len()
    }

    /// Whether derivatives of the whole record would take long.
    pub(super) fn is_long(&self, point: &Point) -> bool {
        representatives(point, &self.measured, self.unknowns(point)).is_some()
    }

    /// Values that are held out.
    pub(super) fn held_out_values(&self) -> f64 {
        (self.test.scored() * self.test.outputs().len()) as f64
    }
}

/// The entries that `names` allow, all when there are none.
pub(super) fn allowed(
    parameter: &'static str,
    names: Option<&[String]>,
) -> Result<Vec<&'static Entry>, Error> {
    names.map_or_else(|| Ok(CATALOGUE.iter().collect()), |names| entries(parameter, names))
}
