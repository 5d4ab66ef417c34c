//! Names and units of the columns of a record.

use crate::{Error, Matrix};

/// Name and unit of a column; the unit is a label that results carry along.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Channel {
    /// The column's name, such as `u` or `y1`.
    pub name: String,
    /// The unit's symbol, empty if unknown.
    pub unit: String,
}

impl Channel {
    /// A channel from its name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// The name with the unit in brackets, for labels.
    ///
    /// ```
    /// assert_eq!(gpi_core::Channel::new("u", "V").label(), "u [V]");
    /// ```
    pub fn label(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} [{}]", self.name, self.unit)
        }
    }
}

/// Rejects a matrix (samples, channels) with NaN or infinite samples; the error names the column.
pub(crate) fn require_finite(matrix: &Matrix, channels: &[Channel]) -> Result<(), Error> {
    for (values, channel) in matrix.column_iter().zip(channels) {
        // counted first: a count vectorizes, a search does not
        let count = values.iter().filter(|value| !value.is_finite()).count();
        if count > 0
            && let Some(row) = values.iter().position(|value| !value.is_finite())
        {
            let column = channel.name.clone();
            return Err(Error::NotFinite { column, row, count });
        }
    }
    Ok(())
}
