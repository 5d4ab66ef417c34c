//! G with its loops and the sections in parallel, sample by sample.

use crate::chain::point::Point;
use crate::effects::InnerLoop;
use crate::linear::{Section, advance};

/// The linear dynamics of a point in motion.
pub(crate) struct Motion<'a> {
    sections: Vec<Section>,
    /// Columns of B by inputs, of C by states, rows of D by outputs, one after the other.
    b: Vec<Vec<f64>>,
    c: Vec<f64>,
    d: Vec<f64>,
    loops: Vec<&'a InnerLoop>,
    /// Of all sections, one after the other.
    pub state: Vec<f64>,
    /// y, before the output stage.
    pub displacement: Vec<f64>,
    /// Of each loop: z, w, how changes pass its law, and where its plays stand.
    pub circulating: Vec<Circulating>,
    /// What drives each state.
    drive: Vec<f64>,
}

/// What goes around one loop.
pub(crate) struct Circulating {
    pub z: f64,
    pub w: f64,
    pub marks: Vec<f64>,
    pub places: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// At rest at zero.
    pub(crate) fn new(point: &'a Point) -> Self {
        let loops: Vec<&InnerLoop> = point.loops().collect();
        let rest = |inner: &&InnerLoop| Circulating {
            z: 0.0,
            w: 0.0,
            marks: vec![0.0; inner.law.marks()],
            places: vec![0.0; inner.law.stops()],
        };
        let sections = point.sections();
        let column = |input: usize| {
            let own = sections.iter().map(|section| section.b.column(input).into_owned());
            own.flat_map(|column| column.data.as_vec().clone()).collect()
        };
        Self {
            b: (0..point.dynamics.inputs()).map(column).collect(),
            c: sections.iter().flat_map(|section| section.c.as_slice()).copied().collect(),
            d: point.dynamics.d.transpose().as_slice().to_vec(),
            drive: vec![0.0; point.order()],
            circulating: loops.iter().map(rest).collect(),
            loops,
            state: vec![0.0; point.order()],
            displacement: vec![0.0; point.dynamics.outputs()],
            sections,
        }
    }

    /// Before the record v stood, and nothing went around the loops.
    pub(crate) fn stand(&mut self, v: &[f64]) {
        let v = nalgebra::DVector::from_column_slice(v);
        let standing = self.sections.iter().map(|section| section.standing(&section.b) * &v);
        self.state = standing.flat_map(|states| states.data.as_vec().clone()).collect();
    }

    /// Works out the displacement and what goes around the loops, at this sample's v.
    pub(crate) fn observe(&mut self, v: &[f64]) {
        for (y, d) in self.displacement.iter_mut().zip(self.d.chunks_exact(v.len())) {
            *y = d.iter().zip(v).map(|(d, v)| d * v).sum();
        }
        for (x, c) in self.state.iter().zip(self.c.chunks_exact(self.displacement.len())) {
            self.displacement.iter_mut().zip(c).for_each(|(y, c)| *y += c * x);
        }
        for (inner, around) in self.loops.iter().zip(&mut self.circulating) {
            let own = &self.state[..inner.drives.len()];
            around.z = inner.sees.signal(own, v, &self.displacement);
            around.w = inner.law.step(&mut around.places, around.z, &mut around.marks);
        }
    }

    /// Moves the state on by what was observed.
    pub(crate) fn advance(&mut self, v: &[f64]) {
        self.drive.fill(0.0);
        let inputs = self.b.iter().map(Vec::as_slice).zip(v.iter().copied());
        let around = self.circulating.iter().map(|around| around.w);
        let loops = self.loops.iter().map(|inner| inner.drives.as_slice()).zip(around);
        for (drives, value) in inputs.chain(loops) {
            let driven = self.drive.iter_mut().zip(drives);
            driven.for_each(|(sum, drive)| *sum += drive * value);
        }
        let mut first = 0;
        for section in &self.sections {
            let own = first..first + section.order();
            let drive = &self.drive[own.clone()];
            advance(&section.a, &mut self.state[own.clone()], |j| drive[j]);
            first = own.end;
        }
    }
}
