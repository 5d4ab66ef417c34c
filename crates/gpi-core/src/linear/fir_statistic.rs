//! All that the least squares of a finite impulse response need to know of records, however long these are.

use super::double_double::{Number, WIDTH, lagged_products, product};
use super::triangular_factor::{Gram, TriangularFactor};
use crate::{Error, Matrix};
use nalgebra::DVector;

/// The Gram matrix of lagged inputs with each other and with the outputs, gathered as samples come.
///
/// Its size is that of the model, `(taps inputs)^2`, whatever the number of samples: a record larger than memory goes
/// through it in parts, and what was gathered of several records adds up. The mean of each experiment is taken out.
///
/// The matrix is Toeplitz up to its edges: sums of products of the newest sample with its past give the first row and
/// column of each block, and `G[i+1, j+1] = G[i, j] + u[s-1-i] u[s-1-j] - u[e-1-i] u[e-1-j]` the rest, with s the first
/// row and e the end of an experiment. All of it is in twice the working precision, so that the estimate is as good as
/// one by an orthogonal decomposition of the regressor (see [`super::Fir::singular_values`]).
///
/// ```
/// use gpi_core::{Matrix, linear::FirStatistic};
/// let u = Matrix::from_fn(300, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Matrix::from_fn(300, 1, |k, _| 3.0 + 2.0 * u[k] - if k > 0 { u[k - 1] } else { 0.0 });
/// let mut statistic = FirStatistic::new(3, 1, 1)?;
/// for start in [0, 100, 200] {
///     statistic.push(&u.rows(start, 100).into(), &y.rows(start, 100).into())?;
/// }
/// let fir = statistic.solve(0.0)?;
/// assert!((fir.markov[1][0] + 1.0).abs() < 1e-12 && (fir.offsets[0] - 3.0).abs() < 1e-12);
/// # Ok::<(), gpi_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FirStatistic {
    taps: usize,
    inputs: usize,
    outputs: usize,
    gram: Gram,
    /// Of the experiments that have ended.
    sums: Vec<Sums>,
    present: Experiment,
}

/// What the offset of an experiment is found from.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    pub count: usize,
    /// Of each column of the regressor, then of each output.
    pub columns: DVector<f64>,
}

/// Samples that follow each other.
#[derive(Clone, Debug)]
struct Experiment {
    /// Rows that have come.
    seen: usize,
    /// The first row that counts.
    first: usize,
    /// Each input's latest `taps - 1` samples, before the first row that counts and now.
    before: Vec<Vec<f64>>,
    latest: Vec<Vec<f64>>,
    /// Sums over the rows that count: products of each input and output, and of one, with each input's past, by lag.
    products: Vec<Vec<Vec<Number>>>,
    /// Sums and squares of the outputs.
    outputs: Vec<[Number; 2]>,
}

impl Experiment {
    fn new(taps: usize, inputs: usize, outputs: usize, first: usize) -> Self {
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

    fn count(&self) -> usize {
        self.seen.saturating_sub(self.first)
    }

    /// Takes rows that follow those before.
    fn push(&mut self, input: &Matrix, output: &Matrix) {
        /// Samples whose products are summed at once: they stay in the processor's caches.
        const BLOCK: usize = 4096;
        let mut start = 0;
        while start < input.nrows() {
            // a block ends where the rows that count begin
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

    /// The sample of an input so many rows before the first row that counts, and before the end.
    fn edges(&self, input: usize, back: usize) -> (f64, f64) {
        let past = |samples: &[f64]| samples[samples.len() - back];
        (past(&self.before[input]), past(&self.latest[input]))
    }

    /// Adds what came, its mean taken out, to a Gram matrix.
    fn add_to(&self, gram: &mut Gram, taps: usize) -> Sums {
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

    /// The products of the lagged samples of two inputs.
    fn add_block(&self, gram: &mut Gram, taps: usize, a: usize, b: usize) {
        // along each diagonal from the first row or column
        let diagonal = |gram: &mut Gram, mut i: usize, mut j: usize, mut sum: Number| loop {
            gram.add_at(a * taps + i, b * taps + j, sum);
            (i, j) = (i + 1, j + 1);
            if i.max(j) == taps {
                break;
            }
            let ((entered_a, left_a), (entered_b, left_b)) = (self.edges(a, i), self.edges(b, j));
            sum += product(entered_a, entered_b);
            sum += -product(left_a, left_b);
        };
        for lag in 0..taps {
            diagonal(gram, lag, 0, self.products[b][a][lag]);
            if a != b && lag > 0 {
                diagonal(gram, 0, lag, self.products[a][b][lag]);
            }
        }
    }
}

impl FirStatistic {
    /// Most taps times inputs: their matrix takes 6.4 GB.
    pub const LARGEST: usize = 20_000;

    /// Nothing gathered yet, for `taps` Markov parameters of outputs x inputs.
    ///
    /// # Errors
    /// No taps, no input, no output, more unknowns than [`FirStatistic::LARGEST`].
    pub fn new(taps: usize, inputs: usize, outputs: usize) -> Result<Self, Error> {
        for (name, value, requirement) in [
            ("taps", taps, "at least one tap is needed"),
            ("inputs", inputs, "at least one input is needed"),
            ("outputs", outputs, "at least one output is needed"),
        ] {
            if value == 0 {
                return Err(Error::parameter(name, value, requirement));
            }
        }
        let unknowns = taps.saturating_mul(inputs);
        if unknowns > Self::LARGEST {
            let requirement =
                format!("with {inputs} inputs at most {} fit", Self::LARGEST / inputs);
            return Err(Error::parameter("taps", taps, requirement));
        }
        Ok(Self {
            taps,
            inputs,
            outputs,
            gram: Gram::zeros(taps * inputs, outputs),
            sums: Vec::new(),
            present: Experiment::new(taps, inputs, outputs, 0),
        })
    }

    /// Number of taps.
    pub fn taps(&self) -> usize {
        self.taps
    }

    /// Rows of the regression so far: samples whose past of `taps - 1` samples is known.
    pub fn samples(&self) -> usize {
        self.sums.iter().map(|sums| sums.count).sum::<usize>() + self.present.count()
    }

    /// Takes the next samples of the present experiment, each (samples, channels).
    ///
    /// # Errors
    /// Input and output of unequal length, another number of channels, samples that are not finite; nothing is taken
    /// then.
    pub fn push(&mut self, input: &Matrix, output: &Matrix) -> Result<(), Error> {
        Error::require_equal("samples", ("input", input.nrows()), ("output", output.nrows()))?;
        Error::require_equal("inputs", ("the statistic", self.inputs), ("here", input.ncols()))?;
        Error::require_equal("outputs", ("the statistic", self.outputs), ("here", output.ncols()))?;
        for (name, matrix) in [("input", input), ("output", output)] {
            // counted first: a search would look at one sample after the other
            let is_other = |value: &&f64| !value.is_finite();
            if matrix.as_slice().iter().filter(is_other).count() > 0
                && let Some(value) = matrix.iter().find(is_other)
            {
                return Err(Error::parameter(name, value, "every sample must be finite"));
            }
        }
        self.take(input, output);
        Ok(())
    }

    /// [`FirStatistic::push`] of what fits together.
    pub(super) fn take(&mut self, input: &Matrix, output: &Matrix) {
        self.present.push(input, output);
    }

    /// Ends the present experiment: what comes next has another past and another offset.
    pub fn end_experiment(&mut self) {
        self.begin(0);
    }

    /// Ends the present experiment; of the next one the rows before `first` only tell the past.
    pub(super) fn begin(&mut self, first: usize) {
        let next = Experiment::new(self.taps, self.inputs, self.outputs, first);
        let ended = std::mem::replace(&mut self.present, next);
        if ended.seen > 0 {
            self.sums.push(ended.add_to(&mut self.gram, self.taps));
        }
    }

    /// Adds what another one has gathered; the present experiments of both end.
    ///
    /// # Errors
    /// Another number of taps, inputs or outputs.
    pub fn merge(&mut self, mut other: Self) -> Result<(), Error> {
        Error::require_equal("taps", ("the statistic", self.taps), ("the other", other.taps))?;
        let inputs = (("the statistic", self.inputs), ("the other", other.inputs));
        Error::require_equal("inputs", inputs.0, inputs.1)?;
        let outputs = (("the statistic", self.outputs), ("the other", other.outputs));
        Error::require_equal("outputs", outputs.0, outputs.1)?;
        self.end_experiment();
        other.end_experiment();
        self.gram.add(&other.gram);
        self.sums.extend(other.sums);
        Ok(())
    }

    /// The decomposed regressor of all that came, and the sums of each experiment.
    pub(super) fn decompose(&self) -> (TriangularFactor, Vec<Sums>) {
        let mut all = self.clone();
        all.end_experiment();
        (all.gram.factor(), all.sums)
    }

    /// How many experiments came, the present one among them.
    pub fn experiments(&self) -> usize {
        self.sums.len() + usize::from(self.present.seen > 0)
    }

    pub(super) fn shape(&self) -> (usize, usize, usize) {
        (self.taps, self.inputs, self.outputs)
    }
}
