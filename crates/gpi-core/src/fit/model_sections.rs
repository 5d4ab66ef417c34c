//! The dynamics of a model as sections, with the loops around them in the same coordinates.
//!
//! A loop adds `e_l f(s_l x)` to the next state of G. With E (order, loops) the vectors e_l and S (loops, order) the rows
//! s_l, the system `(A, [B E], [C; S], D)` has the loops as further inputs and outputs; its sections in parallel contain E
//! and S in the new coordinates.

use crate::effects::{ClosedLoops, Drives, Effect, InnerLoop, PlaceMut, Sees};
use crate::linear::{Sections, StateSpace};
use crate::{Error, Matrix, Model};

/// G, and the model's effects whose loops drive and see the states of the sections.
pub(crate) fn sections_of(model: &Model) -> Result<(Sections, Vec<Effect>), Error> {
    let mut effects = model.effects().to_vec();
    let closed = model.effects().iter().filter_map(|effect| effect.place().closed_loops());
    let loops: Vec<&InnerLoop> = closed.flat_map(ClosedLoops::loops).collect();
    if loops.is_empty() {
        return Ok((Sections::from_delayed_state_space(model.linear())?, effects));
    }
    let (own, delay) = model.linear().behind_dead_time();
    let (order, inputs, outputs) = (own.order(), own.inputs(), own.outputs());
    let mut e = Matrix::zeros(order, loops.len());
    let mut s = Matrix::zeros(loops.len(), order);
    for (number, inner) in loops.iter().enumerate() {
        let first = order - inner.drives.states();
        if let Drives::States(column) = &inner.drives {
            e.column_mut(number).rows_mut(first, column.len()).copy_from_slice(column);
        }
        if let Sees::Mixture { states, .. } = &inner.sees {
            let row = nalgebra::RowDVector::from_row_slice(states);
            s.row_mut(number).columns_mut(first, states.len()).copy_from(&row);
        }
    }
    let mut b = own.b().clone().resize_horizontally(inputs + loops.len(), 0.0);
    b.columns_mut(inputs, loops.len()).copy_from(&e);
    let mut c = own.c().clone().resize_vertically(outputs + loops.len(), 0.0);
    c.rows_mut(outputs, loops.len()).copy_from(&s);
    let d = own.d().clone().resize(outputs + loops.len(), inputs + loops.len(), 0.0);
    let around = StateSpace::new(own.a().clone(), b, c, d)?;
    let (sections, e, s) = Sections::with_loops(&around, delay, (inputs, outputs))?;
    let mut number = 0;
    for effect in &mut effects {
        let PlaceMut::Loops(closed) = effect.place_mut() else { continue };
        for inner in closed.loops_mut() {
            // a force enters where the input does, in any coordinates
            match &mut inner.drives {
                Drives::States(column) => *column = e.column(number).iter().copied().collect(),
                Drives::Input { states, .. } => *states = order,
            }
            if let Sees::Mixture { states, .. } = &mut inner.sees {
                *states = s.row(number).iter().copied().collect();
            }
            number += 1;
        }
    }
    Ok((sections, effects))
}
