//! Describes the contents of a file besides the solids that are sliced.

/// Contents of a file that are not sliced, or not as they stand.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("#{entity}, {matter}, is {}{}", matter.fate(), first_of(*count))]
pub struct Notice {
    /// The number of the first entity.
    pub entity: u64,
    /// The number of such entities.
    pub count: usize,
    /// The kind of the entities.
    pub matter: Matter,
}

fn first_of(count: usize) -> String {
    if count > 1 { format!(" (the first of {count})") } else { String::new() }
}

/// The subject of a [`Notice`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Matter {
    /// A surface in a file that holds solids.
    #[error("a surface next to solids")]
    Surface,
    /// A surface in a file without solids.
    #[error("a surface that belongs to no solid")]
    Sewn,
    /// A curve or a point.
    #[error("a curve that bounds no face")]
    Wire,
    /// Facets, including facets that repeat a solid.
    #[error("facets without exact surfaces")]
    Facets,
    /// A solid that no product contains, or a solid of a part that no assembly places.
    #[error("a solid that no product or assembly places")]
    Unplaced,
    /// A solid used twice in one place.
    #[error("a solid that is placed twice in one place")]
    Twice,
    /// A part in another file.
    #[error("a part in another file, `{file}`")]
    Elsewhere {
        /// The name of the file.
        file: String,
    },
}

impl Matter {
    /// Says what happens to it.
    fn fate(&self) -> &'static str {
        match self {
            Self::Sewn => "sliced if such surfaces close",
            Self::Twice => "sliced once",
            _ => "not sliced",
        }
    }
}
