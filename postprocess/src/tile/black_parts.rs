//! Parts that are black in all layers, which are errors.

use lamp_stack::Layer;

use super::TileError;

/// Passes on layers that come with the parts that are not black in them. After the last comes an
/// error if a part was black in all of them.
pub(super) fn unless_black<E: From<TileError>>(
    mut layers: impl Iterator<Item = Result<(Layer, Vec<usize>), E>>,
    names: Vec<String>,
) -> impl Iterator<Item = Result<Layer, E>> {
    let mut black: Vec<Option<String>> = names.into_iter().map(Some).collect();
    let mut ended = false;
    std::iter::from_fn(move || match layers.next() {
        Some(Ok((layer, exposed))) => {
            exposed.into_iter().for_each(|part| black[part] = None);
            Some(Ok(layer))
        }
        Some(Err(error)) => {
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
