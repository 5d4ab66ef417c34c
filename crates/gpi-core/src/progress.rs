//! How long work tells what it does, and is stopped.

use crate::Error;

/// Called with the name of the present phase and the fraction of it that is done (0 to 1). A return value of
/// `false` asks to stop; the work then ends with [`Error::Interrupted`].
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64) -> bool;

/// Reports progress.
///
/// # Errors
/// [`Error::Interrupted`] when the caller asked to stop.
pub(crate) fn report(progress: Progress, phase: &str, done: f64) -> Result<(), Error> {
    if progress(phase, done) { Ok(()) } else { Err(Error::Interrupted) }
}
