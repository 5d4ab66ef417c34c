//! The linear dynamics as sections in parallel: as many parameters as G has degrees of freedom.

use super::StateSpace;
use super::decompose::{eigen, solve};
use super::section::Section;
use crate::{Error, Matrix};
use nalgebra::DVector;
use num_complex::Complex64;
use std::f64::consts::FRAC_1_SQRT_2;

/// `G(z) = z^-delay (D + sum of sections)`. Each column of G is held to a DC gain by D, so that the scale of v is that of the hysteresis, or
/// D is held and the hysteresis has a scale of its own: G integrates then, or passes nothing of v at once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sections {
    pub delay: usize,
    pub sections: Vec<Section>,
    /// (outputs, inputs).
    pub d: Matrix,
    /// For each input: the output at which the DC gain is held, and that gain; `None` where D is held.
    pub held: Vec<Option<(usize, f64)>>,
}

type ComplexMatrix = nalgebra::DMatrix<Complex64>;

impl Sections {
    /// A gain (outputs, inputs) after a delay in samples.
    pub(crate) fn delayed_gain(gain: &Matrix, delay: usize) -> Self {
        let held = vec![Some((0, 0.0)); gain.ncols()];
        Self { delay, sections: Vec::new(), d: gain.clone(), held }.holding_present_gain()
    }

    /// The same with a first-order lag in parallel that carries half of every gain.
    pub(crate) fn with_lag(&self, pole: f64) -> Self {
        let outputs = self.outputs();
        let mut lagged = self.clone();
        lagged.d *= 0.5;
        for output in 0..outputs {
            let c = Matrix::from_fn(outputs, 1, |row, _| f64::from(u8::from(row == output)));
            let b = (1.0 - pole) * lagged.d.rows(output, 1);
            lagged.sections.push(Section { a: vec![-pole], b, c, reference: output, growth: 1.0 });
        }
        lagged
    }

    /// The sections of a state space, after `delay` samples that it does not contain.
    pub(crate) fn from_state_space(system: &StateSpace, delay: usize) -> Result<Self, Error> {
        let held = vec![Some((0, 0.0)); system.inputs()];
        let sections = sections_of(system, system.outputs())?;
        Ok(Self { delay, sections, d: system.d().clone(), held }.holding_present_gain())
    }

    /// The same of the first `inputs` and `outputs` of a state space. The others are what loops around it
    /// drive and see: returned are the columns of B (order, loops) and the rows of C (loops, order) that are
    /// theirs, in the coordinates of the sections.
    pub(crate) fn with_loops(
        system: &StateSpace,
        delay: usize,
        (inputs, outputs): (usize, usize),
    ) -> Result<(Self, Matrix, Matrix), Error> {
        let mut sections = sections_of(system, outputs)?;
        let (drives, seen) = (system.inputs() - inputs, system.outputs() - outputs);
        let mut e = Matrix::zeros(system.order(), drives);
        let mut s = Matrix::zeros(seen, system.order());
        let mut first = 0;
        for section in &mut sections {
            let order = section.order();
            e.rows_mut(first, order).copy_from(&section.b.columns(inputs, drives));
            s.columns_mut(first, order).copy_from(&section.c.rows(outputs, seen));
            section.b = section.b.columns(0, inputs).into_owned();
            section.c = section.c.rows(0, outputs).into_owned();
            first += order;
        }
        let d = system.d().view((0, 0), (outputs, inputs)).into_owned();
        // a feedthrough of zero stays zero: the output of a mass answers its input one sample later
        let is_delayed = |input: usize| d.column(input).iter().all(|value| *value == 0.0);
        let held = (0..inputs).map(|input| (!is_delayed(input)).then_some((0, 0.0))).collect();
        Ok((Self { delay, sections, d, held }.holding_present_gain(), e, s))
    }

    /// The sections of a state space, its leading samples without response counted as the delay.
    pub(crate) fn from_delayed_state_space(system: &StateSpace) -> Result<Self, Error> {
        let order = system.order();
        let markov = system.markov(2 * order + 3);
        let largest = markov.iter().map(Matrix::amax).fold(0.0, f64::max);
        let delay = markov.iter().take_while(|tap| tap.amax() <= 1e-12 * largest).count();
        if delay == 0 || delay >= markov.len() {
            return Self::from_state_space(system, 0);
        }
        // What is left of G without its delay: y(k) = G v(k - delay), so C A^delay and H_delay.
        let mut c = system.c().clone();
        for _ in 0..delay {
            c *= system.a();
        }
        let shorter =
            StateSpace::new(system.a().clone(), system.b().clone(), c, markov[delay].clone())?;
        let hankel = super::Hankel::new(&shorter.markov(8 * order + 3), None)?;
        let states = hankel.significant(1e-9).min(order);
        if states == 0 {
            return Ok(Self::delayed_gain(&markov[delay], delay));
        }
        Self::from_state_space(&hankel.realize(states)?.system, delay)
    }

    pub(crate) fn inputs(&self) -> usize {
        self.d.ncols()
    }

    pub(crate) fn outputs(&self) -> usize {
        self.d.nrows()
    }

    /// States without those of the delay.
    pub(crate) fn order(&self) -> usize {
        self.sections.iter().map(Section::order).sum()
    }

    pub(crate) fn is_stable(&self) -> bool {
        self.sections.iter().all(Section::is_stable)
    }

    /// The poles, without those of the delay.
    pub(crate) fn poles(&self) -> Vec<Complex64> {
        self.sections.iter().flat_map(Section::poles).collect()
    }

    /// Whether any pair of poles resonates.
    pub(crate) fn has_resonance(&self) -> bool {
        self.poles().iter().any(resonates)
    }

    /// G(1), (outputs, inputs).
    pub(crate) fn dc_gain(&self) -> Matrix {
        self.sections.iter().fold(self.d.clone(), |sum, s| sum + &s.c * s.steady(&s.b))
    }

    /// `(I - A)^-1 E`, (order): the states in steady state where E is added to each next state.
    pub(crate) fn steady_states(&self, e: &[f64]) -> Vec<f64> {
        let mut rest = e;
        let of = |section: &Section| {
            let (own, others) = rest.split_at(section.order());
            rest = others;
            section.steady(&Matrix::from_column_slice(own.len(), 1, own)).as_slice().to_vec()
        };
        self.sections.iter().flat_map(of).collect()
    }

    /// `C (I - A)^-1 E`, (outputs): the outputs in steady state where E is added to each next state.
    pub(crate) fn gains_from_states(&self, e: &[f64]) -> DVector<f64> {
        self.c() * DVector::from_vec(self.steady_states(e))
    }

    /// The same with some of the poles only, complex ones in pairs, and with D as it is.
    pub(crate) fn with_poles(&self, is_wanted: impl Fn(&Complex64) -> bool) -> Self {
        let wanted = self.sections.iter().filter_map(|section| section.with_poles(&is_wanted));
        Self { sections: wanted.collect(), ..self.clone() }.holding_present_gain()
    }

    /// The column of B of an input.
    pub(crate) fn driven_by(&self, input: usize) -> impl Iterator<Item = f64> {
        self.sections.iter().flat_map(move |section| section.b.column(input).into_iter().copied())
    }

    /// C, (outputs, order).
    pub(crate) fn c(&self) -> Matrix {
        let mut c = Matrix::zeros(self.outputs(), self.order());
        let mut first = 0;
        for section in &self.sections {
            c.columns_mut(first, section.order()).copy_from(&section.c);
            first += section.order();
        }
        c
    }

    /// G(e^jw) at w radians per sample, (outputs, inputs).
    pub(crate) fn response(&self, frequency: f64) -> ComplexMatrix {
        let z = Complex64::from_polar(1.0, frequency);
        let complex = |matrix: &Matrix| matrix.map(|value| Complex64::new(value, 0.0));
        let mut sum = complex(&self.d);
        for section in &self.sections {
            // (z I - A)^-1 of the observer form, by hand
            let resolvent = match section.a[..] {
                [a1, a2] => {
                    let denominator = z * z + a1 * z + a2;
                    let one = Complex64::new(1.0, 0.0);
                    let a2 = Complex64::new(a2, 0.0);
                    ComplexMatrix::from_row_slice(2, 2, &[z, one, -a2, z + a1]) / denominator
                }
                _ => ComplexMatrix::from_element(1, 1, 1.0 / (z + section.a[0])),
            };
            sum += complex(&section.c) * resolvent * complex(&section.b);
        }
        sum * Complex64::from_polar(1.0, -frequency * self.delay as f64)
    }

    /// Holds the largest DC gain of every column at its present value, where one is held.
    pub(crate) fn holding_present_gain(mut self) -> Self {
        let dc = self.dc_gain();
        for (input, held) in self.held.iter_mut().enumerate() {
            let output = dc.column(input).map(f64::abs).imax();
            *held = held.map(|_| (output, dc[(output, input)]));
        }
        self
    }

    /// The same with D free where it was held, so that the DC gain is held instead.
    pub(crate) fn with_free_feedthrough(mut self) -> Self {
        self.held = vec![Some((0, 0.0)); self.inputs()];
        self.holding_present_gain()
    }

    /// Gives every column of G whose DC gain is held a largest one of plus or minus one; returns what was divided by.
    pub(crate) fn normalize_gain(&mut self) -> Vec<f64> {
        let dc = self.dc_gain();
        let mut gains = Vec::new();
        for input in 0..self.inputs() {
            let gain = dc.column(input).amax();
            let is_held = self.held[input].is_some();
            let gain = if is_held && gain > 0.0 && gain.is_finite() { gain } else { 1.0 };
            self.d.column_mut(input).unscale_mut(gain);
            for section in &mut self.sections {
                section.b.column_mut(input).unscale_mut(gain);
            }
            gains.push(gain);
        }
        *self = std::mem::take(self).holding_present_gain();
        gains
    }

    /// Makes D what the held DC gains ask for.
    pub(crate) fn hold_gain(&mut self) {
        let dc = self.dc_gain();
        for (input, held) in self.held.iter().enumerate() {
            if let &Some((output, gain)) = held {
                self.d[(output, input)] += gain - dc[(output, input)];
            }
        }
    }

    /// The state space: the delay's shift registers, then the sections.
    pub(crate) fn to_state_space(&self) -> Result<StateSpace, Error> {
        let (inputs, outputs) = (self.inputs(), self.outputs());
        let chain = StateSpace::delayed_gain(&Matrix::identity(inputs, inputs), self.delay);
        let (delayed, order) = (chain.order(), self.order());
        let total = delayed + order;
        let mut a = Matrix::zeros(total, total);
        let mut b = Matrix::zeros(total, inputs);
        let mut c = Matrix::zeros(outputs, total);
        a.view_mut((0, 0), (delayed, delayed)).copy_from(chain.a());
        b.view_mut((0, 0), (delayed, inputs)).copy_from(chain.b());
        c.view_mut((0, 0), (outputs, delayed)).copy_from(&(&self.d * chain.c()));
        let mut first = delayed;
        for section in &self.sections {
            let n = section.order();
            a.view_mut((first, first), (n, n)).copy_from(&section.matrix());
            a.view_mut((first, 0), (n, delayed)).copy_from(&(&section.b * chain.c()));
            b.view_mut((first, 0), (n, inputs)).copy_from(&(&section.b * chain.d()));
            c.view_mut((0, first), (outputs, n)).copy_from(&section.c);
            first += n;
        }
        StateSpace::new(a, b, c, &self.d * chain.d())
    }
}

/// Whether a pole z is one of a pair that has a resonance: its damping `-Re s / |s|`, `s = ln z`, is below `1 / sqrt(2)`.
pub(crate) fn resonates(pole: &Complex64) -> bool {
    pole.im != 0.0 && -pole.ln().re < FRAC_1_SQRT_2 * pole.ln().norm()
}

/// The sections of a state space; the first `references` outputs may fix their states' scales.
fn sections_of(system: &StateSpace, references: usize) -> Result<Vec<Section>, Error> {
    let (poles, vectors) = eigen_of(system)?;
    let complex = |matrix: &Matrix| matrix.map(|value| Complex64::new(value, 0.0));
    let seen = complex(system.c()) * &vectors;
    let driven = solve(vectors, &complex(system.b()))
        .unwrap_or_else(|| ComplexMatrix::zeros(system.order(), system.inputs()));
    let section = |members: Vec<usize>| {
        let poles: Vec<Complex64> = members.iter().map(|&i| poles[i]).collect();
        let (seen, driven) = (seen.select_columns(&members), driven.select_rows(&members));
        Section::from_poles(&poles, &seen, &driven, references)
    };
    Ok(group(&poles).into_iter().map(section).collect())
}

fn eigen_of(system: &StateSpace) -> Result<(DVector<Complex64>, ComplexMatrix), Error> {
    if system.order() == 0 {
        return Ok((DVector::zeros(0), ComplexMatrix::zeros(0, 0)));
    }
    eigen(system.a())
}

/// Conjugate pairs by ascending frequency, then real poles two by two in descending order, then a single one.
fn group(poles: &DVector<Complex64>) -> Vec<Vec<usize>> {
    let is_real = |i: &usize| poles[*i].im.abs() <= 1e-9 * poles[*i].norm().max(1e-300);
    let (mut real, complex): (Vec<usize>, Vec<usize>) = (0..poles.len()).partition(is_real);
    real.sort_by(|&i, &j| poles[j].re.total_cmp(&poles[i].re));
    let mut upper: Vec<usize> = complex.iter().copied().filter(|&i| poles[i].im > 0.0).collect();
    upper.sort_by(|&i, &j| poles[i].arg().total_cmp(&poles[j].arg()));
    let mut lower: Vec<usize> = complex.into_iter().filter(|&i| poles[i].im < 0.0).collect();
    let mut groups = Vec::new();
    for i in upper {
        let distance = |j: &usize| (poles[*j] - poles[i].conj()).norm();
        let nearest =
            (0..lower.len()).min_by(|&j, &k| distance(&lower[j]).total_cmp(&distance(&lower[k])));
        if let Some(nearest) = nearest {
            groups.push(vec![i, lower.swap_remove(nearest)]);
        }
    }
    groups.extend(real.chunks(2).map(<[usize]>::to_vec));
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_poles(poles: &[Complex64]) -> Sections {
        let count = poles.len();
        let seen = ComplexMatrix::from_element(1, count, Complex64::new(1.0, 0.0));
        let driven = ComplexMatrix::from_element(count, 1, Complex64::new(0.3, 0.0));
        let d = Matrix::from_element(1, 1, 0.2);
        let sections = vec![Section::from_poles(poles, &seen, &driven, 1)];
        Sections { delay: 0, sections, d, held: vec![Some((0, 0.0))] }.holding_present_gain()
    }

    #[test]
    fn one_of_two_real_poles() {
        let real = |re: f64| Complex64::new(re, 0.0);
        let both = of_poles(&[real(0.9), real(0.5)]);
        let slow = both.with_poles(|pole| pole.re > 0.8);
        // D + c b / (1 - p)
        assert!((slow.dc_gain()[(0, 0)] - 0.2 - 0.3 / 0.1).abs() < 1e-9, "{slow:?}");
        assert_eq!(slow.poles().len(), 1);
        assert!((both.with_poles(|_| true).dc_gain() - both.dc_gain()).amax() < 1e-9);
    }

    #[test]
    fn only_a_weakly_damped_pair_resonates() {
        // the poles of a mode of natural frequency 0.1 rad a sample
        let pair = |damping: f64| {
            let s = 0.1 * Complex64::new(-damping, (1.0 - damping * damping).sqrt());
            of_poles(&[s.exp(), s.exp().conj()])
        };
        assert!(pair(0.02).has_resonance() && pair(0.69).has_resonance());
        assert!(!pair(0.72).has_resonance());
        let real = of_poles(&[Complex64::new(-0.3, 0.0), Complex64::new(0.9, 0.0)]);
        assert!(!real.has_resonance());
    }
}
