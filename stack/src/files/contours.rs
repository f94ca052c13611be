//! Writes the outlines of layers as the contour files of other programs: SVG, CLI and DXF.

use std::fmt::{self, Display, Write as _};
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::error::StackError;
use crate::files::temporary::FileBeside;
use crate::image::Image;
use crate::image::outline::Outline;
use crate::layer::Layer;
use crate::layer::page_info::StackInfo;
use crate::ordered::map_in_order;
use crate::pitch::Pitch;

/// A format of contour files. All are text, in millimeters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContourFormat {
    /// An SVG drawing with a group for each layer, named as Slic3r names them.
    Svg,
    /// The Common Layer Interface, version 2, as ASCII.
    Cli,
    /// AutoCAD's DXF of release 12: closed polylines at the height of each layer.
    Dxf,
}

crate::named!(ContourFormat { Svg = "svg", Cli = "cli", Dxf = "dxf" });

/// Why outlines of a layer cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ContourError {
    /// Levels have no outline.
    #[error(
        "layer {layer} is gray, and contours are edges between black and white: make dots of it with dither, or white layers with slice without --gray and --antialias"
    )]
    Gray {
        /// The layer's index.
        layer: u32,
    },
    /// Pixels without a size have no place in millimeters.
    #[error(
        "layer {layer} states no resolution, and contours are in millimeters: give the stack one (lamp edit)"
    )]
    NoResolution {
        /// The layer's index.
        layer: u32,
    },
}

/// Writes the outlines of black and white layers along the edges of their pixels, as polygons:
/// counterclockwise around areas, and clockwise around holes. Areas that touch only at corners are
/// apart. Each layer is at the height of its top.
///
/// x and y are the part's coordinates, if the layers have them, or else distances from the left and
/// from the bottom. In SVG y goes down, from the image's top left corner, whose place is in
/// `data-origin-mm`.
///
/// # Errors
/// Returns the first error among the layers, or an error if a layer is gray or has no resolution, or
/// if writing fails. No file then appears under the final name.
pub fn write_contours<E>(
    layers: impl Iterator<Item = Result<Layer, E>>,
    path: &Path,
    format: ContourFormat,
) -> Result<(), E>
where
    E: From<StackError> + Display + Send,
{
    let temporary = FileBeside::new(path).map_err(StackError::from)?;
    let mut out = BufWriter::with_capacity(1 << 18, temporary.file());
    let mut write = |text: &str| out.write_all(text.as_bytes()).map_err(StackError::from);
    let mut is_first = true;
    let of_layer = |layer: Layer| {
        let contours = Contours::new(&layer)?;
        Ok((contours.text(format), contours.head(format, &layer)))
    };
    for layer in map_in_order(layers, of_layer) {
        let (text, head) = layer?;
        if std::mem::take(&mut is_first) {
            write(&head)?;
        }
        write(&text)?;
    }
    if is_first {
        return Err(StackError::NoLayers.into());
    }
    write(match format {
        ContourFormat::Svg => "</svg>\n",
        ContourFormat::Cli => "$$GEOMETRYEND\n",
        ContourFormat::Dxf => "0\nENDSEC\n0\nEOF\n",
    })?;
    out.into_inner().map_err(|error| StackError::Io(error.into_error()))?;
    Ok(temporary.persist().map_err(StackError::from)?)
}

/// The outlines of a layer.
struct Contours {
    index: u32,
    outlines: Vec<Outline>,
    size: [u32; 2],
    pitch: Pitch,
    /// x and y of the image's top left corner, if known.
    origin_mm: Option<[f64; 2]>,
    top_mm: f64,
}

impl Contours {
    fn new(layer: &Layer) -> Result<Self, StackError> {
        let index = layer.info.index;
        let Image::Mask(mask) = &*layer.image else {
            return Err(ContourError::Gray { layer: index }.into());
        };
        let pitch = layer.pitch.ok_or(ContourError::NoResolution { layer: index })?;
        let top_um = layer.info.z_um.unwrap_or(0.0) + layer.info.thickness_um.unwrap_or(0.0);
        let size = [mask.width(), mask.height()];
        let origin_mm = layer.info.origin_mm;
        Ok(Self {
            index,
            outlines: mask.outlines(),
            size,
            pitch,
            origin_mm,
            top_mm: top_um / 1000.0,
        })
    }

    /// Returns the text before the first layer.
    fn head(&self, format: ContourFormat, first: &Layer) -> String {
        let [width, height] = self.mm(self.size).map(Mm);
        match format {
            ContourFormat::Svg => {
                let place = self.origin_mm.map(|at| at.map(Mm));
                let place = place.map(|[x, y]| format!(" data-origin-mm=\"{x} {y}\""));
                let place = place.unwrap_or_default();
                format!(
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
                     <svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:slic3r=\"http://slic3r.org/namespaces/slic3r\" \
                     width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\"{place}>\n"
                )
            }
            ContourFormat::Cli => {
                let count = first.info.stack.as_ref().and_then(|StackInfo { layers, .. }| *layers);
                let count = count.map(|count| format!("$$LAYERS/{count}\n")).unwrap_or_default();
                format!(
                    "$$HEADERSTART\n$$ASCII\n$$UNITS/1\n$$VERSION/200\n{count}$$HEADEREND\n$$GEOMETRYSTART\n"
                )
            }
            ContourFormat::Dxf => {
                "999\nmillimeters\n0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n\
                 0\nSECTION\n2\nENTITIES\n"
                    .to_owned()
            }
        }
    }

    /// Returns the text of the layer.
    fn text(&self, format: ContourFormat) -> String {
        let mut text = String::new();
        let top = Mm(self.top_mm);
        match format {
            ContourFormat::Svg => {
                let index = self.index;
                let _ = writeln!(text, "  <g id=\"layer{index}\" slic3r:z=\"{top}\">");
                for outline in &self.outlines {
                    let (kind, fill) =
                        if is_hole(outline) { ("hole", "black") } else { ("contour", "white") };
                    let _ = write!(text, "    <polygon slic3r:type=\"{kind}\" points=\"");
                    for (k, corner) in outline.iter().enumerate() {
                        let [x, y] = self.mm(*corner).map(Mm);
                        let gap = if k > 0 { " " } else { "" };
                        let _ = write!(text, "{gap}{x},{y}");
                    }
                    let _ = writeln!(text, "\" style=\"fill: {fill}\"/>");
                }
                text += "  </g>\n";
            }
            ContourFormat::Cli => {
                let _ = writeln!(text, "$$LAYER/{top}");
                for outline in &self.outlines {
                    // A closed polygon ends where it starts; 1 turns left, 0 turns right.
                    let direction = u8::from(!is_hole(outline));
                    let _ = write!(text, "$$POLYLINE/1,{direction},{}", outline.len() + 1);
                    for &corner in outline.iter().chain(&outline[..1]) {
                        let [x, y] = self.place(corner).map(Mm);
                        let _ = write!(text, ",{x},{y}");
                    }
                    text.push('\n');
                }
            }
            ContourFormat::Dxf => {
                let layer = format!("8\nLAYER_{:05}", self.index);
                for outline in &self.outlines {
                    // A polyline whose corners follow (66), and which is closed (70).
                    let _ = write!(
                        text,
                        "0\nPOLYLINE\n{layer}\n66\n1\n70\n1\n10\n0\n20\n0\n30\n{top}\n"
                    );
                    for &corner in outline {
                        let [x, y] = self.place(corner).map(Mm);
                        let _ = write!(text, "0\nVERTEX\n{layer}\n10\n{x}\n20\n{y}\n30\n{top}\n");
                    }
                    let _ = write!(text, "0\nSEQEND\n{layer}\n");
                }
            }
        }
        text
    }

    /// Returns numbers of columns and rows in millimeters.
    fn mm(&self, pixels: [u32; 2]) -> [f64; 2] {
        let [x, y] = self.pitch.dpi();
        [f64::from(pixels[0]) * 25.4 / x, f64::from(pixels[1]) * 25.4 / y]
    }

    /// Returns a corner in millimeters, with y up.
    fn place(&self, corner: [u32; 2]) -> [f64; 2] {
        let [left, top] = self.origin_mm.unwrap_or([0.0, self.mm(self.size)[1]]);
        let [right, down] = self.mm(corner);
        [left + right, top - down]
    }
}

/// Returns whether an outline turns right: white is around it.
fn is_hole(outline: &Outline) -> bool {
    let next = outline.iter().cycle().skip(1);
    let sides = outline.iter().zip(next);
    let doubled =
        sides.map(|(a, b)| i64::from(b[0]) * i64::from(a[1]) - i64::from(a[0]) * i64::from(b[1]));
    doubled.sum::<i64>() < 0
}

/// A length in millimeters, written to the nanometer.
struct Mm(f64);

impl Display for Mm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:.6}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        // No zero has a sign.
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::image::gray::{GrayMask, LevelChange};
    use crate::image::mask::Mask;
    use crate::layer::page_info::PageInfo;

    /// A ring of 3 x 3 pixels around a hole, in the second layer of two.
    fn layers() -> Vec<Result<Layer, StackError>> {
        let ring = Mask::new(8, vec![0, 2, 6, 8], vec![1, 4, 1, 2, 3, 4, 1, 4]).unwrap();
        let layer = |index, mask: Mask| Layer {
            info: PageInfo {
                index,
                z_um: Some(f64::from(index) * 50.0),
                thickness_um: Some(50.0),
                origin_mm: Some([-1.0, 2.0]),
                ..PageInfo::default()
            },
            pitch: Pitch::of_dpi(254.0),
            image: Image::from(mask).into(),
        };
        vec![Ok(layer(0, Mask::black(8, 3))), Ok(layer(1, ring))]
    }

    fn written(format: ContourFormat) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        write_contours(layers().into_iter(), &path, format).unwrap();
        fs::read_to_string(path).unwrap()
    }

    #[test]
    fn cli_has_areas_and_holes_in_millimeters() {
        let text = written(ContourFormat::Cli);
        let body = text.split("$$GEOMETRYSTART\n").nth(1).unwrap();
        assert_eq!(
            body,
            "$$LAYER/0.05\n$$LAYER/0.1\n\
             $$POLYLINE/1,1,5,-0.9,2,-0.9,1.7,-0.6,1.7,-0.6,2,-0.9,2\n\
             $$POLYLINE/1,0,5,-0.7,1.9,-0.7,1.8,-0.8,1.8,-0.8,1.9,-0.7,1.9\n\
             $$GEOMETRYEND\n"
        );
        assert!(text.starts_with("$$HEADERSTART\n$$ASCII\n$$UNITS/1\n"));
    }

    #[test]
    fn svg_and_dxf_have_a_polygon_for_each_outline() {
        let svg = written(ContourFormat::Svg);
        assert!(svg.contains(
            "width=\"0.8mm\" height=\"0.3mm\" viewBox=\"0 0 0.8 0.3\" data-origin-mm=\"-1 2\">"
        ));
        assert!(svg.contains("<g id=\"layer1\" slic3r:z=\"0.1\">"));
        let contour = "<polygon slic3r:type=\"contour\" points=\"0.1,0 0.1,0.3 0.4,0.3 0.4,0\"";
        assert!(svg.contains(contour), "{svg}");
        assert_eq!(svg.matches("slic3r:type=\"hole\"").count(), 1);
        let dxf = written(ContourFormat::Dxf);
        assert_eq!(dxf.matches("\nPOLYLINE\n8\nLAYER_00001\n").count(), 2);
        assert_eq!(dxf.matches("\nVERTEX\n").count(), 8);
        assert!(dxf.ends_with("0\nENDSEC\n0\nEOF\n"));
    }

    #[test]
    fn gray_layers_and_layers_without_resolution_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.svg");
        let refused = |change: fn(&mut Layer)| {
            let layers = layers().into_iter().map(|layer| {
                let mut layer = layer?;
                change(&mut layer);
                Ok::<_, StackError>(layer)
            });
            write_contours(layers, &path, ContourFormat::Svg).unwrap_err().to_string()
        };
        assert!(refused(|layer| layer.pitch = None).contains("layer 0 states no resolution"));
        let gray = |layer: &mut Layer| {
            let change = LevelChange { column: 1, level: 7 };
            let gray = GrayMask::from_changes(8, vec![0, 1], vec![change]).unwrap();
            layer.image = Image::from(gray).into();
        };
        assert!(refused(gray).contains("layer 0 is gray"));
        assert!(!path.exists());
    }
}
