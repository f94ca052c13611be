//! Nights that are ended in every way, with the real `lamp`: whatever happens, the same command again
//! gives the same files, does no finished task twice, and leaves nothing lying about.
//!
//! `LAMP_KILLS=1000 LAMP_SEED=7 cargo test -p lamp-tests batch_kills::` kills that often, at other
//! moments.
#![cfg(target_os = "linux")]

mod damage;
mod disk;
mod endings;
mod kills;
mod night;
mod processes;

/// Returns the number in a variable of the environment, or another one.
fn number(variable: &str, usual: u64) -> u64 {
    let asked = std::env::var(variable);
    asked.map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{variable} is a number")))
}
