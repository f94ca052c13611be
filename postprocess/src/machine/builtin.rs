//! The machines of the literature that LAMP follows.

use super::Machine;

/// A machine that comes with LAMP.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    name: &'static str,
    toml: &'static str,
}

macro_rules! builtin {
    ($($name:literal),*) => {
        [$(Builtin {
            name: $name,
            toml: include_str!(concat!("../../machines/", $name, ".toml")),
        }),*]
    };
}

impl Builtin {
    /// All of them, by name.
    pub const ALL: [Self; 2] = builtin!["alpha", "beta"];

    /// Finds one.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|builtin| builtin.name == name)
    }

    /// Its name.
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Its file, with comments on what its sources leave open.
    pub const fn toml(&self) -> &'static str {
        self.toml
    }

    /// The machine.
    ///
    /// # Panics
    /// Never: a test reads them all.
    pub fn machine(&self) -> Machine {
        Machine::from_toml(self.toml).expect("built-in machines are whole")
    }
}
