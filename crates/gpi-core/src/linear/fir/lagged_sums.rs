//! The sums over one experiment from which the Gram matrix of its regressor follows.
//!
//! The regressor of `taps` lagged samples has the columns `u_a(k - i)`, i = 0 .. taps - 1, for each input a. The Gram
//! matrix `G[a i, b j] = sum_k u_a(k - i) u_b(k - j)` over the rows s <= k < e is Toeplitz up to its edges:
//!
//! ```text
//! G[a i+1, b j+1] = G[a i, b j] + u_a(s-1-i) u_b(s-1-j) - u_a(e-1-i) u_b(e-1-j)
//! ```
//!
//! So the products of every signal with the lagged inputs (first row and column of each block) and the samples at both
//! edges are enough. All sums have twice the working precision.

use super::double_double::{Number, WIDTH, lagged_products};
use super::gram::Gram;
use super::numbers::Numbers;
use crate::Matrix;
use nalgebra::DVector;
use pulp::Simd;

/// Samples whose products are summed at once: a block of all signals stays in the processor's caches.
const BLOCK: usize = 4096;

/// The sums from which the offset of an experiment follows.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    pub count: usize,
    /// The sum of each column of the regressor, then of each output.
    pub columns: DVector<f64>,
}

/// The sums over one experiment, gathered as its samples arrive.
#[derive(Clone, Debug)]
pub(super) struct LaggedSums {
    /// Number of samples so far.
    pub seen: usize,
    /// The first sample that is a row of the regression.
    first: usize,
    /// The latest `taps - 1` samples of each input, before the first row and now.
    before: Vec<Vec<f64>>,
    latest: Vec<Vec<f64>>,
    /// Sums over the rows, by signal (inputs, outputs, then the constant 1), input and lag: signal times lagged input.
    products: Vec<Vec<Vec<Number>>>,
    /// Sum and sum of squares of each output.
    outputs: Vec<[Number; 2]>,
}

impl LaggedSums {
    /// No sample yet; rows begin at `first`, or later where `taps - 1` earlier samples are known.
    pub(super) fn new(taps: usize, inputs: usize, outputs: usize, first: usize) -> Self {
        let past = vec![vec![0.0; taps - 1]; inputs];
        let mut products = vec![vec![vec![Number::ZERO; taps]; inputs]; inputs + outputs];
        products.push(vec![vec![Number::ZERO; 1]; inputs]);
        Self {
            seen: 0,
            first: first.max(taps - 1),
            before: past.clone(),
            latest: past,
            products,
            outputs: vec![[Number::ZERO; 2]; outputs],
        }
    }

    /// Number of rows of the regression so far.
    pub(super) fn count(&self) -> usize {
        self.seen.saturating_sub(self.first)
    }

    /// Adds the next samples, (samples, channels).
    pub(super) fn push(&mut self, input: &Matrix, output: &Matrix) {
        let mut start = 0;
        while start < input.nrows() {
            // a block ends where the rows begin
            let limit = if self.seen < self.first { self.first - self.seen } else { BLOCK };
            let count = limit.min(BLOCK).min(input.nrows() - start);
            self.block(input, output, start, count);
            start += count;
        }
    }

    fn block(&mut self, input: &Matrix, output: &Matrix, start: usize, count: usize) {
        let counts = self.seen >= self.first;
        if self.seen == self.first {
            self.before.clone_from(&self.latest);
        }
        let past = self.latest.first().map_or(0, Vec::len);
        let padded = count.next_multiple_of(WIDTH);
        let block = |channel: &[f64]| channel[start..start + count].to_vec();
        let mut sources = Vec::new();
        for (latest, channel) in self.latest.iter_mut().zip(input.column_iter()) {
            let mut source = std::mem::take(latest);
            source.extend(block(channel.as_slice()));
            *latest = source[source.len() - past..].to_vec();
            source.resize(past + padded, 0.0);
            sources.push(source);
        }
        self.seen += count;
        if !counts {
            return;
        }
        let mut targets: Vec<Vec<f64>> = sources.iter().map(|s| s[past..].to_vec()).collect();
        targets.extend(output.column_iter().map(|channel| block(channel.as_slice())));
        targets.push(vec![1.0; count]);
        for (target, products) in targets.iter_mut().zip(&mut self.products) {
            target.resize(padded, 0.0);
            for (source, sums) in sources.iter().zip(products) {
                lagged_products(target, &source[past + 1 - sums.len()..], sums);
            }
        }
        let ones = &targets[targets.len() - 1];
        for (target, [sum, square]) in targets[self.latest.len()..].iter().zip(&mut self.outputs) {
            lagged_products(target, ones, std::array::from_mut(sum));
            lagged_products(target, target, std::array::from_mut(square));
        }
    }

    /// The sample of an input `back` samples before the first row, and before the end.
    fn edges(&self, input: usize, back: usize) -> (f64, f64) {
        let past = |samples: &[f64]| samples[samples.len() - back];
        (past(&self.before[input]), past(&self.latest[input]))
    }

    /// Adds the Gram matrix of the centred columns to `gram`.
    pub(super) fn add_to(&self, gram: &mut Gram, taps: usize) -> Sums {
        let (inputs, count) = (self.latest.len(), self.count());
        let mut columns = Vec::new();
        for input in 0..inputs {
            let mut sum = self.products[inputs + self.outputs.len()][input][0];
            columns.push(sum);
            for lag in 1..taps {
                let (entered, left) = self.edges(input, lag);
                sum += Number::from(entered);
                sum += Number::from(-left);
                columns.push(sum);
            }
        }
        columns.extend(self.outputs.iter().map(|[sum, _]| *sum));
        let values = columns.iter().map(|sum| sum.value());
        let sums = Sums { count, columns: DVector::from_iterator(columns.len(), values) };
        if count == 0 {
            return sums;
        }
        for a in 0..inputs {
            for b in 0..=a {
                self.add_block(gram, taps, a, b);
            }
            for output in 0..self.outputs.len() {
                for (lag, sum) in self.products[inputs + output][a].iter().enumerate() {
                    gram.add_at(inputs * taps + output, a * taps + lag, *sum);
                }
            }
        }
        for (square, [_, own]) in gram.squares.iter_mut().zip(&self.outputs) {
            *square += *own;
        }
        gram.take_means(&columns, count);
        sums
    }

    /// Adds the block of two inputs, column by column.
    fn add_block(&self, gram: &mut Gram, taps: usize, a: usize, b: usize) {
        struct Columns<'a>(&'a LaggedSums, &'a mut Gram, [usize; 3]);
        impl pulp::WithSimd for Columns<'_> {
            type Output = ();
            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) {
                let Self(sums, gram, [taps, a, b]) = self;
                sums.add_columns(simd, gram, taps, a, b);
            }
        }
        pulp::Arch::new().dispatch(Columns(self, gram, [taps, a, b]));
    }

    /// Element i of column j follows from element i - 1 of column j - 1. Both have one place in a sequence of numbers,
    /// of which each column shows a part that begins one place earlier, with an element of the first row.
    #[inline(always)]
    fn add_columns<S: Simd>(&self, simd: S, gram: &mut Gram, taps: usize, a: usize, b: usize) {
        let edges = |input: usize| {
            let back = move |back| if back > 0 { self.edges(input, back) } else { (0.0, 0.0) };
            (0..taps).map(back)
        };
        let (entered, left): (Vec<f64>, Vec<f64>) = edges(a).unzip();
        let mut numbers = Numbers::default();
        numbers.extend(self.products[a][b].iter().rev());
        // the element of row and column 0 is in both
        numbers.extend(&self.products[b][a][1..]);
        for (column, (own_entered, own_left)) in edges(b).enumerate() {
            let start = taps - 1 - column;
            // of a symmetric block, the lower part
            let row = if a == b { column } else { 0 };
            if column > 0 {
                let rows = row.max(1)..taps;
                let mut part = numbers.part_mut(start + rows.start..start + taps);
                part.add_products(simd, own_entered, &entered[rows.clone()]);
                part.add_products(simd, -own_left, &left[rows]);
            }
            let mut own = gram.part_mut(b * taps + column, a * taps + row, taps - row);
            own.add(simd, numbers.part(start + row..start + taps));
        }
    }
}
