//! What every unknown is called in results.

use crate::chain::point::{Layout, Point};
use crate::{Channel, Record};

impl Layout {
    /// A name for every unknown, such as `u.weights[3]`; play weights, deadzone weights, thresholds
    /// and half-widths are numbered as in the point, experiments and knots from 0.
    pub(crate) fn names(&self, point: &Point, record: &Record) -> Vec<String> {
        let mut names = vec![String::new(); self.len];
        let (inputs, outputs) = (record.inputs(), record.outputs());
        let name = |channel: &Channel| channel.name.clone();
        for (input, channel) in inputs.iter().enumerate() {
            // the model's deadzones stand in the order of their thresholds
            let thresholds = &point.channels[input].thresholds;
            let rank = |j: usize| thresholds.iter().filter(|&&eta| eta < thresholds[j]).count();
            for (group, unknowns) in
                [("weights", &self.weights[input]), ("half_widths", &self.half_widths[input])]
            {
                for (place, i) in unknowns.clone().enumerate() {
                    names[i] = format!("{}.{group}[{place}]", name(channel));
                }
            }
            for (group, unknowns) in
                [("deadzone_weights", &self.slopes[input]), ("thresholds", &self.thresholds[input])]
            {
                for (place, i) in unknowns.clone().enumerate() {
                    names[i] = format!("{}.{group}[{}]", name(channel), rank(place));
                }
            }
        }
        for (number, unknowns) in self.sections.iter().enumerate() {
            let order = point.dynamics.sections[number].order();
            for (place, i) in unknowns.a.clone().enumerate() {
                names[i] = format!("section[{number}].a{}", place + 1);
            }
            for (place, i) in unknowns.b.clone().enumerate() {
                let input = name(&inputs[place / order]);
                names[i] = format!("section[{number}].b{}[{input}]", place % order + 1);
            }
            for (place, i) in unknowns.c.clone().enumerate() {
                let output = name(&outputs[place % outputs.len()]);
                names[i] = format!("section[{number}].c{}[{output}]", place / outputs.len() + 1);
            }
        }
        for (column, unknown) in self.feedthrough.iter().enumerate() {
            if let &Some(i) = unknown {
                let (output, input) = (column % outputs.len(), column / outputs.len());
                names[i] =
                    format!("feedthrough[{}, {}]", name(&outputs[output]), name(&inputs[input]));
            }
        }
        for (effect, unknowns) in point.effects.iter().zip(&self.effects) {
            for (place, i) in unknowns.clone().enumerate() {
                names[i] = format!("{}.value[{place}]", effect.name());
            }
        }
        for (experiment, unknowns) in self.offsets.iter().enumerate() {
            let knots = point.offsets[experiment].nrows();
            for (place, i) in unknowns.clone().enumerate() {
                let output = name(&outputs[place / knots]);
                names[i] = if knots == 1 {
                    format!("offset[{experiment}].{output}")
                } else {
                    format!("offset[{experiment}].{output}[{}]", place % knots)
                };
            }
        }
        for (experiment, plays) in self.plays.iter().enumerate() {
            for (input, unknowns) in plays.iter().enumerate() {
                for (place, i) in unknowns.clone().enumerate() {
                    names[i] = format!("start[{experiment}].{}[{place}]", name(&inputs[input]));
                }
            }
            for (place, i) in self.states[experiment].clone().enumerate() {
                names[i] = format!("start[{experiment}].state[{place}]");
            }
        }
        names
    }

    /// The value of every unknown.
    pub(crate) fn values(&self, point: &Point) -> Vec<f64> {
        let mut values = vec![0.0; self.len];
        let mut set = |unknowns: &std::ops::Range<usize>, from: &[f64]| {
            for (i, value) in unknowns.clone().zip(from) {
                values[i] = *value;
            }
        };
        for (input, channel) in point.channels.iter().enumerate() {
            set(&self.weights[input], &channel.weights);
            set(&self.slopes[input], &channel.slopes);
            set(&self.thresholds[input], &channel.thresholds);
            set(&self.half_widths[input], &channel.half_widths);
        }
        for (section, unknowns) in point.dynamics.sections.iter().zip(&self.sections) {
            set(&unknowns.a, &section.a);
            set(&unknowns.b, section.b.as_slice());
            set(&unknowns.c, section.c.as_slice());
        }
        for (effect, unknowns) in point.effects.iter().zip(&self.effects) {
            set(unknowns, &effect.values());
        }
        for (element, unknown) in point.dynamics.d.iter().zip(&self.feedthrough) {
            if let &Some(i) = unknown {
                set(&(i..i + 1), &[*element]);
            }
        }
        for (experiment, past) in point.pasts.iter().enumerate() {
            set(&self.offsets[experiment], point.offsets[experiment].as_slice());
            for (plays, unknowns) in past.plays.iter().flatten().zip(&self.plays[experiment]) {
                set(unknowns, plays);
            }
            set(&self.states[experiment], past.state.as_slice());
        }
        values
    }
}
