//! Unknowns in groups that fill the processor's vectors.
//!
//! The unknowns 8 t .. 8 t + 7 are tile t. Neighbours in the table belong to one group mostly, and therefore enter at
//! the same places and move the same states. A tile has work space for one sample, (places, 8), and keeps the changes
//! of the states, (N, 8), of the plays of stops and of the readings that are held, from block to block.
//!
//! A is block diagonal. Without loops, a change that enters at a state moves the states of its section alone; only a
//! change of v moves all sections. A tile whose unknowns are coefficients of sections thus runs through the range of
//! sections from the first to the last that is entered, and through no product with B. With loops, w couples all states
//! of G, and every tile runs through all sections. An unknown without injection, such as an offset, is in a tile only
//! if a neighbour has one; its lane stays zero and its derivatives are written by `Stream::added` afterwards.

use super::injections::{Injection, ONE, Places};
use super::lanes::{LANES, Lanes, NONE};
use crate::effects::InnerLoop;
use crate::linear::Section;
use std::ops::Range;

/// Some unknowns side by side, and their changes.
pub(super) struct Tile {
    pub first: usize,
    pub entries: Vec<Entry>,
    /// Lanes of unknowns that change an initial state, that state and its change.
    pub starts: Vec<(usize, usize, f64)>,
    /// Whether v changes.
    pub drives: bool,
    /// Sections and their states that change.
    pub sections: Range<usize>,
    pub states: Range<usize>,
    pub x: Vec<Lanes>,
    /// Changes that each effect of the output stage holds.
    pub held: Vec<Lanes>,
    /// Changes of the places of each loop's plays.
    pub plays: Vec<Lanes>,
    pub work: Vec<Lanes>,
    /// Of each output, by scored samples.
    pub rows: Vec<Vec<Lanes>>,
}

/// What unknowns side by side add at one place: a factor times a signal each.
///
/// All of them are added at once. Added one after the other, each would wait until the one before has reached the memory.
pub(super) struct Entry {
    pub place: usize,
    pub signals: [usize; LANES],
    pub factors: Lanes,
}

/// The injections of a tile, whose first unknown is `first`, side by side.
fn entries(injections: &[Injection], first: usize) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for one in injections {
        let lane = one.unknown - first;
        let is_open = |entry: &&mut Entry| entry.place == one.place && entry.factors[lane] == 0.0;
        if let Some(entry) = entries.iter_mut().find(is_open) {
            entry.signals[lane] = one.signal;
            entry.factors[lane] = one.factor;
            continue;
        }
        let mut entry = Entry { place: one.place, signals: [ONE; LANES], factors: NONE };
        entry.signals[lane] = one.signal;
        entry.factors[lane] = one.factor;
        entries.push(entry);
    }
    entries
}

/// What the tiles of an experiment have in common.
pub(super) struct Shape<'a> {
    pub places: &'a Places,
    pub sections: &'a [Section],
    pub loops: &'a [&'a InnerLoop],
    /// Effects of the output stage.
    pub sensed: usize,
}

/// The tiles of so many unknowns that have an injection, or change an initial state as `starts` says.
pub(super) fn tiles(
    shape: &Shape,
    injections: Vec<Injection>,
    starts: &[(usize, usize, f64)],
    unknowns: usize,
) -> Vec<Tile> {
    let Shape { places, sections, loops, sensed } = shape;
    let mut all = injections.into_iter().peekable();
    let tile = |first: usize| {
        let own = first..unknowns.min(first + LANES);
        let injections: Vec<Injection> =
            std::iter::from_fn(|| all.next_if(|one| own.contains(&one.unknown))).collect();
        let starts: Vec<(usize, usize, f64)> = starts
            .iter()
            .filter(|(unknown, ..)| own.contains(unknown))
            .map(|&(unknown, state, change)| (unknown - first, state, change))
            .collect();
        let drives = injections.iter().any(|one| places.v.contains(&one.place));
        // without a loop a section moves nothing but itself
        let everything = drives || !loops.is_empty();
        let entered = injections.iter().filter(|one| places.states.contains(&one.place));
        let entered = entered.map(|one| one.place - places.states.start);
        let moved: Vec<usize> = entered.chain(starts.iter().map(|(_, state, _)| *state)).collect();
        let (sections, states) = moving(sections, &moved, everything);
        Tile {
            first,
            entries: entries(&injections, first),
            starts,
            drives,
            sections,
            states,
            x: vec![NONE; places.states.len()],
            held: vec![NONE; *sensed],
            plays: vec![NONE; loops.iter().map(|inner| inner.law.memories()).sum()],
            work: vec![NONE; places.len],
            rows: vec![Vec::new(); places.y.len()],
        }
    };
    let is_active = |tile: &Tile| !tile.entries.is_empty() || !tile.starts.is_empty();
    (0..unknowns).step_by(LANES).map(tile).filter(is_active).collect()
}

/// The range of sections that holds the states `moved`, or all, and the range of its states.
fn moving(sections: &[Section], moved: &[usize], all: bool) -> (Range<usize>, Range<usize>) {
    let mut found: Option<(Range<usize>, Range<usize>)> = None;
    let mut first = 0;
    for (place, section) in sections.iter().enumerate() {
        let own = first..first + section.order();
        if all || moved.iter().any(|state| own.contains(state)) {
            found = Some(match found {
                Some((sections, states)) => (sections.start..place + 1, states.start..own.end),
                None => (place..place + 1, own.clone()),
            });
        }
        first = own.end;
    }
    found.unwrap_or((0..0, 0..0))
}
