//! Numerical methods that are independent of light: descent between bounds, equations of small
//! matrices, and random numbers.
//!
//! Each adds numbers in one order, whatever the number of threads, so that plans are the same to
//! the last bit.

mod bounded;
mod cholesky;
mod lbfgs;
mod random;

pub(crate) use bounded::{Bounded, CurvatureMatrix, SearchPlace};
pub(crate) use cholesky::solve_positive;
pub(crate) use lbfgs::{DescentEnd, descend};
pub(crate) use random::Random;

/// Half of the 95 % interval of a normal distribution, in standard deviations (NIST/SEMATECH e-Handbook
/// of Statistical Methods, section 1.3.6.7.1).
pub(crate) const OF_95_PERCENT: f64 = 1.96;

/// Returns the sum of products, from the first to the last.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Adds a multiple of some numbers to others.
pub(crate) fn add_times(to: &mut [f64], times: f64, what: &[f64]) {
    to.iter_mut().zip(what).for_each(|(to, what)| *to += times * what);
}
