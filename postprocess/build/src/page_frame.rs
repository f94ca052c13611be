//! Adapts pages to images that were cropped or padded.

use lamp_stack::{Frame, PageInfo, StackInfo};
use serde_json::{Value, json};

use crate::image_bounds::ImageBounds;

/// Adapts a page to a frame of its image, which lies at `place`.
pub fn frame_page(info: &mut PageInfo, frame: Frame, place: &ImageBounds) {
    place.locate(info);
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

/// Adapts the copies on a first page to a frame of the image.
fn move_copies(stack: &mut StackInfo, frame: Frame) {
    let Some(tile) = stack.other.get_mut("tile") else { return };
    each_part(tile, |part| {
        let copies = part.get_mut("copies").and_then(Value::as_array_mut);
        for copy in copies.into_iter().flatten() {
            if let Ok([left, top]) = serde_json::from_value::<[i64; 2]>(copy.clone()) {
                *copy = json!([left.saturating_sub(frame.left), top.saturating_sub(frame.top)]);
            }
        }
    });
}

/// Calls `with` on the entry for each part.
fn each_part(tile: &mut Value, mut with: impl FnMut(&mut Value)) {
    match tile.get_mut("parts").and_then(Value::as_array_mut) {
        Some(parts) => parts.iter_mut().for_each(with),
        None => with(tile),
    }
}

#[cfg(test)]
mod tests {
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
}
