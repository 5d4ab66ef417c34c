//! What an effect states of itself, so that the search needs no effect's name.

/// How surely a residual tells the effect from a model that merely fits badly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signature {
    /// A bad fit of the declared model leaves nothing like it: a line of the spectrum, another measured column.
    Unique,
    /// A slow function of time with any number of knots. It can follow much that the input drives, so the search
    /// asks whether it is slow, and prefers what the input drives where that explains as much.
    SlowInTime,
    /// Where the input repeats one cycle, the effect takes the shape of whatever that cycle lacks. The search does
    /// not try it there.
    ShapeOfCycle,
    /// A bad fit of the declared model leaves a little of it too.
    Shared,
}

/// How the effect relates to linear dynamics G whose order the search may choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeOrder {
    /// G of any order contains it: it is an effect only where the order of G is given.
    Contained,
    /// It becomes a part of G as soon as it is found, unless the order of G is given.
    JoinsG,
    /// Slow poles of G may have taken its place before it was tried.
    HidesInSlowPoles,
    /// None.
    Independent,
}

/// The experiment that separates an effect from those that look like it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeparatedBy {
    /// An input that rests for minutes, also after large steps.
    Rests,
    /// Slow triangles of several sizes around several levels.
    Levels,
    /// The same triangle at several speeds.
    Speeds,
    /// None is needed: no other effect of the catalogue looks like it.
    Nothing,
}
