//! Adapts pages to images that were turned.

use lamp_build::ImageBounds;
use lamp_stack::{Orientation, PageInfo};

use super::copies::forget_copies;
use super::edit_error::{EditError, LayerProblem};

/// Adapts the page of an image of `height` rows to the turned image, which lies at
/// `place`. It no longer says where copies stand.
///
/// # Errors
/// Returns an error if stray rows would become columns.
pub(super) fn turn_page(
    info: &mut PageInfo,
    turn: Orientation,
    height: u32,
    place: &ImageBounds,
) -> Result<(), EditError> {
    if turn.is_across() && !info.stray_rows.is_empty() {
        return Err(LayerProblem::StrayColumns.of_layer(info));
    }
    place.locate(info);
    if turn.is_across() {
        info.open_rows.clear();
    }
    // A half turn, mirrored or not, makes the last row the first.
    if turn.quarters() == 2 {
        // Rows beyond the image are dropped.
        let upside_down = |rows: &[u32], last: Option<u32>| -> Vec<u32> {
            rows.iter().rev().filter_map(|row| last?.checked_sub(*row)).collect()
        };
        info.stray_rows = upside_down(&info.stray_rows, height.checked_sub(1));
        info.open_rows = upside_down(&info.open_rows, Some(height));
    }
    if let Some(stack) = &mut info.stack {
        forget_copies(stack);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use lamp_stack::StackInfo;
    use serde_json::json;

    use super::*;

    const PLACE: ImageBounds =
        ImageBounds { origin_mm: [7.0, 8.0], pitch: None, width: 5, height: 6 };

    fn info() -> PageInfo {
        let mut stack = StackInfo::default();
        let tile = json!({ "part_origin_mm": [1.0, 2.0], "copies": [[3, 4], [5, 6]] });
        stack.other.insert("tile".to_owned(), tile);
        PageInfo {
            origin_mm: Some([0.0, 0.0]),
            stray_rows: vec![2, 5, 9],
            open_rows: vec![2, 6, 10],
            stack: Some(stack),
            ..PageInfo::default()
        }
    }

    #[test]
    fn rows_follow_a_turn_or_it_is_refused() {
        for turn in ["180", "180m"] {
            let mut page = info();
            turn_page(&mut page, turn.parse().unwrap(), 10, &PLACE).unwrap();
            assert_eq!(
                (&page.stray_rows[..], &page.open_rows[..]),
                (&[0, 4, 7][..], &[0, 4, 8][..])
            );
            assert!(page.stack.unwrap().other.is_empty());
        }
        let mut page = info();
        turn_page(&mut page, "0m".parse().unwrap(), 10, &PLACE).unwrap();
        assert_eq!((&page.stray_rows, &page.open_rows), (&info().stray_rows, &info().open_rows));
        page.stray_rows.push(11);
        turn_page(&mut page, "180".parse().unwrap(), 10, &PLACE).unwrap();
        assert_eq!(page.stray_rows, [0, 4, 7]);
        let across = turn_page(&mut page, "90".parse().unwrap(), 10, &PLACE);
        assert!(across.unwrap_err().to_string().contains("would become columns"));
    }
}
