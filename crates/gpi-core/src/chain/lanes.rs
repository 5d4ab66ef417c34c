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
//! [`Weights`] stores M by blocks of four rows, and each block by columns; the rows that are left, of most models their only one, follow one by
//! one. In a gather, the four sums of a block stay in registers while the values are read once; with vectors of eight numbers they are
//! four registers, with vectors of four numbers eight. Each product is a fused multiply-add, which rounds once. The results may therefore differ from
//! the adjoint pass, which multiplies and adds, in the last bits.

use pulp::Simd;

/// Unknowns that run side by side: what the widest vectors of today's processors hold.
pub(super) const LANES: usize = 8;
pub(super) type Lanes = [f64; LANES];
pub(super) const NONE: Lanes = [0.0; LANES];

/// Rows of numbers that weigh the same values, four rows side by side, and the rest one by one.
pub(super) struct Weights {
    /// Of each four rows, by columns.
    blocks: Vec<Vec<[f64; BLOCK]>>,
    /// The rows behind them.
    rest: Vec<Vec<f64>>,
}

const BLOCK: usize = 4;

impl Weights {
    pub(super) fn new(rows: &[Vec<f64>]) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let block = |rows: &[Vec<f64>]| {
            let column = |j: usize| std::array::from_fn(|i| rows[i][j]);
            (0..columns).map(column).collect()
        };
        let whole = rows.chunks_exact(BLOCK);
        Self { rest: whole.remainder().to_vec(), blocks: whole.map(block).collect() }
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
        let (in_blocks, one_by_one) = sums.split_at_mut(BLOCK * self.blocks.len());
        for (sums, block) in in_blocks.chunks_exact_mut(BLOCK).zip(&self.blocks) {
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
        for (sum, row) in one_by_one.iter_mut().zip(&self.rest) {
            let mut own = NONE;
            for (weight, value) in row[first..].iter().zip(values) {
                add(simd, &mut own, *weight, value);
            }
            add(simd, sum, 1.0, &own);
        }
    }

    /// Adds to each sum, one for each column, what its column makes of the values: `sums_j += sum_i M_ij values_i`.
    #[inline(always)]
    pub(super) fn scatter<S: Simd>(&self, simd: S, sums: &mut [Lanes], values: &[Lanes]) {
        let (in_blocks, one_by_one) = values.split_at(BLOCK * self.blocks.len());
        for (values, block) in in_blocks.chunks_exact(BLOCK).zip(&self.blocks) {
            for (sum, weights) in sums.iter_mut().zip(block) {
                for (weight, value) in weights.iter().zip(values) {
                    add(simd, sum, *weight, value);
                }
            }
        }
        for (value, row) in one_by_one.iter().zip(&self.rest) {
            for (sum, weight) in sums.iter_mut().zip(row) {
                add(simd, sum, *weight, value);
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
