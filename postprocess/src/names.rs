//! Values of options by the names that people write.

use thiserror::Error;

/// A name that no value of an option has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{name}` is none of {}", known.join(", "))]
pub struct UnknownName {
    /// The name as it was given.
    pub name: String,
    /// The names there are.
    pub known: Vec<String>,
}

/// Gives an enum without fields its `ALL` values, `Display` and `FromStr` by names.
macro_rules! named {
    ($type:ty { $($value:ident: $name:literal),+ $(,)? }) => {
        impl $type {
            /// Every value.
            pub const ALL: &[Self] = &[$(Self::$value),+];
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(match self { $(Self::$value => $name),+ })
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::names::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($name => Ok(Self::$value),)+
                    _ => Err($crate::names::UnknownName {
                        name: text.to_owned(),
                        known: Self::ALL.iter().map(Self::to_string).collect(),
                    }),
                }
            }
        }
    };
}
pub(crate) use named;

#[cfg(test)]
mod tests {
    use crate::{CellShape, Moat, PackBy, Turns};

    #[test]
    fn names_are_read_as_they_are_written() {
        assert!(Turns::ALL.iter().all(|turns| turns.to_string().parse() == Ok(*turns)));
        assert!(PackBy::ALL.iter().all(|by| by.to_string().parse() == Ok(*by)));
        assert!(Moat::ALL.iter().all(|moat| moat.to_string().parse() == Ok(*moat)));
        assert!(CellShape::ALL.iter().all(|shape| shape.to_string().parse() == Ok(*shape)));
        let error = "tight".parse::<PackBy>().unwrap_err();
        assert_eq!(error.to_string(), "`tight` is none of box, outline");
    }
}
