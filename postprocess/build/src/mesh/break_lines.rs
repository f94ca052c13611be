//! Break lines: cuts through the mesh along which parts come free.

/// The box of a part or of a line, from its first column and row up to but excluding
/// its last ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rect {
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) right: u32,
    pub(crate) bottom: u32,
}

impl Rect {
    /// Returns the box with columns and rows exchanged.
    fn transposed(self) -> Self {
        Self { left: self.top, top: self.left, right: self.bottom, bottom: self.right }
    }
}

/// More lines would leave nothing of the mesh.
const MAX_LINES: u64 = 10_000;

/// The break lines of a build.
#[derive(Clone, Debug, Default)]
pub(crate) struct BreakLines {
    /// Bands of equal rows: the row behind the last, and their transitions.
    bands: Vec<(u32, Vec<u32>)>,
}

impl BreakLines {
    /// Creates the lines of parts, `width` wide. They go up, down, left and right through the
    /// middle of each part's box and at every `pitch` from there. They end in the middle of the
    /// next part's box, whose outline they meet before, or at the build's edge. Lengths are in
    /// pixels along x and y. Returns `None` if there are too many.
    pub(crate) fn new(
        parts: &[Rect],
        area: [u32; 2],
        width: [u32; 2],
        pitch: [u32; 2],
    ) -> Option<Self> {
        let of_part = |part: &Rect| {
            let sides = [part.right - part.left, part.bottom - part.top];
            let count = |axis: usize| u64::from(sides[axis] / pitch[axis].max(width[axis] + 1)) + 1;
            count(0) + count(1)
        };
        // Counted before any is made: each line is compared with all parts, and each band with all
        // lines.
        if parts.iter().map(of_part).sum::<u64>() > MAX_LINES {
            return None;
        }
        let transposed: Vec<Rect> = parts.iter().map(|part| part.transposed()).collect();
        let mut lines = upright(parts, area, width[0], pitch[0]);
        let across = upright(&transposed, [area[1], area[0]], width[1], pitch[1]);
        lines.extend(across.into_iter().map(Rect::transposed));
        Some(Self { bands: bands(&lines, area[1]) })
    }

    /// Returns the transitions of a row.
    pub(crate) fn row(&self, row: u32) -> &[u32] {
        let band = self.bands.partition_point(|band| band.0 <= row);
        self.bands.get(band).map_or(&[], |band| &band.1)
    }
}

/// Returns the vertical lines.
fn upright(parts: &[Rect], [columns, rows]: [u32; 2], width: u32, pitch: u32) -> Vec<Rect> {
    let mut lines = Vec::new();
    // Closer lines would join.
    let pitch = pitch.max(width + 1);
    for part in parts {
        let middle = part.left + (part.right - part.left) / 2;
        let half = (part.right - part.left) / 2;
        // Whole pitches on both sides keep one line in the middle.
        let aside = half / pitch * pitch;
        for place in (0..=2 * aside).step_by(pitch as usize) {
            let left = (middle + place).saturating_sub(aside + width / 2);
            let right = (left + width).min(columns);
            // Other parts that the line meets.
            let met = || parts.iter().filter(|p| *p != part && p.left < right && left < p.right);
            let middle = |p: &Rect| p.top + (p.bottom - p.top) / 2;
            let above = met().filter(|p| middle(p) < part.top).map(middle);
            let below = met().filter(|p| middle(p) > part.bottom).map(middle);
            lines.push(Rect {
                left,
                right,
                top: above.max().unwrap_or(0),
                bottom: below.min().unwrap_or(rows),
            });
        }
    }
    lines
}

/// Returns the rows of the union of boxes, with equal rows as one band.
fn bands(lines: &[Rect], height: u32) -> Vec<(u32, Vec<u32>)> {
    let mut ends: Vec<u32> = lines.iter().flat_map(|line| [line.top, line.bottom]).collect();
    ends.push(height);
    ends.sort_unstable();
    ends.dedup();
    let mut first = 0;
    let mut bands = Vec::new();
    for end in ends.into_iter().filter(|&end| end > 0) {
        // Bands end wherever a line does, so a line covers a band wholly or not at all.
        let met = lines.iter().filter(|line| line.top <= first && end <= line.bottom);
        let mut runs: Vec<[u32; 2]> = met.map(|line| [line.left, line.right]).collect();
        runs.sort_unstable();
        let mut row: Vec<u32> = Vec::new();
        for [left, right] in runs {
            match row.last_mut() {
                Some(last) if *last >= left => *last = right.max(*last),
                _ => row.extend([left, right]),
            }
        }
        bands.push((end, row));
        first = end;
    }
    bands
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(left: u32, top: u32, right: u32, bottom: u32) -> Rect {
        Rect { left, top, right, bottom }
    }

    fn drawn(breaks: &BreakLines, width: u32, height: u32) -> Vec<String> {
        let rows = (0..height).map(|row| {
            let row = breaks.row(row);
            let is_cut = |column| row.partition_point(|&place| place <= column) % 2 == 1;
            (0..width).map(|column| if is_cut(column) { '|' } else { '.' }).collect()
        });
        rows.collect()
    }

    #[test]
    fn lines_run_from_a_part_to_the_edge() {
        let breaks = BreakLines::new(&[rect(3, 2, 8, 5)], [10, 7], [1; 2], [100; 2]).unwrap();
        let expected = [
            ".....|....",
            ".....|....",
            ".....|....",
            "||||||||||",
            ".....|....",
            ".....|....",
            ".....|....",
        ];
        assert_eq!(drawn(&breaks, 10, 7), expected);
    }

    #[test]
    fn lines_end_at_other_parts_and_stand_a_pitch_apart() {
        let parts = [rect(2, 1, 7, 3), rect(1, 6, 6, 8)];
        let breaks = BreakLines::new(&parts, [9, 10], [1; 2], [2; 2]).unwrap();
        // The upper part's are in columns 2, 4 and 6, the lower one's in 1, 3 and 5;
        // 1 and 6 pass the other part by.
        let expected = [
            ".||.|.|..",
            ".||.|.|..",
            "|||||||||",
            ".||||||..",
            ".||||||..",
            ".||||||..",
            ".||||||..",
            "|||||||||",
            ".|.|.||..",
            ".|.|.||..",
        ];
        assert_eq!(drawn(&breaks, 9, 10), expected);
    }

    #[test]
    fn no_part_has_no_lines() {
        assert!(BreakLines::new(&[], [9, 10], [1; 2], [2; 2]).unwrap().row(4).is_empty());
    }

    #[test]
    fn too_many_lines_are_none() {
        let parts = vec![rect(0, 0, 6_000, 6_000); 2];
        assert!(BreakLines::new(&parts, [6_000; 2], [1; 2], [3; 2]).is_some());
        assert!(BreakLines::new(&parts, [6_000; 2], [1; 2], [2; 2]).is_none());
    }
}
