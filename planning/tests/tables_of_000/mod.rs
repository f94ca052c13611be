//! Column cure against 000 and against other methods for the same results: light ray by ray, times
//! by the interior-point method of `clarabel`, clusters by trying all, and the tables of 000.

mod clusters;
mod light;
mod tables;
mod times;
mod zhao;
