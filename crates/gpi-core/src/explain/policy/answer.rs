//! Settings of what is said besides the effects: of the noise, of the structure, and of the next experiment.

use crate::Error;
use crate::settings::{FROM_ONE, PART, POSITIVE, settings};

settings! {
    /// When the noise itself is called an effect.
    struct NoisePolicy {
        /// Times that the search goes on with what the past of autocorrelated noise does not predict. What the model lacks is part
        /// of the noise's model at first, and less of it the second time. By hand.
        rounds: usize = 2, 0.0..=10.0;
        /// Part of a whitened residual's variance that the input may predict for the search to go on in this way. By hand: more is
        /// the error of a model beside a little noise.
        predictable: f64 = 0.1, PART;
        /// Part by which the rms residual may grow there, and by which it must fall for the search to go on from there. By hand: it
        /// grew by less than 1 % on a stage with 1/f noise and a drifting gain, and by 12 % where a smooth error of the model passed
        /// for noise.
        grown: f64 = 0.05, PART;
        /// Fewer wrong samples may be noise, or come from the way in which a record was cut. By hand.
        fewest: usize = 3, FROM_ONE;
        /// Part of them that may follow a jump of the input: where most do, the model errs at jumps. By hand.
        after_jumps: f64 = 0.5, PART;
        /// Samples that follow a jump, and the part of the input's changes that are no jumps. By hand.
        shortly: usize = 8, FROM_ONE;
        no_jumps: f64 = 0.99, PART;
        /// A residual so many times larger than the noise at rest comes from the stage. The factor is well above one
        /// because slow noise shows only in part while the input rests. By hand.
        louder: f64 = 2.5, FROM_ONE;
        /// Where the input never rests: a residual of this part of the output's span is no sensor's noise. By hand.
        loud: f64 = 0.02, PART;
        /// Innovations of coloured noise over the noise floor, which sees its fast part. On records of known truth
        /// coloured noise has about 1, relays and friction more than 4.
        innovation: f64 = 2.0, FROM_ONE;
        /// Part by which a prediction from the residual's past must lower its standard deviation, and by which an impossible effect
        /// of the input must not. By hand.
        predicted: f64 = 0.1, PART;
        /// Fourth moment over the square of the second. Stationary Gaussian noise has 3 whatever its
        /// autocorrelation, and what comes in bursts while the stage moves has more. By hand.
        kurtosis: f64 = 3.8, FROM_ONE;
    }

    /// When a resonance is said to have moved.
    struct ResonancePolicy {
        /// Largest over smallest output amplitude (rms): experiments nearer to each other tell nothing. By hand.
        apart: f64 = 1.25, FROM_ONE;
        /// Standard deviations by which the frequencies must differ: beyond doubt, since the sentence rules a cause out.
        sure: f64 = 5.0, 0.0..=100.0;
        /// Steps of the fit to each experiment, and the part of the squares below which a step is the last. By hand.
        steps: usize = 8, FROM_ONE;
        gain: f64 = 1e-4, PART;
    }

    /// When the declared structure is said to be wrong, see [`outside`](super::super::outside).
    struct OutsidePolicy {
        /// Root mean square residual over the noise floor below which no reason is asked for. By hand.
        near_noise: f64 = 1.5, FROM_ONE;
        /// Squares without the integrals of the input over those with them. By hand, between the stages of
        /// `python/tests/plants/textbook` that integrate and the tanks there.
        integrated: f64 = 2.0, FROM_ONE;
        /// The largest part of the output's squares that the regression with the integrals may leave. By hand, between the same
        /// stages: a slow plant that begins in motion has a large ratio, but it is not described well.
        remainder: f64 = 0.05, PART;
        /// Past values and plays of the input that stand beside the integrals, and the ridge of the regression: enough to
        /// describe an ordinary stage roughly. By hand.
        lags: [usize; 12] = [0, 1, 2, 3, 5, 8, 12, 20, 32, 50, 80, 128], 0.0..=1e6;
        plays: usize = 10, FROM_ONE;
        ridge: f64 = 1e-8, PART;
        /// Leaking integrals that are tried instead, and the longest of their time constants over the length of the longest
        /// experiment; each next one is half as long. By hand: what is forgotten within a twentieth of the record is no integral.
        leaks: usize = 8, 1.0..=30.0;
        forgotten: f64 = 0.05, PART;
        /// Part of the rms error that a rival must take: less is of no use. By hand.
        useful: f64 = 0.05, PART;
        /// Standard errors of the mean logarithm of the blocks' ratios. With ten blocks and four rivals, 3 % of equal
        /// rivals win by chance.
        standard_errors: f64 = 3.0, 0.0..=100.0;
        /// Blocks of held-out time at least, for a standard error of their differences.
        parts: usize = 10, FROM_ONE;
        /// Part of the samples that stand at a limit. By hand: on records of known truth a clipping sensor has 1.5 %.
        clipped: f64 = 0.005, PART;
        /// Part of the samples between the ends of the range that may repeat the one before them where a few samples are
        /// to show a limit. By hand: noise in double precision never repeats, and quantized signals do at every turning point.
        repeated: f64 = 0.001, PART;
        /// Samples of a run at a limit, the part of the input's span that it moves meanwhile, and how many times more
        /// samples stand there than at the next value. By hand.
        run: usize = 3, FROM_ONE;
        moved: f64 = 0.01, PART;
        crowded: f64 = 5.0, FROM_ONE;
        /// Past inputs and past outputs that predict the next input. The inputs' past is long, so that modes that ring
        /// know nothing older.
        past_inputs: usize = 160, FROM_ONE;
        past_outputs: usize = 10, FROM_ONE;
        /// Part of the squares that past outputs must take, and its standard errors. On records of known truth a stage
        /// under feedback has 0.47 and 21, and fifty others at most 0.06 or at most 5.
        predicted: f64 = 0.1, PART;
        sure: f64 = 5.0, 0.0..=100.0;
        /// Mean square of what the input's past leaves of its step, in half spans: less is rounding of a smooth input.
        least_news: f64 = 1e-10, PART;
        /// Bins of a loop's mean curve: each has many samples, and the ends are steep enough.
        bins: usize = 20, FROM_ONE;
        /// Parts of the curve's variance that is even and of the output's that it follows, and the mean opening of either
        /// lobe over the output's standard deviation. By hand.
        even: f64 = 0.8, PART;
        followed: f64 = 0.5, PART;
        crossed: f64 = 0.02, PART;
    }

    /// What experiment is proposed.
    struct ProposalPolicy {
        /// Seconds of it, long enough for creep, and the most samples, few enough to be handled. By hand.
        seconds: f64 = 600.0, POSITIVE;
        samples: f64 = 1e6, FROM_ONE;
        /// Periods of a triangle in that time. By hand.
        periods: f64 = 20.0, POSITIVE;
    }
}
