//! Arithmetic on the changes of several unknowns side by side.
//!
//! The change of a signal by eight unknowns is one [`Lanes`]. A matrix of weights M (rows, columns) acts on eight
//! unknowns at once in two directions:
//!
//! ```text
//! gather:   sums (rows, 8)    += M  values (columns, 8)       y, z from x:  M = [C; S]
//! scatter:  sums (columns, 8) += M' values (rows, 8)          x+ from v, w: M' = B, E
//! ```
//!
//! [`Weights`] stores M by blocks of four rows, and each block by columns. In a gather, the four sums of a block stay
//! in registers while the values are read once; with vectors of eight numbers they are four registers, with vectors of
//! four numbers eight. Each product is a fused multiply-add, which rounds once. The results may therefore differ from
//! the adjoint pass, which multiplies and adds, in the last bits.

use pulp::Simd;

/// Unknowns that run side by side: what the widest vectors of today's processors hold.
pub(super) const LANES: usize = 8;
pub(super) type Lanes = [f64; LANES];
pub(super) const NONE: Lanes = [0.0; LANES];

/// Rows of numbers that weigh the same values, four rows side by side.
pub(super) struct Weights {
    /// Of each four rows, by columns; rows of zeros at the end.
    blocks: Vec<Vec<[f64; BLOCK]>>,
}

const BLOCK: usize = 4;

impl Weights {
    pub(super) fn new(rows: &[Vec<f64>]) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let block = |rows: &[Vec<f64>]| {
            let column = |j: usize| std::array::from_fn(|i| rows.get(i).map_or(0.0, |row| row[j]));
            (0..columns).map(column).collect()
        };
        Self { blocks: rows.chunks(BLOCK).map(block).collect() }
    }

    /// Adds to each sum what its row makes of the values, which belong to the columns from `first` on:
    /// `sums_i += sum_j M_i,first+j values_j`.
    #[inline(always)]
    pub(super) fn gather<S: Simd>(
        &self,
        simd: S,
        sums: &mut [Lanes],
        first: usize,
        values: &[Lanes],
    ) {
        for (sums, block) in sums.chunks_mut(BLOCK).zip(&self.blocks) {
            let mut own = [NONE; BLOCK];
            for (weights, value) in block[first..].iter().zip(values) {
                for (sum, weight) in own.iter_mut().zip(weights) {
                    add(simd, sum, *weight, value);
                }
            }
            for (sum, own) in sums.iter_mut().zip(&own) {
                add(simd, sum, 1.0, own);
            }
        }
    }

    /// Adds to each sum, one for each column, what its column makes of the values: `sums_j += sum_i M_ij values_i`.
    #[inline(always)]
    pub(super) fn scatter<S: Simd>(&self, simd: S, sums: &mut [Lanes], values: &[Lanes]) {
        for (values, block) in values.chunks(BLOCK).zip(&self.blocks) {
            let mut own = [NONE; BLOCK];
            own.iter_mut().zip(values).for_each(|(own, value)| *own = *value);
            for (sum, weights) in sums.iter_mut().zip(block) {
                for (weight, value) in weights.iter().zip(&own) {
                    add(simd, sum, *weight, value);
                }
            }
        }
    }
}

/// Adds a multiple.
#[inline(always)]
pub(super) fn add<S: Simd>(simd: S, sum: &mut Lanes, factor: f64, values: &Lanes) {
    let factor = simd.splat_f64s(factor);
    let (sums, values) = (S::as_mut_simd_f64s(sum).0, S::as_simd_f64s(values).0);
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum = simd.mul_add_e_f64s(factor, *value, *sum);
    }
}
