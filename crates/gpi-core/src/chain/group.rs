//! The groups of parameters of a point, in one fixed order.
//!
//! A group knows how many values it has, reads them from a [`Point`] and writes them back; its bounds ([`super::bounds`]), its names
//! ([`super::names`]) and the places of the chain where its derivatives enter ([`super::injections`]) are each one `match` over [`Group`].
//! Which of them are unknowns of a fit, and where they stand, says the [`Table`](super::table::Table).

use super::hysteresis::Parameters;
use super::point::{DynamicsFreedom, Freedom, Point};
use crate::effects::{Coefficients, Drives};
use crate::linear::{Section, move_poles};

/// A group of parameters of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    /// Weights of the plays of an input.
    Weights {
        input: usize,
    },
    /// Slopes of the deadzones of an input.
    Slopes {
        input: usize,
    },
    Thresholds {
        input: usize,
    },
    HalfWidths {
        input: usize,
    },
    /// a of a section.
    Denominator {
        section: usize,
    },
    /// b of a section, (order, inputs) by columns.
    Numerator {
        section: usize,
    },
    /// c of a section, (outputs, order) by columns. The row of the reference output is held.
    Observer {
        section: usize,
    },
    /// a of a section of an effect in parallel with G.
    ParallelDenominator {
        place: usize,
        section: usize,
    },
    /// b of the same; one input drives it.
    ParallelNumerator {
        place: usize,
        section: usize,
    },
    /// One element of D.
    Feedthrough {
        input: usize,
        output: usize,
    },
    /// The values of an effect; effects that are sections have none here.
    Effect {
        place: usize,
    },
    /// The additive term of an experiment, (knots, outputs) by columns.
    Offsets {
        experiment: usize,
    },
    /// The initial places of the plays of an input in an experiment.
    Plays {
        experiment: usize,
        input: usize,
    },
    /// Where the readings of [`Point::gapped`] stand at first in an experiment.
    Gaps {
        experiment: usize,
    },
    /// The initial state of the sections in an experiment.
    State {
        experiment: usize,
    },
}

use Group::{
    Denominator, Effect, Feedthrough, Gaps, HalfWidths, Numerator, Observer, Offsets,
    ParallelDenominator, ParallelNumerator, Plays, Slopes, State, Thresholds, Weights,
};

/// All groups of a point.
pub(super) fn groups(point: &Point) -> Vec<Group> {
    let (inputs, outputs) = (0..point.channels.len(), 0..point.dynamics.outputs());
    let experiments = 0..point.pasts.len();
    let mut all = Vec::new();
    all.extend(inputs.clone().map(|input| Weights { input }));
    all.extend(inputs.clone().map(|input| Slopes { input }));
    all.extend(inputs.clone().map(|input| Thresholds { input }));
    all.extend(inputs.clone().map(|input| HalfWidths { input }));
    for section in 0..point.dynamics.sections.len() {
        all.extend([Denominator { section }, Numerator { section }, Observer { section }]);
    }
    for place in 0..point.effects.len() {
        for section in 0..sections(point, place).len() {
            all.push(ParallelDenominator { place, section });
            all.push(ParallelNumerator { place, section });
        }
    }
    for input in inputs.clone() {
        all.extend(outputs.clone().map(|output| Feedthrough { input, output }));
    }
    all.extend((0..point.effects.len()).map(|place| Effect { place }));
    all.extend(experiments.clone().map(|experiment| Offsets { experiment }));
    for experiment in experiments.clone() {
        all.extend(inputs.clone().map(|input| Plays { experiment, input }));
    }
    all.extend(experiments.clone().map(|experiment| Gaps { experiment }));
    all.extend(experiments.map(|experiment| State { experiment }));
    all
}

/// The places of both states of each section of two poles, of sections of such orders from a place on.
fn paired(orders: impl IntoIterator<Item = usize>, first: usize) -> Vec<[usize; 2]> {
    let mut next = first;
    let mut pairs = Vec::new();
    for order in orders {
        if order == 2 {
            pairs.push([next, next + 1]);
        }
        next += order;
    }
    pairs
}

/// The sections of an effect.
fn sections(point: &Point, place: usize) -> Vec<Coefficients> {
    let own = point.effects[place].place().parallel_sections();
    own.map_or_else(Vec::new, |own| own.sections(point.rate))
}

impl Group {
    pub(super) fn is_free(self, point: &Point, freedom: Freedom) -> bool {
        let Freedom { derivatives, dynamics, .. } = freedom;
        match self {
            Weights { .. } | Slopes { .. } | Offsets { .. } => true,
            Thresholds { .. } => derivatives.thresholds,
            HalfWidths { .. } => derivatives.half_widths,
            Denominator { .. } | ParallelDenominator { .. } => {
                dynamics == DynamicsFreedom::Everything
            }
            Numerator { .. } | ParallelNumerator { .. } => dynamics != DynamicsFreedom::Nothing,
            Observer { .. } => dynamics != DynamicsFreedom::Nothing && point.dynamics.outputs() > 1,
            // a held DC gain sets one element of the column, else the whole column is held
            Feedthrough { input, output } => {
                let held = point.dynamics.held[input];
                dynamics != DynamicsFreedom::Nothing && held.is_some_and(|held| held.0 != output)
            }
            Effect { place } => point.effects[place].place().parallel_sections().is_none(),
            Plays { experiment, .. } => {
                derivatives.starts && point.pasts[experiment].plays.is_some()
            }
            Gaps { experiment } => {
                let is_free = freedom.states && point.pasts[experiment].has_unknown_state;
                is_free && !point.gapped().is_empty()
            }
            State { experiment } => freedom.states && point.pasts[experiment].has_unknown_state,
        }
    }

    /// Those of its unknowns, counted from the first one's place, that are coefficients `.. + p z + q` of a section of two poles. In the
    /// observer form of the sections, so are what is driven of their states, and initial states.
    pub(super) fn pairs(self, point: &Point, first: usize) -> Vec<[usize; 2]> {
        let of_g = || point.dynamics.sections.iter().map(Section::order);
        match self {
            Denominator { section } => paired([point.dynamics.sections[section].order()], first),
            Numerator { section } => {
                let section = &point.dynamics.sections[section];
                paired(section.b.column_iter().map(|_| section.order()), first)
            }
            ParallelDenominator { place, section } | ParallelNumerator { place, section } => {
                paired([sections(point, place)[section].0.len()], first)
            }
            Effect { place } => {
                let closed = point.effects[place].place().closed_loops();
                let loops = closed.map_or(&[][..], |closed| closed.loops());
                let mut first = first;
                let mut pairs = Vec::new();
                for inner in loops {
                    if let Drives::States(column) = &inner.drives {
                        let is_driven = |pair: &[usize; 2]| pair[1] < first + column.len();
                        pairs.extend(paired(of_g(), first).into_iter().filter(is_driven));
                    }
                    first += inner.linear_values() + inner.law.values();
                }
                pairs
            }
            State { .. } => paired(point.sections().iter().map(Section::order), first),
            _ => Vec::new(),
        }
    }

    /// The experiment whose output alone the group moves.
    pub(super) fn experiment(self) -> Option<usize> {
        match self {
            Offsets { experiment }
            | Plays { experiment, .. }
            | Gaps { experiment }
            | State { experiment } => Some(experiment),
            _ => None,
        }
    }

    /// Whether the output of an experiment depends on the group.
    pub(super) fn is_of(self, experiment: usize) -> bool {
        self.experiment().is_none_or(|own| own == experiment)
    }

    /// The values of the group in a point.
    pub(crate) fn read(self, point: &Point) -> Vec<f64> {
        match self {
            Weights { input } => point.channels[input].weights.clone(),
            Slopes { input } => point.channels[input].slopes.clone(),
            Thresholds { input } => point.channels[input].thresholds.clone(),
            HalfWidths { input } => point.channels[input].half_widths.clone(),
            Denominator { section } => point.dynamics.sections[section].a.clone(),
            Numerator { section } => point.dynamics.sections[section].b.as_slice().to_vec(),
            Observer { section } => point.dynamics.sections[section].c.as_slice().to_vec(),
            ParallelDenominator { place, section } => sections(point, place).swap_remove(section).0,
            ParallelNumerator { place, section } => sections(point, place).swap_remove(section).1,
            Feedthrough { input, output } => vec![point.dynamics.d[(output, input)]],
            Effect { place } => point.effects[place].values(),
            Offsets { experiment } => point.offsets[experiment].as_slice().to_vec(),
            Plays { experiment, input } => {
                let plays = point.pasts[experiment].plays.as_ref();
                plays.map_or_else(Vec::new, |plays| plays[input].clone())
            }
            Gaps { experiment } => {
                let gaps = &point.pasts[experiment].gaps;
                point.gapped().into_iter().map(|output| gaps[output]).collect()
            }
            State { experiment } => point.pasts[experiment].state.as_slice().to_vec(),
        }
    }

    /// Adds a change of the group's values to a point. Weights keep the sign of their elements; a section whose poles
    /// would leave the unit circle goes as far as they stay inside.
    pub(super) fn add(self, point: &mut Point, change: &[f64]) {
        let add = |values: &mut [f64]| {
            values.iter_mut().zip(change).for_each(|(value, change)| *value += change);
        };
        match self {
            Weights { input } => {
                let Parameters { weights, elements, .. } = &mut point.channels[input];
                add(weights);
                for (place, weight) in weights.iter_mut().enumerate() {
                    *weight = elements.nearest(place, *weight);
                }
            }
            Slopes { input } => add(&mut point.channels[input].slopes),
            Thresholds { input } => add(&mut point.channels[input].thresholds),
            HalfWidths { input } => add(&mut point.channels[input].half_widths),
            Denominator { section } => move_poles(&mut point.dynamics.sections[section].a, change),
            Numerator { section } => add(point.dynamics.sections[section].b.as_mut_slice()),
            Observer { section } => add(point.dynamics.sections[section].c.as_mut_slice()),
            ParallelDenominator { place, section } => {
                point.change_sections(place, |all| move_poles(&mut all[section].0, change));
            }
            ParallelNumerator { place, section } => {
                point.change_sections(place, |all| add(&mut all[section].1));
            }
            Feedthrough { input, output } => point.dynamics.d[(output, input)] += change[0],
            Effect { place } => {
                let mut values = self.read(point);
                add(&mut values);
                point.effects[place].set(&values);
            }
            Offsets { experiment } => add(point.offsets[experiment].as_mut_slice()),
            Plays { experiment, input } => {
                let plays = point.pasts[experiment].plays.as_mut();
                plays.into_iter().for_each(|plays| add(&mut plays[input]));
            }
            Gaps { experiment } => {
                for (output, change) in point.gapped().into_iter().zip(change) {
                    point.pasts[experiment].gaps[output] += change;
                }
            }
            State { experiment } => add(point.pasts[experiment].state.as_mut_slice()),
        }
    }

    /// Whether G depends on the group, so that its held DC gain has to be restored after a step.
    pub(super) fn is_dynamics(self) -> bool {
        matches!(self, Denominator { .. } | Numerator { .. } | Observer { .. } | Feedthrough { .. })
    }
}
