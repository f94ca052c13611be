//! Adapts pages to images that were cropped, padded or turned.

use super::copies::{forget_copies, move_copies};
use super::edit_error::{EditError, LayerProblem};
use super::image_bounds::ImageBounds;
use lamp_stack::{Frame, Orientation, PageInfo};

/// Adapts a page to a frame of its image, which lies at `place`.
pub(crate) fn frame_page(info: &mut PageInfo, frame: Frame, place: &ImageBounds) {
    move_to(info, place);
    let moved = |row: u32, end: i64| {
        let row = i64::from(row).saturating_sub(frame.top);
        (0..end).contains(&row).then_some(row as u32)
    };
    let height = i64::from(frame.height);
    info.stray_rows = info.stray_rows.iter().filter_map(|&row| moved(row, height)).collect();
    // An open row may stand below the last row, where contours break off.
    info.open_rows = info.open_rows.iter().filter_map(|&row| moved(row, height + 1)).collect();
    if let Some(stack) = &mut info.stack {
        move_copies(stack, frame);
    }
}

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
    move_to(info, place);
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

fn move_to(info: &mut PageInfo, place: &ImageBounds) {
    info.origin_mm = info.origin_mm.map(|_| place.origin_mm);
}

#[cfg(test)]
mod tests {
    use lamp_stack::StackInfo;
    use serde_json::json;

    use super::*;

    const PLACE: ImageBounds =
        ImageBounds { origin_mm: [7.0, 8.0], dpi: None, width: 5, height: 6 };

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
    fn rows_and_copies_follow_a_frame() {
        let mut page = info();
        frame_page(&mut page, Frame { left: 2, top: 3, width: 5, height: 6 }, &PLACE);
        assert_eq!((page.origin_mm, &page.stray_rows[..]), (Some([7.0, 8.0]), &[2][..]));
        assert_eq!(page.open_rows, [3]);
        assert_eq!(page.stack.unwrap().other["tile"]["copies"], json!([[1, 1], [3, 3]]));
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
