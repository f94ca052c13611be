//! Follows the outlines of white areas along the edges of pixels.

use crate::image::mask::Mask;

/// A closed polygon along the edges of pixels: its corners as (column, row), from the image's top
/// left corner. White is on the left of the way along it, seen with y up: outlines of areas turn
/// left, and outlines of holes turn right. The last corner is not the first one again. No outline
/// passes a point twice, but two may touch at a corner.
pub type Outline = Vec<[u32; 2]>;

/// A straight vertical side between white and black pixels.
struct Side {
    column: u32,
    /// The lines of its upper and lower end.
    ends: [u32; 2],
    /// The sides that horizontal lines join to its upper and lower end.
    next: [u32; 2],
    /// Whether white is on its right, so that the way along it goes down.
    goes_down: bool,
}

impl Mask {
    /// Returns the outlines of the white areas. Areas that touch only at corners of pixels are apart.
    ///
    /// Time and memory grow with the transitions.
    ///
    /// ```
    /// use lamp_stack::Mask;
    ///
    /// let mask = Mask::new(8, vec![0, 2, 4], vec![1, 4, 2, 4])?;
    /// assert_eq!(mask.outlines(), [[[1, 0], [1, 1], [2, 1], [2, 2], [4, 2], [4, 0]]]);
    /// # Ok::<(), lamp_stack::RunError>(())
    /// ```
    pub fn outlines(&self) -> Vec<Outline> {
        let (sides, touched) = self.sides();
        let mut passed = vec![false; sides.len()];
        let mut outlines = Vec::new();
        for first in 0..sides.len() {
            if passed[first] || !sides[first].goes_down {
                continue;
            }
            let (mut outline, mut at) = (Outline::new(), first);
            // The touched corners of the outline so far, and their places in it.
            let mut open: Vec<([u32; 2], usize)> = Vec::new();
            while !passed[at] {
                passed[at] = true;
                let side = &sides[at];
                let [from, to] = if side.goes_down { [0, 1] } else { [1, 0] };
                for corner in [from, to].map(|end| [side.column, side.ends[end]]) {
                    outline.push(corner);
                    if touched
                        .binary_search_by_key(&(corner[1], corner[0]), |it| (it[1], it[0]))
                        .is_err()
                    {
                        continue;
                    }
                    match open.iter().position(|(known, _)| *known == corner) {
                        // The way back to it is an outline of its own.
                        Some(known) => {
                            outlines.push(outline.split_off(open[known].1));
                            open.truncate(known + 1);
                            let place = outline.len();
                            outline.push(corner);
                            open[known].1 = place;
                            // Its first corner is the last one.
                            let last = outlines.len() - 1;
                            outlines[last].pop();
                        }
                        None => open.push((corner, outline.len() - 1)),
                    }
                }
                at = side.next[to] as usize;
            }
            outlines.push(outline);
        }
        outlines
    }

    /// Returns all vertical sides, joined, and the corners at which white pixels only touch, from the
    /// top left.
    fn sides(&self) -> (Vec<Side>, Vec<[u32; 2]>) {
        let width = self.width();
        let (mut sides, mut touched) = (Vec::<Side>::new(), Vec::new());
        // The columns and sides that the row above has, and that this row has.
        let (mut above, mut here) = (Vec::<(u32, u32)>::new(), Vec::new());
        // The corners on a line from the left: a side, and which of its ends is there.
        let mut corners: Vec<(u32, usize)> = Vec::new();
        let start = |sides: &mut Vec<Side>, column, row, goes_down| {
            sides.push(Side { column, ends: [row; 2], next: [0; 2], goes_down });
            (column, sides.len() as u32 - 1)
        };
        for row in 0..=self.height() {
            here.clear();
            corners.clear();
            let of_row = if row < self.height() { self.row(row) } else { &[] };
            // A row that ends white has a side at the image's edge.
            let edge = (of_row.len() % 2 == 1).then_some(width);
            let mut old = above.iter().copied().peekable();
            for (k, column) in of_row.iter().copied().chain(edge).enumerate() {
                let goes_down = k % 2 == 0;
                while let Some(&(left, side)) = old.peek()
                    && left < column
                {
                    corners.push((side, 1));
                    old.next();
                }
                match old.peek().copied() {
                    Some((same, side)) if same == column => {
                        old.next();
                        if sides[side as usize].goes_down == goes_down {
                            // It goes on.
                            here.push((column, side));
                            continue;
                        }
                        let new = start(&mut sides, column, row, goes_down);
                        touched.push([column, row]);
                        // Four pixels meet like a checkerboard. The side with white on its left comes
                        // first, so that the white pixels are apart.
                        match goes_down {
                            true => corners.extend([(side, 1), (new.1, 0)]),
                            false => corners.extend([(new.1, 0), (side, 1)]),
                        }
                        here.push(new);
                    }
                    _ => {
                        let new = start(&mut sides, column, row, goes_down);
                        corners.push((new.1, 0));
                        here.push(new);
                    }
                }
            }
            corners.extend(old.map(|(_, side)| (side, 1)));
            for pair in corners.chunks_exact(2) {
                let [(a, of_a), (b, of_b)] = [pair[0], pair[1]];
                sides[a as usize].next[of_a] = b;
                sides[b as usize].next[of_b] = a;
                sides[a as usize].ends[of_a] = row;
                sides[b as usize].ends[of_b] = row;
            }
            std::mem::swap(&mut above, &mut here);
        }
        (sides, touched)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::mask::MaskBuilder;

    fn mask_of(rows: &[&str]) -> Mask {
        let mut mask = MaskBuilder::new(rows[0].len() as u32);
        for row in rows {
            let white = |column: usize| row.as_bytes()[column] == b'#';
            let changes = (0..row.len()).filter(|&c| white(c) != (c > 0 && white(c - 1)));
            mask.push_row(&changes.map(|c| c as u32).collect::<Vec<_>>()).unwrap();
        }
        mask.finish()
    }

    /// Twice the area with its sign, where y goes up.
    fn doubled_area(outline: &Outline) -> i64 {
        let next = outline.iter().cycle().skip(1);
        let pairs = outline.iter().zip(next);
        pairs
            .map(|(a, b)| i64::from(b[0]) * i64::from(a[1]) - i64::from(a[0]) * i64::from(b[1]))
            .sum()
    }

    #[test]
    fn holes_turn_right_and_corners_part() {
        let ring = mask_of(&["####", "#..#", "####"]);
        let areas: Vec<_> = ring.outlines().iter().map(doubled_area).collect();
        assert_eq!(areas, [24, -4]);
        let corners = mask_of(&["#.#", ".#.", "#.#"]);
        assert_eq!(corners.outlines().len(), 5);
        assert!(corners.outlines().iter().all(|outline| doubled_area(outline) == 2));
        let pinched = mask_of(&["###.", "#.##", "####"]);
        let mut areas: Vec<_> = pinched.outlines().iter().map(doubled_area).collect();
        areas.sort_unstable();
        assert_eq!(areas, [-2, 22]);
        assert!(mask_of(&["...", "..."]).outlines().is_empty());
    }

    proptest! {
        /// Filled again by even-odd, outlines give the image; their corners are corners.
        #[test]
        fn outlines_enclose_what_is_white(
            rows in prop::collection::vec(prop::collection::vec(any::<bool>(), 9), 1..9),
        ) {
            let text = |row: &Vec<bool>| row.iter().map(|&on| if on { '#' } else { '.' }).collect();
            let text: Vec<String> = rows.iter().map(text).collect();
            let mask = mask_of(&text.iter().map(|row| &**row).collect::<Vec<_>>());
            let outlines = mask.outlines();
            for (r, row) in rows.iter().enumerate() {
                for (c, &is_white) in row.iter().enumerate() {
                    // Vertical sides left of the pixel's center.
                    let mut winding = 0;
                    for outline in &outlines {
                        let mut corners = outline.clone();
                        corners.sort_unstable();
                        prop_assert!(corners.windows(2).all(|pair| pair[0] != pair[1]));
                        for (k, a) in outline.iter().enumerate() {
                            let b = outline[(k + 1) % outline.len()];
                            prop_assert!((a[0] == b[0]) != (a[1] == b[1]));
                            let r = r as u32;
                            if a[0] == b[0] && a[0] <= c as u32 {
                                winding += i32::from(a[1] <= r && r < b[1]);
                                winding -= i32::from(b[1] <= r && r < a[1]);
                            }
                        }
                    }
                    prop_assert_eq!(winding, i32::from(is_white));
                }
            }
            let area: i64 = outlines.iter().map(doubled_area).sum();
            prop_assert_eq!(area as u64, 2 * mask.white_pixels());
        }
    }
}
