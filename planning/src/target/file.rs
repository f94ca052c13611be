//! Target files.

use std::fmt::Display;
use std::str::FromStr;

use lamp_stack::{Builtin, Catalogued, Length, Size};
use serde::de::{self, Deserialize, Deserializer};

use super::shapes::{Shapes, ShapesError};

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../../targets/", $name, ".toml")) }
    };
}

impl Catalogued for Shapes {
    const KIND: &'static str = "target";
    const BUILTINS: &'static [Builtin] = &[
        builtin!("channels"),
        builtin!("hemisphere"),
        builtin!("lens"),
        builtin!("lens-array"),
        builtin!("small-sphere"),
        builtin!("sphere"),
        builtin!("sphere-on-cylinder"),
    ];
    type CheckError = ShapesError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), ShapesError> {
        self.check()
    }
}

pub(super) fn length<'de, D: Deserializer<'de>>(from: D) -> Result<Length, D::Error> {
    parsed(from)
}

pub(super) fn some_length<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Length>, D::Error> {
    parsed(from).map(Some)
}

pub(super) fn some_size<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Size>, D::Error> {
    parsed(from).map(Some)
}

pub(super) fn lengths<'de, D: Deserializer<'de>>(from: D) -> Result<[Length; 2], D::Error> {
    let [x, y] = <[String; 2]>::deserialize(from)?;
    let length = |text: String| text.parse().map_err(de::Error::custom);
    Ok([length(x)?, length(y)?])
}

fn parsed<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    String::deserialize(from)?.parse().map_err(de::Error::custom)
}
