//! How matrices and vectors stand in files: `[[elements, column by column], rows, columns]`.
//!
//! A file may come from anybody, so that its dimensions are compared with the number of elements before a matrix is
//! made of them. Here `rows` times `columns` is a checked product: one that overflows is refused, too.

use crate::Matrix;
use nalgebra::DVector;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Elements, rows and columns; a column vector has `null` columns.
type Written<T> = (Vec<f64>, usize, T);

/// The elements, if there are as many of them as the dimensions say.
fn checked<E: serde::de::Error>(
    elements: Vec<f64>,
    rows: usize,
    columns: usize,
) -> Result<Vec<f64>, E> {
    if rows.checked_mul(columns) == Some(elements.len()) {
        return Ok(elements);
    }
    let count = elements.len();
    Err(E::custom(format!("a matrix of {rows} rows and {columns} columns has {count} elements")))
}

/// Writes a matrix; for `#[serde(with)]`.
pub(super) fn serialize<S: Serializer>(matrix: &Matrix, serializer: S) -> Result<S::Ok, S::Error> {
    (matrix.as_slice(), matrix.nrows(), matrix.ncols()).serialize(serializer)
}

/// Reads a matrix; for `#[serde(with)]`.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Matrix, D::Error> {
    let (elements, rows, columns) = Written::<usize>::deserialize(deserializer)?;
    Ok(Matrix::from_vec(rows, columns, checked::<D::Error>(elements, rows, columns)?))
}

/// The same for column vectors.
pub(crate) mod vector {
    use super::{DVector, Deserialize, Deserializer, Serialize, Serializer, Written, checked};

    /// Writes a vector; for `#[serde(with)]`.
    pub(crate) fn serialize<S: Serializer>(
        vector: &DVector<f64>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        (vector.as_slice(), vector.len(), ()).serialize(serializer)
    }

    /// Reads a vector; for `#[serde(with)]`.
    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<DVector<f64>, D::Error> {
        let (elements, rows, ()) = Written::<()>::deserialize(deserializer)?;
        Ok(DVector::from_vec(checked::<D::Error>(elements, rows, 1)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    struct File {
        #[serde(with = "super")]
        matrix: Matrix,
        #[serde(with = "super::vector")]
        vector: DVector<f64>,
    }

    #[test]
    fn files_are_those_of_nalgebra() {
        let matrix = Matrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let vector = DVector::from_vec(vec![7.0, 8.0]);
        let file = File { matrix: matrix.clone(), vector: vector.clone() };
        let written = serde_json::to_value(&file).unwrap();
        assert_eq!(written["matrix"], serde_json::to_value(&matrix).unwrap());
        assert_eq!(written["vector"], serde_json::to_value(&vector).unwrap());
        assert_eq!(serde_json::from_value::<File>(written).unwrap(), file);
        // an empty matrix keeps its dimensions
        let file = File { matrix: Matrix::zeros(0, 3), vector: DVector::zeros(0) };
        let text = serde_json::to_string(&file).unwrap();
        assert_eq!(serde_json::from_str::<File>(&text).unwrap(), file);
    }

    #[test]
    fn dimensions_that_do_not_fit_are_refused() {
        let refused = |matrix: &str| {
            let text = format!(r#"{{"matrix": {matrix}, "vector": [[], 0, null]}}"#);
            serde_json::from_str::<File>(&text).unwrap_err().to_string()
        };
        assert!(refused("[[1.0], 1, 2]").contains("1 rows and 2 columns has 1 elements"));
        // 2^63 rows by 2 columns are 0 elements in wrapping arithmetic
        assert!(refused("[[], 9223372036854775808, 2]").contains("has 0 elements"));
        assert!(refused("[[], 4294967296, 4294967296]").contains("has 0 elements"));
        assert!(refused("[[], -1, 0]").contains("invalid value"));
        let text = r#"{"matrix": [[], 0, 0], "vector": [[1.0], 2, null]}"#;
        assert!(serde_json::from_str::<File>(text).is_err());
    }
}
