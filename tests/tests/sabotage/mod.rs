//! The saboteur's list, fault by fault: kills at random moments, full disks, limits of memory, dead
//! and living writers, and mutated inputs of every kind.
//!
//! `LAMP_SABOTAGE=10000 cargo test --release -p lamp-tests --test sabotage` tries that many inputs of
//! each kind, and a tenth as many kills, instead of the few that there is time for each time.
#![cfg(unix)]

mod disk;
mod jobs;
mod kills;
mod limits;
mod memory;
mod mutants;
mod sets;
mod stacks;
mod writers;

/// Returns how often to try something: `few` times, or as often as `LAMP_SABOTAGE` says.
fn trials(few: u64) -> u64 {
    let asked = std::env::var("LAMP_SABOTAGE");
    asked.map_or(few, |number| number.parse().expect("LAMP_SABOTAGE is a number"))
}
