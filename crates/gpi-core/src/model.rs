//! The identified model: one hysteresis per input, then the linear dynamics.

use crate::effects::Effect;
use crate::estimates::Estimates;
use crate::linear::StateSpace;
use crate::operators::{Gpi, GpiState, Operator};
use crate::simulation_error::SimulationError;
use crate::uncertainty::Prediction;
use crate::{Channel, Error, Intersample, Matrix, Record};
use nalgebra::DVector;

/// The hysteresis of one input: envelope and plays with parameters on the heap.
pub type Hysteresis = Gpi<Vec<f64>, Vec<f64>>;

/// `y = G(q) P[D[u]] + offset`, in the units of the record it was identified from.
///
/// G has unit DC gain where one input drives one output (minus one where the output falls when the
/// input rises, since the play weights are not negative); the gain is carried by the play weights.
/// With more channels the largest DC gain of every column of G is plus or minus one.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Model {
    schema: String,
    rate: f64,
    inputs: Vec<Channel>,
    outputs: Vec<Channel>,
    hysteresis: Vec<Hysteresis>,
    pub(crate) linear: StateSpace,
    offsets: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) effects: Vec<Effect>,
    #[serde(default, skip_serializing_if = "Intersample::is_default")]
    pub(crate) intersample: Intersample,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) estimates: Option<Estimates>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) prediction: Option<Prediction>,
}

/// Everything a [`Model`] remembers between two samples.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ModelState {
    /// One state per input.
    pub hysteresis: Vec<GpiState<f64, Vec<f64>>>,
    /// The state x of the linear dynamics.
    #[serde(with = "crate::linear::matrix_file::vector")]
    pub linear: DVector<f64>,
    /// What each effect remembers.
    #[serde(default)]
    pub effects: Vec<Vec<f64>>,
    /// Samples since the start, from which effects of time count.
    #[serde(default)]
    pub sample: usize,
}

impl Model {
    /// The schema that model files name.
    pub const SCHEMA: &'static str = "gpi-model/1";

    /// A model from its parts; `offsets` has one constant per output.
    ///
    /// # Errors
    /// Parts whose channels do not fit together.
    pub fn new(
        rate: f64,
        inputs: Vec<Channel>,
        outputs: Vec<Channel>,
        hysteresis: Vec<Hysteresis>,
        linear: StateSpace,
        offsets: Vec<f64>,
    ) -> Result<Self, Error> {
        let schema = Self::SCHEMA.to_owned();
        let effects = Vec::new();
        let (estimates, prediction) = (None, None);
        let model = Self {
            schema,
            rate,
            inputs,
            outputs,
            hysteresis,
            linear,
            offsets,
            effects,
            intersample: Intersample::default(),
            estimates,
            prediction,
        };
        model.validate()?;
        Ok(model)
    }

    fn validate(&self) -> Result<(), Error> {
        let (inputs, outputs) = (self.inputs.len(), self.outputs.len());
        Error::require_equal("inputs", ("names", inputs), ("hysteresis", self.hysteresis.len()))?;
        Error::require_equal("inputs", ("names", inputs), ("linear", self.linear.inputs()))?;
        Error::require_equal("outputs", ("names", outputs), ("linear", self.linear.outputs()))?;
        Error::require_equal("outputs", ("names", outputs), ("offsets", self.offsets.len()))?;
        crate::record::require_names(&self.inputs)?;
        crate::record::require_names(&self.outputs)?;
        self.validate_effects()?;
        if let Some(prediction) = &self.prediction {
            prediction.validate(self.numbers().len(), outputs)?;
        }
        if self.rate.is_finite() && self.rate > 0.0 {
            Ok(())
        } else {
            Err(Error::parameter("rate", self.rate, "the sampling rate in Hz must be positive"))
        }
    }

    /// Sampling rate in Hz.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// The input channels.
    pub fn inputs(&self) -> &[Channel] {
        &self.inputs
    }

    /// The output channels.
    pub fn outputs(&self) -> &[Channel] {
        &self.outputs
    }

    /// The hysteresis of each input.
    pub fn hysteresis(&self) -> &[Hysteresis] {
        &self.hysteresis
    }

    /// The linear dynamics G.
    pub fn linear(&self) -> &StateSpace {
        &self.linear
    }

    /// The constant term of each output, in its unit.
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// How sure the parameters are, where the model was refined or its file says so.
    pub fn estimates(&self) -> Option<&Estimates> {
        self.estimates.as_ref()
    }

    /// The same model with the uncertainty of its parameters, which its file then contains.
    #[must_use]
    pub fn with_estimates(self, estimates: Estimates) -> Self {
        Self { estimates: Some(estimates), ..self }
    }

    /// What the model knows about the errors of its own simulations; `None` for a model that was not estimated.
    pub fn prediction(&self) -> Option<&Prediction> {
        self.prediction.as_ref()
    }

    /// The state of an actuator that was raised from zero to `input` (one value per input) once and
    /// has been kept there until all transients have decayed.
    ///
    /// # Errors
    /// Another number of values than inputs.
    pub fn start(&self, input: &[f64]) -> Result<ModelState, Error> {
        Error::require_equal(
            "inputs",
            ("input", input.len()),
            ("hysteresis", self.hysteresis.len()),
        )?;
        let mut driven = DVector::zeros(input.len());
        let mut states = Vec::new();
        for ((hysteresis, &value), v) in self.hysteresis.iter().zip(input).zip(driven.iter_mut()) {
            let mut state = hysteresis.rest();
            *v = hysteresis.step(&mut state, value);
            states.push(state);
        }
        for (input, (state, v)) in states.iter().zip(driven.iter_mut()).enumerate() {
            *v = self.read_plays(input, state, *v);
        }
        let mut state = ModelState {
            hysteresis: states,
            linear: self.linear.equilibrium(&driven),
            effects: Vec::new(),
            sample: 0,
        };
        self.rest_effects(&mut state, input, &driven);
        Ok(state)
    }

    /// The intermediate signals v (samples, inputs) of a drive (samples, inputs) that has passed the
    /// input stage; what `state` knows of the hysteresis moves on.
    ///
    /// # Errors
    /// Another number of channels or states than inputs.
    pub fn intermediate_from(
        &self,
        state: &mut ModelState,
        input: &Matrix,
    ) -> Result<Matrix, Error> {
        let ModelState { hysteresis: states, effects: memories, .. } = state;
        let inputs = self.hysteresis.len();
        Error::require_equal("channels", ("input", input.ncols()), ("hysteresis", inputs))?;
        Error::require_equal("channels", ("state", states.len()), ("hysteresis", inputs))?;
        let mut v = input.clone();
        let samples = input.nrows();
        let columns = v.as_mut_slice().chunks_exact_mut(samples.max(1));
        for ((place, state), column) in states.iter_mut().enumerate().zip(columns) {
            self.play_from(place, state, memories, column)?;
        }
        Ok(v)
    }

    /// The outputs (samples, outputs) for an input (samples, inputs); `state` moves on, so that a
    /// record simulated in parts equals the whole.
    ///
    /// # Errors
    /// Another number of channels than inputs.
    pub fn simulate_from(&self, state: &mut ModelState, input: &Matrix) -> Result<Matrix, Error> {
        self.simulate_with(state, input, &Matrix::zeros(input.nrows(), 0))
    }

    /// The same with other measured columns (samples, covariates), which an effect may let leak in; a
    /// column that is not there counts as zero.
    ///
    /// # Errors
    /// Another number of channels than inputs, columns of another length.
    pub fn simulate_with(
        &self,
        state: &mut ModelState,
        input: &Matrix,
        covariates: &Matrix,
    ) -> Result<Matrix, Error> {
        let (inputs, samples) = (self.hysteresis.len(), input.nrows());
        Error::require_equal("channels", ("input", input.ncols()), ("hysteresis", inputs))?;
        let rows = ("covariates", covariates.nrows());
        Error::require_equal("samples", ("input", samples), rows)?;
        self.require_own(state)?;
        let drive = self.drive_from(state, input);
        let v = self.intermediate_from(state, &drive)?;
        let mut output = self.respond_from(state, &v)?;
        if samples > 0 {
            self.read_from(state, &mut output, covariates);
        }
        state.sample += samples;
        for (mut column, offset) in output.column_iter_mut().zip(&self.offsets) {
            column.add_scalar_mut(*offset);
        }
        self.require_bounded(&output)?;
        Ok(output)
    }

    /// The outputs of an actuator in steady state at the first input before the record begins, see
    /// [`Model::start`].
    ///
    /// # Errors
    /// No sample, another number of channels than inputs.
    pub fn simulate(&self, input: &Matrix) -> Result<Matrix, Error> {
        self.simulate_from(&mut self.start_of(input)?, input)
    }

    /// As [`Model::simulate`], with other measured columns, see [`Model::simulate_with`].
    ///
    /// # Errors
    /// No sample, another number of channels than inputs, columns of another length.
    pub fn simulate_beside(&self, input: &Matrix, covariates: &Matrix) -> Result<Matrix, Error> {
        self.simulate_with(&mut self.start_of(input)?, input, covariates)
    }

    /// The intermediate signals v (samples, inputs) that belong to [`Model::simulate`].
    ///
    /// # Errors
    /// No sample, another number of channels than inputs.
    pub fn intermediate(&self, input: &Matrix) -> Result<Matrix, Error> {
        let mut state = self.start_of(input)?;
        let drive = self.drive_from(&mut state, input);
        self.intermediate_from(&mut state, &drive)
    }

    /// Refuses an output that is not finite, which only an unstable model or absurd numbers give.
    fn require_bounded(&self, output: &Matrix) -> Result<(), Error> {
        // counted first: a count vectorizes, a search does not
        if output.as_slice().iter().filter(|value| !value.is_finite()).count() == 0 {
            return Ok(());
        }
        let is_wrong = |row: &usize| output.row(*row).iter().any(|value| !value.is_finite());
        let sample = (0..output.nrows()).find(is_wrong).unwrap_or(0);
        Err(Error::Diverged { sample, modulus: self.linear.spectral_radius()? })
    }

    fn start_of(&self, input: &Matrix) -> Result<ModelState, Error> {
        if input.nrows() == 0 {
            let purpose = "a simulation".to_owned();
            return Err(Error::TooFewSamples { samples: 0, needed: 1, purpose });
        }
        self.start(&input.row(0).iter().copied().collect::<Vec<_>>())
    }

    /// Rejects a record that lacks a measured column which an effect is made of.
    pub(crate) fn require_covariates_of(&self, record: &Record) -> Result<(), Error> {
        let names: Vec<&str> = record.covariates().iter().map(|own| own.name.as_str()).collect();
        self.require_covariates(&names)
    }

    /// Measured minus simulated output of every experiment, (samples, outputs), warm-up included.
    ///
    /// # Errors
    /// Another number of channels than the model's; a measured column that an effect needs is not in the record.
    pub fn residuals(&self, record: &Record) -> Result<Vec<Matrix>, Error> {
        let outputs = ("record's outputs", record.outputs().len());
        Error::require_equal("outputs", outputs, ("model's outputs", self.outputs.len()))?;
        let simulated = self.simulate_record(record)?;
        let experiments = record.experiments().iter().zip(simulated);
        Ok(experiments.map(|(experiment, output)| &experiment.output - output).collect())
    }

    /// The outputs of every experiment of a record, (samples, outputs), each from the steady state at its first input and
    /// with the record's other measured columns, see [`Model::simulate_beside`].
    ///
    /// # Errors
    /// Another number of inputs than the model's; a measured column that an effect needs is not in the record.
    pub fn simulate_record(&self, record: &Record) -> Result<Vec<Matrix>, Error> {
        self.require_covariates_of(record)?;
        let simulated = |e: &crate::Experiment| self.simulate_beside(&e.input, &e.covariates);
        record.experiments().iter().map(simulated).collect()
    }

    /// The simulation error over the scored samples of a record; `remove_mean` takes the mean of
    /// each experiment's residual out first, for sensors whose offset moves between experiments.
    ///
    /// # Errors
    /// Another number of channels than the model's.
    pub fn error(&self, record: &Record, remove_mean: bool) -> Result<SimulationError, Error> {
        let residuals = self.residuals(record)?;
        Ok(SimulationError::of(record, &residuals, remove_mean))
    }

    /// The model as JSON of the schema [`Model::SCHEMA`].
    ///
    /// # Errors
    /// A parameter that JSON cannot hold.
    pub fn to_json(&self) -> Result<String, Error> {
        serde_json::to_string_pretty(self)
            .map_err(|error| Error::ModelFile { reason: error.to_string() })
    }

    /// Reads what [`Model::to_json`] wrote.
    ///
    /// # Errors
    /// A schema that this version does not know, text that is not a model.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let reason = |error: serde_json::Error| Error::ModelFile { reason: error.to_string() };
        // some editors begin a text file with a byte order mark
        let text = text.trim_start_matches('\u{feff}');
        let value: serde_json::Value = serde_json::from_str(text).map_err(reason)?;
        match value.get("schema").and_then(serde_json::Value::as_str) {
            Some(Self::SCHEMA) => {}
            Some(found) => {
                return Err(Error::Schema { found: found.to_owned(), expected: Self::SCHEMA });
            }
            None => {
                return Err(Error::ModelFile { reason: "it names no `schema`".to_owned() });
            }
        }
        crate::record::require_texts(&value)?;
        let model: Self = serde_json::from_value(value).map_err(reason)?;
        // Built once more through the constructors, which refuse what does not fit together.
        for hysteresis in &model.hysteresis {
            let plays = hysteresis.plays();
            let (r, p) = (plays.half_widths().to_vec(), plays.weights().to_vec());
            crate::operators::PlayBank::new(r, p)?;
        }
        let g = &model.linear;
        StateSpace::new(g.a().clone(), g.b().clone(), g.c().clone(), g.d().clone())?;
        model.validate()?;
        Ok(model)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::operators::{Deadzones, PlayBank, Reading};

    pub(crate) fn example() -> Model {
        let envelope = Deadzones::new(vec![0.0, 1.0], vec![1.0, -0.3], Reading::OneSided).unwrap();
        let plays = PlayBank::new(vec![0.0, 0.4], vec![2.0, 1.0]).unwrap();
        let linear = TransferFunction::new(&[0.5], &[1.0, -0.5]).unwrap().to_state_space().unwrap();
        let channel = |name: &str| vec![Channel::new(name, "")];
        let hysteresis = vec![Gpi::new(envelope, plays)];
        Model::new(100.0, channel("u"), channel("y"), hysteresis, linear, vec![7.0]).unwrap()
    }

    #[test]
    fn json_round_trip_is_exact() {
        let model = example();
        assert_eq!(Model::from_json(&model.to_json().unwrap()).unwrap(), model);
    }

    #[test]
    fn foreign_schemas_are_refused() {
        let text = example().to_json().unwrap().replace("gpi-model/1", "gpi-model/9");
        assert!(matches!(
            Model::from_json(&text),
            Err(Error::Schema { found, .. }) if found == "gpi-model/9"
        ));
        assert!(matches!(Model::from_json("{}"), Err(Error::ModelFile { .. })));
        assert!(matches!(Model::from_json("no json"), Err(Error::ModelFile { .. })));
    }

    #[test]
    fn a_model_continues_from_a_saved_state() {
        let model = example();
        let input = Matrix::from_fn(60, 1, |k, _| 2.0 * (k as f64 * 0.3).sin() + 1.0);
        let whole = model.simulate(&input).unwrap();
        let mut state = model.start(&[1.0]).unwrap();
        let first = model.simulate_from(&mut state, &input.rows(0, 25).into_owned()).unwrap();
        let text = serde_json::to_string(&state).unwrap();
        let mut state: ModelState = serde_json::from_str(&text).unwrap();
        let rest = model.simulate_from(&mut state, &input.rows(25, 35).into_owned()).unwrap();
        assert_eq!(whole.rows(0, 25), first);
        assert_eq!(whole.rows(25, 35), rest);
    }

    #[test]
    fn a_standing_actuator_stands_still() {
        let model = example();
        let output = model.simulate(&Matrix::from_element(20, 1, 1.5)).unwrap();
        assert!(output.iter().all(|value| (value - output[0]).abs() < 1e-12));
    }
}
