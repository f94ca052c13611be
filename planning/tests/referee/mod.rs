//! The search for the best light against a referee: problems written down as dense linear
//! programs from the definitions, solved by the simplex method of `microlp`.

mod appendix_a;
mod case;
mod random;
