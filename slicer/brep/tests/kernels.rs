//! The kernels that tests use besides LAMP's own: none. The tests of lamp-brep-occt are the same
//! files, with OpenCASCADE here.

use lamp_brep::ReadFn;

pub(crate) const OTHERS: &[(&str, ReadFn)] = &[];
