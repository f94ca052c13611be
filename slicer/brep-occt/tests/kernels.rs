//! The kernels that tests use besides LAMP's own.

use lamp_brep::ReadFn;

pub(crate) const OTHERS: &[(&str, ReadFn)] = &[("occt", lamp_brep_occt::read)];
