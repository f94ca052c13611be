//! Parts that are black in all layers, which are errors.

use lamp_stack::Layer;

use super::areas::Areas;
use super::{BuildFinding, TileError};

/// A layer, its findings, and the pixels that make it up.
pub(super) type Made = (Layer, (Vec<BuildFinding>, Areas));

/// Passes on layers. After the last comes an error if a part was black in all of them.
pub(super) fn unless_black<E: From<TileError>>(
    mut layers: impl Iterator<Item = Result<Made, E>>,
    names: Vec<String>,
) -> impl Iterator<Item = Result<Made, E>> {
    let mut black: Vec<Option<String>> = names.into_iter().map(Some).collect();
    let mut ended = false;
    std::iter::from_fn(move || match layers.next() {
        Some(Ok(made)) => {
            let (_, (_, Areas { part_px, .. })) = &made;
            for (name, _) in black.iter_mut().zip(part_px).filter(|(_, pixels)| **pixels > 0) {
                *name = None;
            }
            Some(Ok(made))
        }
        Some(Err(error)) => {
            // After an error the rest is unread, so nobody knows whether a part is black in it.
            ended = true;
            Some(Err(error))
        }
        None if std::mem::replace(&mut ended, true) => None,
        None => {
            let name = black.iter_mut().find_map(Option::take)?;
            Some(Err(TileError::Black { name }.into()))
        }
    })
}
