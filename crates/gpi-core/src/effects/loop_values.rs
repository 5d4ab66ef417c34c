//! The values of loops around G: what is estimated, in which limits, and what it is called.
//!
//! The values of a loop are its column of E, its rows of S and T, and those of its law: the logarithms of the half-widths
//! of stops and their weights, beta, gamma and the exponent, the logarithm of a break-away distance or of the scale of a damping, or a limit. The product of E, the scale of the signal and the scale of w is what the
//! output shows; therefore the largest element of S and T, or the widest half-width and the last weight of stops, are held.

use super::{Block, ClosedLoops, Drives, InnerLoop, Law, Quantity, Sees, SteadyForce, Units};

impl<T: ClosedLoops> Block for T {
    fn values(&self) -> Vec<f64> {
        values(self.loops())
    }

    fn set(&mut self, values: &[f64]) {
        set(self.loops_mut(), values);
    }

    fn steps(&self) -> Vec<f64> {
        vec![1e-6; self.values().len()]
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        bounds(self.loops())
    }

    fn quantities(&self, units: Units) -> Vec<Quantity> {
        quantities(self.loops(), units)
    }

    /// Without beta, Bouc and Wen's force depends on the displacement alone.
    fn is_possible(&self) -> bool {
        let mut laws = self.loops().iter().map(|inner| &inner.law);
        laws.all(|law| !matches!(law, Law::BoucWen { beta, .. } if *beta <= 0.0))
    }
}

/// Values of a loop that have the same form.
enum Group<'a> {
    /// The numbers themselves.
    Plain(&'a mut [f64]),
    /// The logarithms of positive numbers.
    Logarithms(&'a mut [f64]),
}

/// The values of a loop, in order.
fn groups(inner: &mut InnerLoop) -> Vec<Group<'_>> {
    let mut groups = vec![Group::Plain(match &mut inner.drives {
        Drives::States(column) => column,
        Drives::Input { force, .. } => std::slice::from_mut(force),
    })];
    if let Sees::Mixture { states, inputs } = &mut inner.sees {
        groups.extend([Group::Plain(states), Group::Plain(inputs)]);
    }
    match &mut inner.law {
        Law::Power { .. } | Law::Speed => {}
        Law::Dahl { distance: scale, .. } | Law::Damping { scale } => {
            groups.push(Group::Logarithms(std::slice::from_mut(scale)));
        }
        Law::Excess { limit, .. } => groups.push(Group::Plain(std::slice::from_mut(limit))),
        Law::Stops { half_widths, weights } => {
            groups.extend([Group::Logarithms(half_widths), Group::Plain(weights)]);
        }
        Law::BoucWen { beta, gamma, exponent } => {
            let all = [beta, gamma, exponent];
            groups.extend(all.map(|own| Group::Plain(std::slice::from_mut(own))));
        }
    }
    groups
}

/// The values of all loops, in order.
fn values(loops: &[InnerLoop]) -> Vec<f64> {
    let mut values = Vec::new();
    for inner in &mut loops.to_vec() {
        for group in groups(inner) {
            match group {
                Group::Plain(own) => values.extend(own.iter().copied()),
                Group::Logarithms(own) => values.extend(own.iter().map(|value| value.ln())),
            }
        }
    }
    values
}

/// Takes other values, as many as [`values`] returns.
fn set(loops: &mut [InnerLoop], values: &[f64]) {
    let mut rest = values.iter().copied();
    for group in loops.iter_mut().flat_map(groups) {
        match group {
            Group::Plain(own) => {
                own.iter_mut().zip(&mut rest).for_each(|(own, new)| *own = new);
            }
            Group::Logarithms(own) => {
                own.iter_mut().zip(&mut rest).for_each(|(own, new)| *own = new.exp());
            }
        }
    }
}

/// Smallest and largest sensible value of each.
fn bounds(loops: &[InnerLoop]) -> Vec<(f64, f64)> {
    let free = |count: usize| vec![(f64::NEG_INFINITY, f64::INFINITY); count];
    let mut bounds = Vec::new();
    for inner in loops {
        bounds.extend(free(match &inner.drives {
            Drives::States(column) => column.len(),
            Drives::Input { .. } => 1,
        }));
        if let Sees::Mixture { states, inputs } = &inner.sees {
            let seen = || states.iter().chain(inputs);
            if inner.law.limits() {
                // what a pole of G holds, and nothing else
                bounds.extend(seen().map(|value| (*value, *value)));
            } else {
                bounds.extend(free(states.len() + inputs.len()));
            }
            let largest =
                seen().copied().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let is_held = !matches!(&inner.law, Law::Stops { .. } | Law::Excess { .. });
            // the scale of z is in the drives as well, and in beta and gamma
            if let Some((place, value)) = largest.filter(|_| is_held) {
                let first = bounds.len() - seen().count();
                bounds[first + place] = (value, value);
            }
        }
        if let Law::BoucWen { .. } = &inner.law {
            /// Largest exponent: beyond, the force is that of a stop.
            const SHARPEST: f64 = 4.0;
            bounds.extend([(0.0, f64::INFINITY), (f64::NEG_INFINITY, f64::INFINITY)]);
            bounds.push((1.0, SHARPEST));
        }
        if let Law::Dahl { distance: scale, .. } | Law::Damping { scale } = &inner.law {
            /// The largest step of the logarithm of the break-away distance. By hand: with longer steps it becomes shorter than the motion
            /// within a sample before the other values have followed, and then it hardly changes the output. The same holds for the
            /// scale of a damping.
            const STEP: f64 = 0.5;
            bounds.push((scale.ln() - STEP, scale.ln() + STEP));
        }
        if inner.law.limits() {
            bounds.extend(free(1));
        }
        if let Law::Stops { half_widths, weights } = &inner.law {
            /// Largest distance of a half-width from the widest one, in logarithms: a factor of a thousand.
            const REACH: f64 = 6.9;
            /// The largest step of a logarithm or a weight.
            const STEP: f64 = 0.7;
            let near = |value: f64| (value - STEP, value + STEP);
            // the widest stop sets the scales of z and of w
            let held = |last: Option<f64>| last.map(|value| (value, value));
            let widest = half_widths.last().map(|r| r.ln());
            let others = half_widths.len().saturating_sub(1);
            let width = |r: &f64| {
                let (low, high) = near(r.ln());
                let scale = widest.unwrap_or(0.0);
                (low.max(scale - REACH), high.min(scale + REACH))
            };
            bounds.extend(half_widths.iter().take(others).map(width));
            bounds.extend(held(widest));
            bounds.extend(weights.iter().take(others).map(|weight| near(*weight)));
            bounds.extend(held(weights.last().copied()));
        }
    }
    bounds
}

/// The numbers that describe the loops.
fn quantities(loops: &[InnerLoop], units: Units) -> Vec<Quantity> {
    let mut found = Vec::new();
    for (q, inner) in loops.iter().enumerate() {
        let mut list = |what: &str, values: &[f64], zero_is_absence: bool| {
            let named = values.iter().enumerate();
            let quantity = |(i, &value)| {
                let name = format!("{what}[{q}][{i}]");
                Quantity { zero_is_absence, ..Quantity::new(name, "", value) }
            };
            found.extend(named.map(quantity));
        };
        // a force is printed as what it is in steady state
        if let Drives::States(column) = &inner.drives {
            list("drive", column, true);
        }
        if let Sees::Mixture { states, inputs } = &inner.sees {
            list("seen_state", states, false);
            list("seen_input", inputs, false);
        }
        if let Law::Stops { half_widths, weights } = &inner.law {
            list("half_width", half_widths, false);
            list("weight", weights, true);
        }
        if let Law::Dahl { distance, .. } = &inner.law {
            found.push(Quantity::new("break_away_distance", units.output, *distance));
        }
        if let Law::Damping { scale } = &inner.law {
            found.push(Quantity::new(format!("damping_scale[{q}]"), units.output, *scale));
        }
        if let Law::Excess { limit, .. } = &inner.law {
            // that of an output is printed as what the output shows
            if !matches!(inner.sees, Sees::Output(_)) {
                found.push(Quantity::new(format!("limit[{q}]"), "", *limit));
            }
        }
        if let Law::BoucWen { beta, gamma, exponent } = &inner.law {
            // z is a displacement
            let unit = match units.output {
                "" => String::new(),
                unit => format!("1/{unit}^n"),
            };
            found.push(Quantity::strength(format!("beta[{q}]"), unit.clone(), *beta));
            found.push(Quantity::strength(format!("gamma[{q}]"), unit, *gamma));
            found.push(Quantity::new(format!("exponent[{q}]"), "", *exponent));
        }
    }
    found
}

/// The forces of the loops in steady state, relative to the stiffness of the linear mechanics.
///
/// A power n of the displacement z adds `k_n z^n` to the linear force `k_1 z`; `kn_over_k1` is their ratio. The force of Bouc
/// and Wen is `k_h w` with `w = z` for small motion; `hysteretic_over_linear` is `k_h / k_1`.
///
/// A limit of the displacement is printed as the output at it.
///
/// Friction is printed as the part of the input that it takes away, together with the mass, damping and stiffness of the mechanics:
/// of -u where a positive input moves the mass backwards.
pub(super) fn in_steady_state(
    loops: &[InnerLoop],
    units: Units,
    forces: &dyn Fn(&InnerLoop) -> Option<SteadyForce>,
) -> Vec<Quantity> {
    let of = |(q, inner): (usize, &InnerLoop)| {
        let steady = forces(inner)?;
        let SteadyForce { over_stiffness: force, of_input, period, mechanics, offset } = steady;
        let of_input = direction(mechanics) * of_input;
        let (name, unit, value) = match &inner.law {
            Law::Power { exponent, scale } => {
                let unit = match (units.output, exponent - 1) {
                    ("", _) => String::new(),
                    (unit, 1) => format!("1/{unit}"),
                    (unit, power) => format!("1/{unit}^{power}"),
                };
                let value = force * scale.powi(1 - exponent);
                (format!("k{exponent}_over_k1"), unit, value)
            }
            Law::Stops { weights, .. } => {
                let value = force * weights.iter().sum::<f64>();
                (format!("hysteretic_over_linear[{q}]"), String::new(), value)
            }
            Law::BoucWen { .. } => (format!("hysteretic_over_linear[{q}]"), String::new(), force),
            Law::Dahl { .. } => ("friction_force".to_owned(), units.input.to_owned(), of_input),
            // w is the speed times the period for slow motion, and k / c of the mode turns it into a part of its damping
            Law::Damping { .. } => {
                let [_, damping, stiffness] = mechanics?;
                let name = "nonlinear_over_linear_damping".to_owned();
                (name, String::new(), force * period * stiffness / damping)
            }
            Law::Excess { limit, .. } => {
                let name = format!("limit[{q}]");
                return Some(Quantity::new(name, units.output, offset + limit));
            }
            // |dz| is the speed times the period
            Law::Speed => {
                let unit = per_derivative(units, " s");
                ("asymmetry".to_owned(), unit, period * of_input)
            }
        };
        Some(Quantity::strength(name, unit, value))
    };
    let mut found: Vec<Quantity> = loops.iter().enumerate().filter_map(of).collect();
    let rubs = |inner: &&InnerLoop| matches!(inner.law, Law::Dahl { .. });
    let rubbing = loops.iter().find(rubs).and_then(forces);
    if let Some(mechanics) = rubbing.and_then(|force| force.mechanics) {
        let [mass, damping, stiffness] = mechanics.map(|own| direction(Some(mechanics)) * own);
        found.push(Quantity::new("mass", per_derivative(units, " s^2"), mass));
        found.push(Quantity::strength("damping", per_derivative(units, " s"), damping));
        found.push(Quantity::strength("spring_rate", per_derivative(units, ""), stiffness));
    }
    found
}

/// The sign of the acceleration that a positive input causes, where the mechanics are known: that of the mass.
fn direction(mechanics: Option<[f64; 3]>) -> f64 {
    mechanics.map_or(1.0, |[mass, ..]| mass.signum())
}

/// The unit of the input over that of a derivative of the output.
fn per_derivative(units: Units, seconds: &str) -> String {
    match (units.input, units.output) {
        ("", "") => seconds.trim().to_owned(),
        (input, "") => format!("{input}{seconds}"),
        ("", output) => format!("1{seconds}/{output}"),
        (input, output) => format!("{input}{seconds}/{output}"),
    }
}
