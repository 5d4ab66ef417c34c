//! Where half-widths and thresholds are placed.

use crate::Error;

/// Half-widths or thresholds: how many are to be placed over the data, or which ones.
#[derive(Clone, Debug, PartialEq)]
pub enum Grid {
    /// That many, spread evenly.
    Count(usize),
    /// These, in the unit of the input.
    Values(Vec<f64>),
}

impl Grid {
    /// Half-widths: given, or `r_i = i/n` of half the span of z, which is the widest play that moves.
    ///
    /// `r = 0` is always among them.
    pub(crate) fn half_widths(&self, span: f64) -> Result<Vec<f64>, Error> {
        let mut values = match self {
            Self::Count(0) => {
                return Err(Error::parameter("half_widths", 0, "at least one play is needed"));
            }
            Self::Count(count) => {
                (0..*count).map(|i| 0.5 * span * i as f64 / *count as f64).collect()
            }
            Self::Values(values) => values.clone(),
        };
        if let Some(value) = values.iter().find(|value| !(value.is_finite() && **value >= 0.0)) {
            return Err(Error::parameter("half_widths", value, "must be zero or positive"));
        }
        values.push(0.0);
        values.sort_by(f64::total_cmp);
        values.dedup();
        Ok(values)
    }

    /// Thresholds other than 0: given, or spread evenly inside the range of u.
    pub(crate) fn thresholds(&self, (low, high): (f64, f64)) -> Result<Vec<f64>, Error> {
        let mut values: Vec<f64> = match self {
            Self::Count(count) => {
                (1..=*count).map(|j| low + (high - low) * j as f64 / (count + 1) as f64).collect()
            }
            Self::Values(values) => values.clone(),
        };
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Error::parameter("thresholds", value, "must be finite"));
        }
        // The deadzone of threshold 0 is the identity, which is there with weight 1 anyway.
        let smallest = 1e-9 * (high - low);
        values.retain(|value| value.abs() > smallest);
        values.sort_by(f64::total_cmp);
        values.dedup();
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_spread_and_zero_is_special() {
        assert_eq!(Grid::Count(4).half_widths(8.0).unwrap(), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(Grid::Values(vec![2.0, 1.0]).half_widths(8.0).unwrap(), [0.0, 1.0, 2.0]);
        assert_eq!(Grid::Count(3).thresholds((-2.0, 2.0)).unwrap(), [-1.0, 1.0]);
        assert!(Grid::Values(vec![-1.0]).half_widths(8.0).is_err());
        assert!(Grid::Count(0).half_widths(8.0).is_err());
        assert!(Grid::Count(0).thresholds((0.0, 1.0)).unwrap().is_empty());
    }
}
