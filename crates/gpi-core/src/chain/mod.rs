//! The differentiable signal chain, as the signal flows:
//!
//! ```text
//! u -> input stage -> envelope -> plays -> dynamics -> (+) -> output stage -> (+) -> y
//! ```
//!
//! Each place has one forward definition, which users' [`Model`](crate::Model) and the estimator's
//! [`Point`](point::Point) share: [`stages`] before and after, [`plays`], [`loops`] around the dynamics, and what they see
//! [`between`] two samples. The linear part is the one block that differs: a state space in a model ([`circulate`] where it has
//! loops), [`motion`] in sections for a point.
//!
//! For derivatives, let theta be an unknown. It enters the chain at a few places p, where it adds `f_p s_p(k)` per
//! unit, s_p a signal of the chain ([`injections`]). From there changes run through everything linear behind it:
//!
//! ```text
//! tangent:  dy(k)/dtheta = sum_p sum_(l <= k) h_p(k, l) f_p s_p(l)
//! adjoint:  dJ/dtheta = sum_p f_p sum_l s_p(l) sum_(k >= l) h_p(k, l) dJ/dy(k)
//! ```
//!
//! with the impulse responses h_p of the chain linearized along its motion: whether a play slides, the slopes of loops
//! and of the output stage. [`tangents`] carries the changes of eight unknowns forward side by side; [`adjoint`]
//! carries the cost's sensitivities backward, at the price of one more simulation whatever the number of unknowns (A.
//! Griewank and A. Walther, *Evaluating Derivatives*, 2008). The tangent and the adjoint of a place stand beside its
//! value. [`forward`] records what both need, and [`stream`] drives all three through an experiment, block by block.
//!
//! The unknowns are the rows of one [`table`] of [groups](group), from which values, steps, [`bounds`], [`names`] and injections follow.
//!
//! # Symbols
//!
//! The files of this folder use the same letters; sizes are those of one sample.
//!
//! | symbol | size | meaning |
//! |---|---|---|
//! | u, z | inputs | the drive that reaches the hysteresis, and the output of the envelope |
//! | F_i, r_i, p_i | plays | value, half-width and weight of play i of an input |
//! | g_j, eta_j | deadzones | slope and threshold of deadzone j of an input |
//! | v | inputs | the output of the hysteresis, which drives the dynamics |
//! | x | N | the states of all sections, those of G first |
//! | w | loops | what each loop feeds back to the states of G; its input is also called z |
//! | y | outputs | the displacement; behind the output stage, the reading |
//! | theta | [`Table::len`](table::Table) | all unknowns |
//!
//! # What is exact
//!
//! All derivatives are those of the discrete-time recursions themselves, not of a continuous model. They are exact up
//! to rounding where no play, stop or deadzone changes its branch, and one-sided derivatives at the samples where one
//! does; the output is continuous there. The following are approximations or omissions.
//!
//! - Derivatives by the values of effects that neither read the plays through curves, nor are sections, nor are loops
//!   are differences ([`effect_columns`]).
//! - Derivatives of what loops see and drive by the unknowns of G and of the loops are differences of coefficients
//!   ([`around_loops`]).
//! - [`Stream::with_memory`](stream::Stream::with_memory) leaves out what has decayed.
//! - What a backlash holds before it first slides is taken as independent of the unknowns ([`sensing`]).

pub(crate) mod adjoint;
mod around_loops;
pub(crate) mod between;
mod bouc_wen;
pub(crate) mod bounds;
mod circulate;
mod dahl;
mod effect_columns;
mod forward;
pub(crate) mod free_run;
pub(crate) mod group;
pub(crate) mod hysteresis;
pub(crate) mod injections;
mod jet;
mod lanes;
#[cfg(test)]
pub(crate) mod looped;
#[cfg(test)]
pub(crate) mod plain;

mod loops;
mod memories;
mod model;
mod motion;
mod movement;
mod names;
mod numbers;
mod placement;
mod plays;
pub(crate) mod point;
pub(crate) mod prior;
mod sensing;
pub(crate) mod sensitivity;
mod stages;
pub(crate) mod stream;
pub(crate) mod table;
pub(crate) mod tangents;
mod tiles;
mod turning_point;
