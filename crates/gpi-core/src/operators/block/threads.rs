//! Plays over a long record on several threads, each with one segment of time.

use super::bank;
use super::lanes::settled;
use super::ranked::Ranked;
use crate::parallel::install;
use rayon::prelude::*;

/// The outputs of a bank of plays, as [`bank::run`].
///
/// The state at the start of each segment follows from the segment before if z varies there by the width of the widest
/// gap ([`settled`]). If it varies less in some segment, one thread computes everything.
pub(crate) fn run(
    (half_widths, weights): (&[f64], &[f64]),
    places: &mut [f64],
    input: &[f64],
    output: &mut [f64],
    threads: usize,
) {
    let ranked = Ranked::new(half_widths, weights);
    let stretch = input.len().div_ceil(threads.max(1)).max(1);
    let is_finite =
        install(|| input.par_chunks(1 << 16).all(|part| part.iter().all(|z| z.is_finite())));
    let began = |begin| if is_finite { settled(&ranked, &input[..begin], stretch) } else { None };
    let begins = (stretch..input.len()).step_by(stretch).map(began);
    let states: Option<Vec<_>> = std::iter::once(Some(places.to_vec())).chain(begins).collect();
    let Some(mut states) = states else {
        return bank::run((half_widths, weights), places, Some(input), output);
    };
    let parts = input.par_chunks(stretch).zip(output.par_chunks_mut(stretch)).zip(&mut states);
    install(|| {
        parts.for_each(|((input, output), places)| {
            bank::run((half_widths, weights), places, Some(input), output);
        });
    });
    if let Some(last) = states.last() {
        places.copy_from_slice(last);
    }
}
