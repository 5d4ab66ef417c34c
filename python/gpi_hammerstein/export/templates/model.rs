//! $title.
//!
$facts

#![forbid(unsafe_code)]
// a program need not use every function
#![allow(dead_code)]

/// The number type.
pub type Real = $real;

/// The number of inputs: $inputs_said.
pub const INPUTS: usize = $inputs;
/// The number of outputs: $outputs_said.
pub const OUTPUTS: usize = $outputs;
@leak
/// The number of covariates: $covariates_said.
pub const COVARIATES: usize = $covariates;
@end
const STATES: usize = $states;
@widened

/// Samples a second.
const RATE: Real = $rate;
@end

$tables

/// The model with its state between two samples.
#[derive(Clone, Debug)]
pub struct Model {
    /// Of the linear dynamics.
    states: [Real; STATES],
    plays: [Real; $plays],
    /// The last one that reached the hysteresis.
    drive: [Real; INPUTS],
    /// Of the effects.
    memory: [Real; $memory],
    input: [Real; INPUTS],
@leak
    covariates: [Real; COVARIATES],
@end
    /// Number of samples since the start.
    sample: u32,
    not_finite: bool,
}

impl Model {
    /// Returns the steady state after the actuator has moved from zero to this input. For the simulation of a
    /// record, this is its first input. Functions of time start at zero.
    pub fn standing_at(input: [Real; INPUTS]) -> Self {
        let mut own = Self {
            states: [0.0; STATES],
            plays: [0.0; $plays],
            drive: [0.0; INPUTS],
            memory: [0.0; $memory],
            input: [0.0; INPUTS],
@leak
            covariates: [0.0; COVARIATES],
@end
            sample: 0,
            not_finite: false,
        };
        own.observe(input);
        let mut v = own.input;
$start_hysteresis
        for (state, row) in own.states.iter_mut().zip(STEADY.chunks_exact(INPUTS)) {
            *state = row.iter().zip(&v).map(|(steady, v)| steady * v).sum();
        }
$start_effects
        own
    }

    /// Computes the next sample of the outputs. A value that is NaN or infinite is replaced by the last finite
    /// one of its channel.
    #[inline]
@leak
    pub fn step(&mut self, input: [Real; INPUTS], covariates: [Real; COVARIATES]) -> [Real; OUTPUTS] {
@else
    pub fn step(&mut self, input: [Real; INPUTS]) -> [Real; OUTPUTS] {
@end
        self.observe(input);
@leak
        for (held, value) in self.covariates.iter_mut().zip(covariates) {
            if value.is_finite() {
                *held = value;
            } else {
                self.not_finite = true;
            }
        }
@end
        let mut v = self.input;
$drive
$move
        let mut signals = [0.0; STATES + INPUTS];
        signals[..STATES].copy_from_slice(&self.states);
        signals[STATES..].copy_from_slice(&v);
@steps
        // the loops from the sample before to this one
        if self.sample > 0 {
$settle
        }
@end
        let mut next = [0.0; STATES];
        let mut y = [0.0; OUTPUTS];
        multiply(&signals, &mut next, &mut y);
$respond
        self.states = next;
$read
        for (y, offset) in y.iter_mut().zip(&OFFSETS) {
            *y += offset;
        }
        self.sample = self.sample.saturating_add(1);
        y
    }

    /// Returns whether an input was NaN or infinite.
    pub fn not_finite(&self) -> bool {
        self.not_finite
    }

    /// Clears this fault.
    pub fn clear_not_finite(&mut self) {
        self.not_finite = false;
    }

    fn observe(&mut self, input: [Real; INPUTS]) {
        for (held, value) in self.input.iter_mut().zip(input) {
            if value.is_finite() {
                *held = value;
            } else {
                self.not_finite = true;
            }
        }
    }

$hysteresis
}

/// The next states and the output of the linear dynamics, from the states and v.
#[inline]
fn multiply(signals: &[Real; STATES + INPUTS], next: &mut [Real; STATES], y: &mut [Real; OUTPUTS]) {
    let mut first = 0;
    for (result, &end) in next.iter_mut().chain(y).zip(&ROW_ENDS) {
        for j in first..end {
            *result += FACTORS[j] * signals[COLUMNS[j]];
        }
        first = end;
    }
}

$operations