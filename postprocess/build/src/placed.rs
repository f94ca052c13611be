//! Copies that are placed where they are asked for.

use lamp_stack::{Length, Orientation, Size};

use super::overlap::common_pixel;
use super::{CopyPlacement, Layout, PartStack, PixelSize, TileError};

/// A [`CopyPlacement`] as it is asked for, perhaps off the area.
#[derive(Clone, Copy, Debug)]
pub(super) struct RequestedPlacement {
    pub(super) part: usize,
    pub(super) turn: Orientation,
    pub(super) left: i64,
    pub(super) top: i64,
}

impl Layout {
    /// Places copies where they are asked for.
    ///
    /// # Errors
    /// Returns an error if copies overlap or reach beyond the area.
    pub(super) fn placed(
        parts: Vec<PartStack>,
        requested: &[RequestedPlacement],
        area: Size,
    ) -> Result<Self, TileError> {
        let mut layout = Self::empty(parts, area)?;
        layout.check_turns(requested.iter().map(|request| request.turn))?;
        for (index, request) in requested.iter().enumerate() {
            let RequestedPlacement { part, turn, left, top } = *request;
            let size = layout.parts[part].size(turn);
            let beyond_um = layout.beyond_um(request, size);
            if beyond_um > 0.0 {
                let number = requested[..=index].iter().filter(|other| other.part == part).count();
                return Err(TileError::OutOfArea {
                    copy: layout.copy_name(part, number as u32),
                    beyond: Length::from_um((beyond_um * 10.0).round() / 10.0),
                    area_mm: area,
                });
            }
            layout.placements.push(CopyPlacement {
                part,
                turn,
                left: left as u32,
                top: top as u32,
            });
        }
        layout.check_apart()?;
        layout.command = format!("tile --area {area} --layout{}", layout.fit_option());
        Ok(layout)
    }

    /// Returns how far a copy reaches beyond the area, in micrometers; negative within it.
    fn beyond_um(&self, request: &RequestedPlacement, size: PixelSize) -> f64 {
        let right = request.left + i64::from(size.width) - i64::from(self.pixels.width);
        let bottom = request.top + i64::from(size.height) - i64::from(self.pixels.height);
        let [x_um, y_um] = self.pitch.um();
        let across = right.max(-request.left) as f64 * x_um;
        across.max(bottom.max(-request.top) as f64 * y_um)
    }

    /// Checks that no two copies overlap, sweeping from the top to the bottom.
    fn check_apart(&self) -> Result<(), TileError> {
        let silhouettes = self.silhouettes();
        let silhouette = |at: &CopyPlacement| &silhouettes[&(at.part, at.turn)];
        let bottom = |at: &CopyPlacement| at.top + silhouette(at).height();
        let mut order: Vec<usize> = (0..self.placements.len()).collect();
        order.sort_by_key(|&k| self.placements[k].top);
        let mut above: Vec<usize> = Vec::new();
        for k in order {
            let one = &self.placements[k];
            above.retain(|&l| bottom(&self.placements[l]) > one.top);
            for &l in &above {
                let other = &self.placements[l];
                let met = common_pixel([one, other].map(silhouette), [one, other]);
                if let Some(pixel) = met {
                    return Err(self.overlap([k.min(l), k.max(l)], pixel));
                }
            }
            above.push(k);
        }
        Ok(())
    }

    fn overlap(&self, copies: [usize; 2], (column, row): (u32, u32)) -> TileError {
        let numbers: Vec<u32> = self.numbers().collect();
        let [one, other] = copies.map(|k| self.copy_name(self.placements[k].part, numbers[k]));
        let [pitch_x, pitch_y] = self.pitch.mm();
        let y_mm = self.area.height.mm() - f64::from(row) * pitch_y;
        TileError::Overlap { one, other, at_mm: [f64::from(column) * pitch_x, y_mm] }
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Image, Layer, PageInfo, Pitch};

    use super::super::testing::mask_of;
    use super::*;

    /// At 25.4 dpi, one pixel is one millimeter.
    fn part(outline: bool) -> PartStack {
        let image =
            Image::Mask(mask_of(&["........", ".##.....", ".##.....", ".####...", "........"]));
        let layer =
            Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(25.4), image: image.into() };
        if outline {
            PartStack::of_outline("l.tif", std::iter::once(Ok::<_, TileError>(layer)))
                .unwrap()
                .unwrap()
        } else {
            PartStack::of_image("l.tif", &layer).unwrap()
        }
    }

    fn placed(outline: bool, requested: &[(i64, i64, &str)]) -> Result<Layout, TileError> {
        let request = |&(left, top, turn): &(i64, i64, &str)| RequestedPlacement {
            part: 0,
            turn: turn.parse().unwrap(),
            left,
            top,
        };
        let requested: Vec<RequestedPlacement> = requested.iter().map(request).collect();
        Layout::placed(vec![part(outline)], &requested, "10x10mm".parse().unwrap())
    }

    #[test]
    fn outlines_may_lie_within_each_other_s_boxes() {
        // An L of 4 x 3, and another turned by half into its corner.
        assert!(placed(true, &[(0, 1, "0"), (0, 0, "180")]).is_ok());
        let error = placed(true, &[(0, 1, "0"), (1, 1, "180")]).unwrap_err().to_string();
        assert!(
            error.contains("l.tif copy 1 and l.tif copy 2 overlap near x 1.00 y 9.00"),
            "{error}"
        );
        assert!(matches!(
            placed(false, &[(0, 0, "0"), (2, 4, "0")]),
            Err(TileError::Overlap { .. })
        ));
        assert!(placed(false, &[(0, 0, "0"), (2, 5, "0")]).is_ok());
    }

    #[test]
    fn copies_nearer_than_a_gap_are_told() {
        // A column is free between the two, and the corner of the L is 3 off diagonally.
        let near = |requested: &[(i64, i64, &str)], mm| {
            placed(true, requested).unwrap().nearer_than(Length::from_mm(mm)).len()
        };
        assert_eq!(near(&[(0, 0, "0"), (5, 0, "0")], 1.0), 0);
        assert_eq!(near(&[(0, 0, "0"), (5, 0, "0")], 1.1), 1);
        assert_eq!(near(&[(0, 0, "0"), (4, 0, "0")], 0.0), 0);
        assert_eq!(near(&[(0, 0, "0"), (4, 0, "0"), (0, 7, "0")], 4.0), 1);
        let pair = &placed(true, &[(0, 0, "0"), (4, 0, "0")])
            .unwrap()
            .nearer_than(Length::from_mm(1.0))[0];
        assert_eq!(pair.each_ref().map(ToString::to_string), ["l.tif copy 1", "l.tif copy 2"]);
    }

    #[test]
    fn what_is_off_the_area_is_named() {
        let error = placed(false, &[(0, 0, "0"), (3, 5, "0")]).unwrap_err().to_string();
        assert!(error.starts_with("l.tif copy 2 reaches 1mm beyond"), "{error}");
        assert!(placed(true, &[(6, 7, "0")]).is_ok());
        assert!(placed(true, &[(7, 6, "90")]).is_ok());
        for wrong in [(7, 0, "0"), (-1, 0, "0"), (0, 8, "0"), (0, -2, "0"), (0, 7, "90")] {
            assert!(
                matches!(placed(true, &[wrong]), Err(TileError::OutOfArea { .. })),
                "{wrong:?}"
            );
        }
    }
}
