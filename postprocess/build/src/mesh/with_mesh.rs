//! Surrounds the copies of a layout with a mesh.

use lamp_stack::Length;

use super::super::{CopyPlacement, Layout, PixelSize, TileError};
use super::break_lines::{BreakLines, Rect};
use super::{BuildMesh, MeshOptions, MeshRows, Moat};

impl Layout {
    /// Surrounds the copies with a mesh.
    ///
    /// # Errors
    /// Returns an error if the mesh would have no holes, no room next to
    /// the moats or more runs than an image can hold, or if moats are to follow outlines and a part
    /// was read without its outline.
    pub fn with_mesh(mut self, options: &MeshOptions) -> Result<Self, TileError> {
        let pixels = |length: Length| self.pitch.pixels(length).map(|pixels| pixels.max(0.0));
        let clearance = pixels(options.clearance);
        let longest = self.pixels.width.max(self.pixels.height);
        // A wider moat leaves no mesh. The limit also keeps pixels within u32 below.
        if clearance[0].max(clearance[1]) > f64::from(longest) {
            return Err(TileError::WideMoat { clearance: options.clearance, area_mm: self.area });
        }
        let least_piece = options.least_piece_mm2 / self.pitch.pixel_mm2();
        if least_piece > f64::from(self.pixels.width) * f64::from(self.pixels.height) {
            let least_mm2 = options.least_piece_mm2;
            return Err(TileError::LargePiece { least_mm2, area_mm: self.area });
        }
        let lattice = options.lattice(self.pitch, self.pixels)?;
        let whole =
            |length| pixels(length).map(|pixels| pixels.round().min(f64::from(longest)) as u32);
        let breaks = match whole(options.break_width) {
            width if width.contains(&0) => BreakLines::default(),
            width => {
                let area = [self.pixels.width, self.pixels.height];
                BreakLines::new(&self.places(clearance), area, width, whole(options.break_pitch))
                    .ok_or(TileError::ManyBreaks)?
            }
        };
        if options.moat == Moat::Outline
            && let Some(part) = self.parts.iter().find(|part| part.outline().is_none())
        {
            return Err(TileError::NoOutline { name: part.name().to_owned() });
        }
        let mut mesh = BuildMesh {
            lattice,
            standing: MeshRows::default(),
            clearance,
            moat: options.moat,
            least_piece: least_piece.ceil() as u64,
            base_layers: options.base_layers,
            build: self.pixels,
            changes: 0,
        };
        mesh.stand(&breaks);
        self.mesh = Some(mesh);
        self.command += &options.command();
        Ok(self)
    }

    /// Returns the boxes around the copies and their clearance.
    fn places(&self, clearance: [f64; 2]) -> Vec<Rect> {
        let [aside, above] = clearance.map(|pixels| pixels.ceil() as u32);
        let place = |at: &CopyPlacement| {
            let PixelSize { width, height } = self.parts[at.part].size(at.turn);
            Rect {
                left: at.left.saturating_sub(aside),
                top: at.top.saturating_sub(above),
                right: (at.left + width + aside).min(self.pixels.width),
                bottom: (at.top + height + above).min(self.pixels.height),
            }
        };
        self.placements.iter().map(place).collect()
    }
}
