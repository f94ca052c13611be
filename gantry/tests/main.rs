//! Jobs and frames against the virtual machine and against closed forms.

mod doses;
mod limits;
mod scratch;
mod tilt;
