//! What pages say of images that were cropped, padded or turned.

use lamp_stack::{Frame, PageInfo, Turn};
use serde_json::{Value, json};

use super::error::EditError;
use super::place::{Grid, Place};

/// Makes a page say what holds for the rows that a frame shows, which lie at
/// `place`.
pub(super) fn frame_page(info: &mut PageInfo, frame: Frame, place: &Place) {
    move_to(info, place);
    let moved = |row: u32, end: i64| {
        let row = i64::from(row).saturating_sub(frame.top);
        (0..end).contains(&row).then_some(row as u32)
    };
    let height = i64::from(frame.height);
    info.stray_rows = info.stray_rows.iter().filter_map(|&row| moved(row, height)).collect();
    // One stands below the last row, if contours break off there.
    info.open_rows = info.open_rows.iter().filter_map(|&row| moved(row, height + 1)).collect();
    let tiled = info.stack.as_mut().and_then(|stack| stack.other.get_mut("tile"));
    for copy in tiled.and_then(|tile| tile.get_mut("copies")?.as_array_mut()).into_iter().flatten()
    {
        if let Some([left, top]) = corner(copy) {
            *copy = json!([left - frame.left, top - frame.top]);
        }
    }
}

/// Makes a page of `height` rows say what holds for the turned image, which lies
/// at `place`. Where copies stand is no longer said.
///
/// # Errors
/// Where stray rows would become columns.
pub(super) fn turn_page(
    info: &mut PageInfo,
    turn: Turn,
    height: u32,
    place: &Place,
) -> Result<(), EditError> {
    if turn.is_across() && !info.stray_rows.is_empty() {
        return Err(EditError::layer(
            info,
            "its stray rows would become columns, which no stage mends: fix the stack first",
        ));
    }
    move_to(info, place);
    if turn.is_across() {
        info.open_rows.clear();
    }
    // Turned by half, or mirrored and not: the last row is the first.
    if turn.quarters() == 2 {
        info.stray_rows.iter_mut().for_each(|row| *row = height - 1 - *row);
        info.open_rows.iter_mut().for_each(|row| *row = height - *row);
        info.stray_rows.reverse();
        info.open_rows.reverse();
    }
    if let Some(stack) = &mut info.stack {
        stack.other.shift_remove("tile");
    }
    Ok(())
}

fn move_to(info: &mut PageInfo, place: &Place) {
    info.origin_mm = info.origin_mm.map(|_| place.origin_mm);
}

/// What maps the points of a part to the pixels of each copy that `tile` made.
///
/// # Errors
/// What the first page lacks.
pub(super) fn copies(info: &PageInfo, place: &Place) -> Result<Vec<Grid>, EditError> {
    let lacks = |what: &str| {
        EditError::layer(info, format!("{what}: copies are for builds that tile made"))
    };
    let tile = info.stack.as_ref().and_then(|stack| stack.other.get("tile"));
    let tile = tile.ok_or_else(|| lacks("its page does not say where copies stand"))?;
    let origin_mm = serde_json::from_value(tile["part_origin_mm"].clone())
        .map_err(|_| lacks("its page does not say where the part lay"))?;
    let dpi = place.dpi()?;
    let grid = |copy: &Value| {
        let [left, top] = corner(copy)?;
        Some(Grid { origin_mm, dpi, offset: [left as f64, top as f64] })
    };
    let copies = tile["copies"].as_array().map(|copies| copies.iter().map(grid).collect());
    copies
        .flatten()
        .ok_or_else(|| lacks("its page says where copies stand in a way that is not known here"))
}

/// The left column and the top row of a copy.
fn corner(copy: &Value) -> Option<[i64; 2]> {
    serde_json::from_value(copy.clone()).ok()
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Dpi, StackInfo};

    use super::*;

    const PLACE: Place = Place { origin_mm: [7.0, 8.0], dpi: None, width: 5, height: 6 };

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
        let place = Place { dpi: Dpi::new(254.0), ..PLACE };
        let offsets: Vec<_> =
            copies(&page, &place).unwrap().iter().map(|grid| grid.offset).collect();
        assert_eq!(offsets, [[1.0, 1.0], [3.0, 3.0]]);
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
            assert!(copies(&page, &PLACE).is_err());
        }
        let mut page = info();
        turn_page(&mut page, "0m".parse().unwrap(), 10, &PLACE).unwrap();
        assert_eq!((&page.stray_rows, &page.open_rows), (&info().stray_rows, &info().open_rows));
        let across = turn_page(&mut page, "90".parse().unwrap(), 10, &PLACE);
        assert!(across.unwrap_err().to_string().contains("fix the stack first"));
    }
}
