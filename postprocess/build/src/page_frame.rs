//! Adapts pages to images that were cropped or padded.

use lamp_stack::{Frame, PageInfo};

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
        stack.move_copies([frame.left, frame.top]);
    }
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
    fn rows_and_copies_follow_a_frame() {
        let mut page = info();
        frame_page(&mut page, Frame { left: 2, top: 3, width: 5, height: 6 }, &PLACE);
        assert_eq!((page.origin_mm, &page.stray_rows[..]), (Some([7.0, 8.0]), &[2][..]));
        assert_eq!(page.open_rows, [3]);
        assert_eq!(page.stack.unwrap().other["tile"]["copies"], json!([[1, 1], [3, 3]]));
    }
}
