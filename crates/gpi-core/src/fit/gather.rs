//! Rows of derivatives, gathered while they are streamed.
//!
//! Streaming K samples costs about K p N operations for p unknowns and N states; summing `psi psi'` costs K p^2. Both
//! run at the same time on two threads, where the experiment is long enough to pay for a thread. The channel between them
//! holds four blocks, which bounds the memory when the sums are slower.

use crate::Error;
use crate::chain::stream::{Rows, Stream};
use std::sync::mpsc::sync_channel;

/// Streams an experiment on this thread and gathers its blocks of rows on another one, or on the same where it is short.
pub(crate) fn gather(
    mut stream: Stream,
    check: &mut dyn FnMut() -> Result<(), Error>,
    mut add: impl FnMut(Rows) + Send,
) -> Result<(), Error> {
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
