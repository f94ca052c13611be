//! Finds the light of each pixel of a few layers that costs least, with a bound on the best cost.

mod operator;
mod problem;
mod search;

pub use operator::Operator;
pub use problem::{Problem, Role, Shape, Terms};
pub use search::{Search, SearchProgress, Solution, solve};
