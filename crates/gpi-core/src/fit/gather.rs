//! Rows of derivatives, gathered while they are streamed, and without what the past of the noise predicts of them.
//!
//! Streaming K samples costs about K p N operations for p unknowns and N states; summing `psi psi'` costs K p^2. Both
//! run at the same time on two threads, where the experiment is long enough to pay for a thread. The channel between them
//! holds four blocks, which bounds the memory when the sums are slower.

use crate::chain::stream::{Rows, Stream};
use crate::optimize::{Loss, Whitening};
use crate::{Error, Experiment, Matrix};
use std::sync::mpsc::sync_channel;

/// Streams an experiment on this thread and gathers its blocks of rows on another one, or on the same where it is short.
pub(crate) fn gather(
    mut stream: Stream,
    loss: &Loss,
    check: &mut dyn FnMut() -> Result<(), Error>,
    mut add: impl FnMut(Rows) + Send,
) -> Result<(), Error> {
    let mut filters = Vec::new();
    let mut add = move |mut rows: Rows| {
        whiten_rows(&mut filters, &mut rows, loss);
        add(rows);
    };
    if stream.is_short() {
        return stream.run(&mut |rows| {
            check()?;
            add(rows);
            Ok(())
        });
    }
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel::<Rows>(4);
        let gathering = scope.spawn(move || receive.iter().for_each(&mut add));
        let streamed = stream.run(&mut |rows| {
            check()?;
            // only a panic ends the other thread early, and joining it tells
            let _ = send.send(rows);
            Ok(())
        });
        drop(send);
        gathering.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        streamed
    })
}

/// Filters of an output's regressors and residual.
type Filters<'a> = (Whitening<'a>, Whitening<'a>);

/// Takes what the past predicts from the next rows of an experiment.
fn whiten_rows<'a>(filters: &mut Vec<Filters<'a>>, rows: &mut Rows, loss: &'a Loss) {
    if loss.is_white() {
        return;
    }
    let Rows { regressors, residuals, begins } = rows;
    for (output, regressor) in regressors.iter_mut().enumerate() {
        let noise = &loss.noise[output];
        if filters.len() <= output {
            filters.push((Whitening::new(noise, regressor.nrows()), Whitening::new(noise, 1)));
        }
        let (of_regressor, of_residual) = &mut filters[output];
        of_regressor.apply(regressor, begins);
        let mut residual = residuals.rows(output, 1).into_owned();
        of_residual.apply(&mut residual, begins);
        residuals.set_row(output, &residual.row(0));
    }
}

/// The scored samples of a signal (samples, outputs) of an experiment, without what the past predicts of them; elsewhere
/// as it was.
pub(crate) fn whitened(mut signal: Matrix, experiment: &Experiment, loss: &Loss) -> Matrix {
    for (mut column, noise) in signal.column_iter_mut().zip(&loss.noise) {
        for run in experiment.scored_runs() {
            noise.whiten(&mut column.as_mut_slice()[run]);
        }
    }
    signal
}
