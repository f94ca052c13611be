//! The materials of the literature that LAMP follows.

use super::Material;

/// A material that comes with LAMP.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    name: &'static str,
    toml: &'static str,
}

macro_rules! builtin {
    ($($name:literal),*) => {
        [$(Builtin {
            name: $name,
            toml: include_str!(concat!("../../materials/", $name, ".toml")),
        }),*]
    };
}

impl Builtin {
    /// All of them, by name.
    pub const ALL: [Self; 5] =
        builtin!["lamp-no-absorber", "lamp-suspension", "pegda-mw700", "sl-5510", "tmpta"];

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

    /// The material.
    ///
    /// # Panics
    /// Never: a test reads them all.
    pub fn material(&self) -> Material {
        Material::from_toml(self.toml).expect("built-in materials are whole")
    }
}
