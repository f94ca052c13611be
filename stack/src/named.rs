//! Enums whose cases have names, as people write them in options and files.

use std::fmt::Display;
use std::str::FromStr;

use thiserror::Error;

/// An enum without data whose cases have names. [`named!`](crate::named) implements it.
pub trait Named: Copy + Display + FromStr<Err = UnknownName> + Send + Sync + 'static {
    /// The names of all cases in order, each followed by other spellings that are read.
    const NAMES: &'static [&'static [&'static str]];
}

/// A name that no case of an enum has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is none of {}", known.join(", "))]
pub struct UnknownName {
    /// The name.
    pub name: String,
    /// The names of the cases.
    pub known: Vec<&'static str>,
}

impl UnknownName {
    /// Reports that no case of `T` is called `name`.
    pub fn new<T: Named>(name: &str) -> Self {
        Self { name: name.to_owned(), known: T::NAMES.iter().map(|names| names[0]).collect() }
    }
}

/// Names the cases of an enum: implements [`Named`], `Display` and `FromStr`, and adds `ALL`
/// and `name`.
///
/// ```
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// enum Colour {
///     Black,
///     Gray,
/// }
///
/// lamp_stack::named!(Colour { Black = "black", Gray = "gray" | "grey" });
///
/// assert_eq!("grey".parse(), Ok(Colour::Gray));
/// assert_eq!(Colour::ALL.map(Colour::name), ["black", "gray"]);
/// ```
#[macro_export]
macro_rules! named {
    ($type:ident { $($case:ident = $name:literal $(| $alias:literal)*),+ $(,)? }) => {
        impl $type {
            // Macros cannot count their cases, but the length of an array can.
            /// Every case.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$case),+];

            /// Returns the name of the case.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$case => $name),+
                }
            }
        }

        impl $crate::Named for $type {
            const NAMES: &'static [&'static [&'static str]] = &[$(&[$name $(, $alias)*]),+];
        }

        impl ::std::fmt::Display for $type {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                // Unlike `write_str`, `pad` heeds the width that a format asks for.
                f.pad(self.name())
            }
        }

        impl ::std::str::FromStr for $type {
            type Err = $crate::UnknownName;

            fn from_str(name: &str) -> ::std::result::Result<Self, $crate::UnknownName> {
                match name {
                    $($name $(| $alias)* => Ok(Self::$case),)+
                    _ => Err($crate::UnknownName::new::<Self>(name)),
                }
            }
        }
    };
}
