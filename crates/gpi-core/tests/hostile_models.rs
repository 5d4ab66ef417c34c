//! Mutated model files and states: read, or refused with an error of this library; never a panic, an abort or a value
//! that is not finite without an error.
//!
//! `GPI_HOSTILE_MODELS=1000000 cargo test --release -p gpi-core --test hostile_models -- --nocapture` tries as many
//! models from fresh seeds (`GPI_HOSTILE_SEED`) and prints the counts by class.
#![cfg(feature = "identify")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use gpi_core::compensate::CompensateOptions;
use gpi_core::linear::TransferFunction;
use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
use gpi_core::{Channel, Error, ErrorKind, Matrix, Model, ModelState};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The generator `splitmix64` of Steele, Lea and Flood (2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }
}

/// Valid values of every effect that is saved in model files.
fn effects() -> Vec<Value> {
    vec![
        json!({"name": "delay", "input": 0, "samples": 1.5}),
        json!({"name": "amplifier-slew", "input": 0, "limit": 50.0}),
        json!({"name": "rate-dependence", "input": 0, "relative": 0.01, "absolute": 0.001, "speed": 10.0, "widest": 0.5,
            "law": {"exponent": -0.5, "knee": 5.0, "lag": 0.01}}),
        json!({"name": "hysteresis-shape", "input": 0, "coefficients": [0.1, 0.05], "widths": 1, "middle": 0.0,
            "scale": 1.0, "widest": 0.5}),
        json!({"name": "linear-dynamics", "input": 0, "denominator": [-1.2, 0.6], "numerator": [0.01, 0.02],
            "rate": 100.0, "dead_time": 1}),
        json!({"name": "creep", "input": 0, "time_constants": [0.3, 2.0], "gains": [0.02, 0.05], "dead_time": 2}),
        json!({"name": "stiffness", "loops": [
            {"sees": {"output": 0}, "law": {"power": {"exponent": 3, "scale": 1.0}}, "drives": [0.01]},
            {"sees": {"mixture": {"states": [0.2], "inputs": [0.1]}},
                "law": {"stops": {"half_widths": [0.1], "weights": [0.2]}}, "drives": [0.01]},
            {"sees": {"output": 0}, "law": {"damping": {"scale": 0.5}}, "drives": [0.01]}]}),
        json!({"name": "hysteretic-stiffness", "loops": [
            {"sees": {"output": 0}, "drives": [-0.01],
                "law": {"bouc-wen": {"beta": 0.5, "gamma": -0.2, "exponent": 1.5}}}]}),
        json!({"name": "friction", "loops": [
            {"sees": {"output": 0}, "drives": {"input": 0, "force": 0.02, "states": 1},
                "law": {"dahl": {"distance": 0.3, "averaged": true}}},
            {"sees": {"output": 0}, "drives": [0.01], "law": "speed"}]}),
        json!({"name": "saturation", "loops": [
            {"sees": {"output": 0}, "drives": [-0.1], "law": {"excess": {"limit": 2.0, "is_lower": false}}},
            {"sees": {"mixture": {"states": [0.5], "inputs": [0.1]}}, "drives": [-0.1],
                "law": {"excess": {"limit": -1.0, "is_lower": true}}}]}),
        json!({"name": "output-nonlinearity", "output": 0, "coefficients": [0.01, 0.02], "middle": 0.0, "scale": 5.0}),
        json!({"name": "gain-drift", "output": 0, "changes": [0.01, 0.02], "duration": 10.0}),
        json!({"name": "backlash", "output": 0, "half_width": 0.1}),
        json!({"name": "backlash", "output": 0, "half_width": 0.2, "missing": 0.8}),
        json!({"name": "drift", "output": 0, "moves_stage": true, "changes": [0.1, 0.2], "duration": 10.0, "span": 1.0}),
        json!({"name": "periodic-disturbance", "output": 0, "frequency": 50.0, "cosine": 0.1, "sine": 0.2,
            "duration": 10.0, "span": 1.0}),
        json!({"name": "covariate", "output": 0, "column": 0, "label": "T", "gain": 0.1, "time_constant": 0.5,
            "step": 0.1}),
        json!({"name": "outliers", "count": 2, "samples": 100, "size": 3.0}),
        json!({"name": "coloured-noise", "output": 0, "coefficients": [0.5], "innovation": 1.0, "deviation": 1.2}),
    ]
}

/// A model with some of the effects.
fn model(effects: &[Value]) -> Value {
    let envelope = Deadzones::new(vec![0.0, 1.0], vec![1.0, -0.3], Reading::OneSided).unwrap();
    let plays = PlayBank::new(vec![0.0, 0.4], vec![2.0, 1.0]).unwrap();
    let linear = TransferFunction::new(&[0.5], &[1.0, -0.5]).unwrap().to_state_space().unwrap();
    let channel = |name: &str| vec![Channel::new(name, "")];
    let hysteresis = vec![Gpi::new(envelope, plays)];
    let model =
        Model::new(100.0, channel("u"), channel("y"), hysteresis, linear, vec![7.0]).unwrap();
    let mut described: Value = serde_json::from_str(&model.to_json().unwrap()).unwrap();
    described["effects"] = effects.to_vec().into();
    if effects.len().is_multiple_of(2) {
        described["intersample"] = json!({"substeps": 2, "hold": "first"});
    }
    described
}

/// Values that are rare in honest files.
fn hostile(random: &mut Random) -> Value {
    let mut values = vec![
        json!(null),
        json!(true),
        json!(""),
        json!("gpi-model/1"),
        json!([]),
        json!({}),
        json!([[], 0, 0]),
        json!([[], 1_u64 << 63, 2]),
        json!([[], 1_u64 << 32, 1_u64 << 32]),
    ];
    let numbers = [
        0.0, -0.0, 1.0, -1.0, 2.0, 1.5, 1e-308, 5e-324, 1e17, 1e300, -1e300, 1e308, -1e308,
        0.999_999,
    ];
    values.extend(numbers.map(Value::from));
    values.extend([0, 1, 7, 101, u64::MAX, 1 << 53, 1 << 63, 400_000_000].map(Value::from));
    values.extend([-1, i64::MIN].map(Value::from));
    let place = random.below(values.len());
    values.swap_remove(place)
}

/// Counts the nodes of a tree.
fn nodes(value: &Value) -> usize {
    1 + match value {
        Value::Array(items) => items.iter().map(nodes).sum(),
        Value::Object(items) => items.values().map(nodes).sum(),
        _ => 0,
    }
}

/// Changes the node of number `place`, in depth-first order; what is left of the number otherwise.
fn change(value: &mut Value, place: usize, random: &mut Random) -> Option<usize> {
    if place == 0 {
        match (random.below(4), &mut *value) {
            (0, Value::Array(items)) if !items.is_empty() => {
                let own = random.below(items.len());
                items.push(items[own].clone());
            }
            (1, Value::Array(items)) if !items.is_empty() => {
                let own = random.below(items.len());
                items.remove(own);
            }
            (0 | 1, Value::Object(items)) if !items.is_empty() => {
                let own = random.below(items.len());
                let key = items.keys().nth(own).unwrap().clone();
                items.remove(&key);
            }
            (0 | 1, Value::Number(number)) => {
                let factor = [-1.0, 2.0, 10.0, 1e-3, 1e6, 1e100][random.below(6)];
                *value = number.as_f64().map_or(Value::Null, |number| (number * factor).into());
            }
            _ => *value = hostile(random),
        }
        return None;
    }
    let mut left = place - 1;
    let children: Vec<&mut Value> = match value {
        Value::Array(items) => items.iter_mut().collect(),
        Value::Object(items) => items.values_mut().collect(),
        _ => return Some(left),
    };
    for child in children {
        left = change(child, left, random)?;
    }
    Some(left)
}

/// Changes one number, so that the file keeps its form.
fn change_number(value: &mut Value, random: &mut Random) {
    match value {
        Value::Array(items) if !items.is_empty() => {
            let place = random.below(items.len());
            change_number(&mut items[place], random);
        }
        Value::Object(items) if !items.is_empty() => {
            let place = random.below(items.len());
            items.values_mut().nth(place).into_iter().for_each(|item| change_number(item, random));
        }
        Value::Number(_) => {
            let other = hostile(random);
            let factor = [-1.0, 2.0, 10.0, 1e-3, 1e6, 1e100][random.below(6)];
            let number = value.as_f64().unwrap_or(0.0);
            *value = if other.is_number() { other } else { (factor * number).into() };
        }
        _ => {}
    }
}

/// One to three nodes changed: any, or numbers alone; now and then the text itself.
fn mutated(mut value: Value, random: &mut Random) -> String {
    for _ in 0..=random.below(3) {
        if random.below(4) > 0 {
            change_number(&mut value, random);
            continue;
        }
        let place = random.below(nodes(&value));
        change(&mut value, place, random);
    }
    let mut text = value.to_string().into_bytes();
    if random.below(8) == 0 {
        let place = random.below(text.len());
        match random.below(4) {
            0 => text[place] ^= 1 << random.below(8),
            1 => text.truncate(place),
            2 => drop(text.remove(place)),
            _ => text.insert(place, b"0-9e[{\"]}"[random.below(9)]),
        }
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// The class of an error.
fn class(error: &Error) -> &'static str {
    match error.kind() {
        ErrorKind::Parameter => "refused: parameter",
        ErrorKind::Data => "refused: data",
        ErrorKind::Numerical => "refused: numerical",
    }
}

/// What a user does with a model that was read.
fn used(model: &Model, random: &mut Random) -> Result<(), Error> {
    let inputs = model.inputs().len();
    let input = Matrix::from_fn(40, inputs, |k, i| 1.5 * ((k + 3 * i) as f64 * 0.4).sin() + 0.5);
    let output = model.simulate(&input)?;
    assert!(output.iter().all(|value| value.is_finite()), "a value that is not finite");
    let again = Model::from_json(&model.to_json()?)?;
    assert_eq!(&again, model, "a model file that changes when it is written");
    let mut state = model.start(&input.row(0).iter().copied().collect::<Vec<_>>())?;
    model.simulate_from(&mut state, &input)?;
    let own = mutated(serde_json::to_value(&state).unwrap(), random);
    if let Ok(mut state) = serde_json::from_str::<ModelState>(&own)
        && let Ok(output) = model.simulate_from(&mut state, &input)
    {
        assert!(output.iter().all(|value| value.is_finite()), "a value that is not finite");
    }
    model.linear().spectral_radius()?;
    let options = CompensateOptions { passes: 2, ..CompensateOptions::default() };
    model.compensate(&output.rows(0, 8).into_owned(), &options)?;
    Ok(())
}

/// Tries models of consecutive seeds and counts what became of them.
fn tried(seeds: std::ops::Range<u64>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    let all = effects();
    for seed in seeds {
        let mut random = Random(seed);
        let chosen: Vec<Value> = all.iter().filter(|_| random.below(4) == 0).cloned().collect();
        let text = mutated(model(&chosen), &mut random);
        let outcome = catch_unwind(AssertUnwindSafe(|| match Model::from_json(&text) {
            Err(error) => format!("not read, {}", class(&error)),
            Ok(model) => match used(&model, &mut random) {
                Err(error) => format!("read, {}", class(&error)),
                Ok(()) => "read and used".to_owned(),
            },
        }));
        let outcome = outcome.unwrap_or_else(|_| {
            eprintln!("seed {seed}: {text}");
            "PANIC".to_owned()
        });
        *counts.entry(outcome).or_default() += 1;
    }
    counts
}

/// A number from the environment.
fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

#[test]
fn every_effect_of_the_corpus_is_valid_and_simulated() {
    let all = effects();
    let is_there = |name: &str| all.iter().any(|effect| effect["name"] == name);
    assert!(gpi_core::effects::CATALOGUE.iter().all(|entry| is_there(entry.name)));
    for effect in all {
        let model = Model::from_json(&model(std::slice::from_ref(&effect)).to_string());
        let model = model.unwrap_or_else(|error| panic!("{effect}: {error}"));
        model.simulate(&Matrix::from_element(5, 1, 1.0)).unwrap();
    }
}

#[test]
fn mutated_models_are_read_or_refused() {
    let (count, seed) = (number("GPI_HOSTILE_MODELS", 4000), number("GPI_HOSTILE_SEED", 1));
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
    let part = count.div_ceil(threads);
    let mut counts = BTreeMap::<String, usize>::new();
    std::thread::scope(|scope| {
        let own = |thread: u64| {
            let first = (seed << 32) + thread * part;
            scope.spawn(move || tried(first..first + part))
        };
        for own in (0..threads).map(own).collect::<Vec<_>>() {
            for (outcome, count) in own.join().unwrap() {
                *counts.entry(outcome).or_default() += count;
            }
        }
    });
    for (outcome, count) in &counts {
        println!("{count:9}  {outcome}");
    }
    assert!(!counts.contains_key("PANIC"), "see the seeds above");
    // the mutations leave models that are used, and reach every kind of refusal
    for outcome in ["read and used", "not read, refused: parameter", "not read, refused: data"] {
        assert!(counts.contains_key(outcome), "no model was {outcome}");
    }
}
