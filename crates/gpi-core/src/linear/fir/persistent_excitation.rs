//! The order of persistent excitation of a record's input.

use super::gathered;
use crate::{Error, Record};

/// A direction counts as excited if its power exceeds this fraction of the mean power. Weaker directions are leakage of
/// the excited ones; estimates along them would mainly be noise.
const FLOOR: f64 = 1e-4;

/// Largest number of lags at which the rank is computed: it finds up to 32 sines at a small cost.
const MOST_LAGS: usize = 64;

/// The largest number of taps for which the inputs of a record are persistently exciting; `usize::MAX` if the excitation
/// grows with the number of taps.
///
/// A sum of M sines is persistently exciting of order 2 M, whatever the number of taps; the order of broadband input
/// grows with the taps. The rank at 64 and at 32 lags (fewer for short records) distinguishes the two.
pub(crate) fn excitation_limit(record: &Record) -> Result<usize, Error> {
    let inputs = record.inputs().len();
    let longest = record.longest();
    let lags = (longest / (4 * inputs)).clamp(2, MOST_LAGS);
    let rank = |lags: usize| -> Result<usize, Error> {
        let (factor, _) = gathered(record, lags)?.decompose();
        let values = factor.singular_values()?;
        let powers = values.iter().map(|value| value * value);
        let floor = FLOOR * powers.clone().sum::<f64>() / values.len() as f64;
        Ok(powers.filter(|&power| power > floor).count())
    };
    let (half, full) = (rank(lags / 2)?, rank(lags)?);
    let saturated = full < lags * inputs && full <= half + inputs;
    Ok(if saturated { full.div_ceil(inputs).max(1) } else { usize::MAX })
}
