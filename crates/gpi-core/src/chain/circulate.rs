//! The loops of a model around its state space, a block of samples at a time.
//!
//! Loops that look ahead ([`Intersample`](crate::Intersample)) need v at the next sample. Those of the last sample of a block
//! therefore run at the first sample of the next block. Until then the last effect with loops remembers, behind what its
//! laws do, the state of G behind its dead time, v there, and the displacement of what is in parallel with G.

use super::between::{Between, Row};
use super::loops::{Loops, loops_of};
use super::stages::Stages;
use crate::effects::{InnerLoop, Place};
use crate::linear::StateSpace;
use crate::{Error, Intersample, LoopStep, Matrix, Model, ModelState};
use nalgebra::DVector;

/// A sample whose loops have not run yet.
struct Pending {
    state: Vec<f64>,
    v: Vec<f64>,
    beside: Vec<f64>,
}

impl Pending {
    /// Runs the loops, and adds what they drive to the state of the next sample.
    fn run(&self, loops: &mut Loops, next: &[f64], state: &mut DVector<f64>) {
        loops.run(&self.state, &self.v, next, &self.beside);
        let own = state.len() - self.state.len();
        loops.drive(&mut state.as_mut_slice()[own..]);
    }
}

impl Model {
    /// The same model with loops that are computed in other steps between samples, without [`Model::estimates`].
    ///
    /// ```
    /// use gpi_core::effects::{Drives, InnerLoop, Law, Sees, Stiffness};
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
    /// use gpi_core::{Channel, Hold, Intersample, Matrix, Model};
    /// // a mode of 0.7 rad a sample whose stiffness grows with the displacement
    /// let a = Matrix::from_row_slice(2, 2, &[1.5, 1.0, -0.98, 0.0]);
    /// let b = Matrix::from_column_slice(2, 1, &[0.24, 0.24]);
    /// let linear = StateSpace::new(a, b, Matrix::from_row_slice(1, 2, &[1.0, 0.0]), Matrix::zeros(1, 1))?;
    /// let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0], vec![1.0])?);
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let model = Model::new(10.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])?;
    /// let cubic = InnerLoop {
    ///     sees: Sees::Output(0),
    ///     law: Law::Power { exponent: 3, scale: 1.0 },
    ///     drives: Drives::States(vec![-0.02, -0.02]),
    /// };
    /// let coarse = model.with_effects(vec![Stiffness { loops: vec![cubic] }.into()])?;
    /// let fine = coarse.clone().with_intersample(Intersample { substeps: 8, hold: Hold::Zero })?;
    /// let input = Matrix::from_fn(50, 1, |k, _| f64::from(u8::from(k > 0)));
    /// let difference = coarse.simulate(&input)? - fine.simulate(&input)?;
    /// assert!(difference.amax() > 0.01);
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// Fewer than one or too many steps, and more than one where a pole of G is zero or negative: there is no motion between samples
    /// then that leads to those of G.
    pub fn with_intersample(mut self, intersample: Intersample) -> Result<Self, Error> {
        self.intersample = intersample;
        self.estimates = None;
        self.prediction = None;
        self.validate_effects()?;
        Ok(self)
    }

    /// All loops around G in all steps of a sample, the loops of the first step first.
    ///
    /// ```
    /// use gpi_core::linear::StateSpace;
    /// use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
    /// use gpi_core::{Channel, Matrix, Model};
    /// # let gain = Matrix::from_element(1, 1, 1.0);
    /// # let linear = StateSpace::new(Matrix::zeros(0, 0), Matrix::zeros(0, 1), Matrix::zeros(1, 0), gain)?;
    /// # let envelope = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided)?;
    /// # let gpi = Gpi::new(envelope, PlayBank::new(vec![0.0], vec![2.0])?);
    /// let channel = |name| vec![Channel::new(name, "")];
    /// let model = Model::new(10.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])?;
    /// assert!(model.loop_steps()?.is_empty());
    /// # Ok::<(), gpi_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// Dynamics that have no motion between samples, see [`Model::with_intersample`].
    pub fn loop_steps(&self) -> Result<Vec<LoopStep>, Error> {
        let Between { seen, drives } = self.between()?;
        let step = |(row, drives): (Row, Vec<f64>)| {
            let Row { states, inputs, next, earlier } = row;
            LoopStep { states, inputs, next, earlier, drives }
        };
        Ok(seen.into_iter().zip(drives).map(step).collect())
    }

    /// How the loops around G are computed between samples.
    pub fn intersample(&self) -> Intersample {
        self.intersample
    }

    /// The loops around G, from sample to sample.
    pub(super) fn between(&self) -> Result<Between, Error> {
        let loops: Vec<&InnerLoop> = loops_of(self.effects()).collect();
        if loops.is_empty() {
            return Ok(Between::default());
        }
        let own = self.linear().behind_dead_time().0;
        Between::new(&own, &loops, self.intersample()).ok_or_else(|| {
            let requirement = "must be 1 for dynamics with a pole that is zero or negative";
            Error::parameter("substeps", self.intersample().substeps, requirement)
        })
    }

    /// How many values the last effect with loops remembers of a sample whose loops have not run yet.
    pub(super) fn pending(&self) -> usize {
        let own = self.linear().behind_dead_time().0;
        let values = own.order() + own.inputs() + own.outputs();
        if self.intersample().looks_ahead() { values } else { 0 }
    }

    /// Adds what G makes of v with its loops closed to what sections in parallel with it make.
    pub(super) fn circulate(
        &self,
        state: &mut ModelState,
        v: &Matrix,
        output: &mut Matrix,
    ) -> Result<(), Error> {
        if v.nrows() == 0 {
            return Ok(());
        }
        let linear = self.linear();
        let own = linear.behind_dead_time().0;
        let looks_ahead = self.intersample().looks_ahead();
        let mut loops = Loops::new(loops_of(self.effects()).collect(), self.between()?);
        let stages = Stages { effects: self.effects(), rate: self.rate(), first: 0 };
        let mut closed: Vec<_> = stages.at(&mut state.effects, Place::closed_loops).collect();
        let mut known = closed.iter().flat_map(|(_, memory)| memory.iter().copied());
        // a memory that is empty is that of a start
        loops.places().zip(&mut known).for_each(|(place, known)| *place = known);
        let rest: Vec<f64> = known.collect();
        let mut pending = (!rest.is_empty()).then(|| Pending {
            state: rest[..own.order()].to_vec(),
            v: rest[own.order()..][..own.inputs()].to_vec(),
            beside: rest[own.order() + own.inputs()..].to_vec(),
        });
        for k in 0..v.nrows() {
            let now = v.row(k).transpose();
            let arrived = behind(linear, &own, &state.linear, &now);
            if let Some(before) = pending.take() {
                before.run(&mut loops, &arrived, &mut state.linear);
            }
            let first = linear.order() - own.order();
            let sample = Pending {
                state: state.linear.as_slice()[first..].to_vec(),
                beside: output.row(k).iter().copied().collect(),
                v: arrived,
            };
            let displacement = output.row(k) + linear.step(&mut state.linear, &now).transpose();
            output.set_row(k, &displacement);
            if looks_ahead {
                pending = Some(sample);
            } else {
                sample.run(&mut loops, &sample.v, &mut state.linear);
            }
        }
        let mut places = loops.places();
        for (own, memory) in &mut closed {
            let memories = own.loops().iter().map(|inner| inner.law.memories()).sum();
            **memory = places.by_ref().take(memories).map(|place| *place).collect();
        }
        if let (Some(Pending { state, v, beside }), Some((_, memory))) =
            (pending, closed.last_mut())
        {
            memory.extend(state.into_iter().chain(v).chain(beside));
        }
        Ok(())
    }
}

/// v as it leaves the dead time: what went in first.
fn behind(
    linear: &StateSpace,
    own: &StateSpace,
    state: &DVector<f64>,
    v: &DVector<f64>,
) -> Vec<f64> {
    let registers = linear.order() - own.order();
    let late = &state.as_slice()[registers.saturating_sub(v.len())..registers];
    if late.is_empty() { v.as_slice().to_vec() } else { late.to_vec() }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Channel;
    use crate::chain::hysteresis::Parameters;
    use crate::chain::looped::{fine, model, record, run};
    use crate::effects::{Drives, Law, Sees, Stiffness};
    use crate::fit::preparation::Prepared;
    use crate::operators::{Deadzones, Gpi, PlayBank, Reading};

    /// Dynamics of one input and one output.
    pub(in crate::chain) struct Plant {
        pub linear: StateSpace,
        /// What a constant force drives in a sample.
        pub force: Matrix,
        /// The force of a change of one in a sample.
        pub speed: f64,
    }

    /// The output for v with a cubic spring and Dahl's friction, from the steady state of the first v.
    pub(in crate::chain) fn simulated(
        plant: &Plant,
        v: &[f64],
        intersample: Intersample,
    ) -> Vec<f64> {
        let inner = |law, force: f64| InnerLoop {
            sees: Sees::Output(0),
            law,
            drives: Drives::States((force * &plant.force).as_slice().to_vec()),
        };
        let loops = vec![
            inner(Law::Power { exponent: 3, scale: 1.0 }, -0.05),
            inner(Law::Dahl { distance: 0.2, averaged: false }, -0.2),
            inner(Law::Speed, -plant.speed),
        ];
        let zones = Deadzones::new(vec![0.0], vec![1.0], Reading::OneSided).unwrap();
        let gpi = Gpi::new(zones, PlayBank::new(vec![0.0], vec![1.0]).unwrap());
        let channel = |name| vec![Channel::new(name, "")];
        let linear = plant.linear.clone();
        let model = Model::new(1.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])
            .and_then(|model| model.with_effects(vec![Stiffness { loops }.into()]))
            .and_then(|model| model.with_intersample(intersample))
            .unwrap();
        model.simulate(&Matrix::from_column_slice(v.len(), 1, v)).unwrap().as_slice().to_vec()
    }

    #[test]
    fn blocks_of_any_length_are_the_whole_record() {
        for model in [model(), fine()] {
            let input = run(1.5, 0.3, 0, vec![]).input;
            let whole = model.simulate(&input).unwrap();
            let mut state = model.start(input.row(0).transpose().as_slice()).unwrap();
            let mut first = 0;
            for length in [1, 1, 2, 3, 200, 493] {
                let block = input.rows(first, length).into_owned();
                let part = model.simulate_from(&mut state, &block).unwrap();
                assert!((part - whole.rows(first, length)).amax() < 1e-12, "{first}");
                first += length;
            }
            assert_eq!(first, input.nrows());
        }
    }

    #[test]
    fn a_point_is_its_model() {
        for model in [model(), fine()] {
            let mut experiment = run(1.5, 0.0, 20, vec![]);
            experiment.output = model.simulate(&experiment.input).unwrap();
            let record = record(&model, vec![experiment]);
            let channels = model.hysteresis().iter().map(Parameters::from_operator).collect();
            let prepared = Prepared::new(&record, channels).unwrap();
            let mut point = prepared.point_of(&model).unwrap();
            // offsets that are the means, which were taken away
            for offsets in &mut point.offsets {
                offsets.copy_from_slice(
                    &prepared.means.iter().map(|mean| -mean).collect::<Vec<f64>>(),
                );
            }
            let residual = &point.residuals(&prepared.record).unwrap()[0];
            assert!(residual.amax() < 1e-9, "{}", residual.amax());
        }
    }

    #[test]
    fn negative_poles_have_no_motion_between_samples() {
        let linear = StateSpace::new(
            Matrix::from_element(1, 1, -0.5),
            Matrix::from_element(1, 1, 1.0),
            Matrix::from_element(1, 1, 1.5),
            Matrix::zeros(1, 1),
        );
        let cubic = InnerLoop {
            sees: Sees::Output(0),
            law: Law::Power { exponent: 3, scale: 1.0 },
            drives: Drives::States(vec![-0.1]),
        };
        let channel = |name| vec![Channel::new(name, "")];
        let hysteresis = vec![model().hysteresis()[0].clone()];
        let plain =
            Model::new(1.0, channel("u"), channel("y"), hysteresis, linear.unwrap(), vec![0.0])
                .and_then(|plain| {
                    plain.with_effects(vec![Stiffness { loops: vec![cubic] }.into()])
                });
        let fine = Intersample { substeps: 2, ..Intersample::default() };
        let error = plain.unwrap().with_intersample(fine).unwrap_err().to_string();
        assert!(error.contains("substeps") && error.contains("negative"), "{error}");
    }
}
