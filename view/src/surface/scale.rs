//! Where the pixels and layers of a stack lie.

use lamp_stack::PageHeader;

use super::{SurfaceError, SurfaceUnit};

/// Heights and thicknesses in micrometers beyond this are wrong: no machine builds a kilometer.
const MAX_UM: f64 = 1e9;

/// Where the pixels and layers of a stack lie.
#[derive(Debug)]
pub(super) struct StackScale {
    pub(super) unit: SurfaceUnit,
    /// How wide and how high a pixel is.
    pub(super) pitch: [f64; 2],
    /// The left and upper sides of the images.
    pub(super) corner: [f64; 2],
    /// The bottom and top of each layer. No layer reaches into the next.
    pub(super) heights: Vec<[f64; 2]>,
}

impl StackScale {
    /// Returns the shorter side of a pixel, in which cells are as high as wide.
    pub(super) fn short_side(&self) -> f64 {
        self.pitch[0].min(self.pitch[1])
    }

    /// Returns where the pixels of pages lie whose highest has this many rows.
    pub(super) fn of(pages: &[PageHeader], rows: u32) -> Result<Self, SurfaceError> {
        let corner = [0.0, f64::from(rows)];
        match in_millimetres(pages, rows)? {
            Some(scale) => Ok(scale),
            None => Ok(Self {
                unit: SurfaceUnit::Pixels,
                pitch: [1.0; 2],
                corner,
                heights: (0..pages.len()).map(|k| [k as f64, k as f64 + 1.0]).collect(),
            }),
        }
    }
}

/// Returns the scale in millimeters, if the pages state their resolution and heights.
fn in_millimetres(pages: &[PageHeader], rows: u32) -> Result<Option<StackScale>, SurfaceError> {
    let Some(pitch) = pages[0].pitch else { return Ok(None) };
    let Some(heights) = heights_um(pages) else { return Ok(None) };
    let pitch_mm = pitch.mm();
    let origin = pages[0].info.origin_mm;
    for page in pages {
        let moved = match (page.info.origin_mm, origin) {
            (Some(here), Some(first)) => {
                // A NaN is not near either.
                !(0..2).all(|axis| (here[axis] - first[axis]).abs() <= pitch_mm[axis] / 2.0)
            }
            (here, first) => here.is_some() != first.is_some(),
        };
        if moved || page.pitch != Some(pitch) {
            return Err(SurfaceError::Unlike { layer: page.info.index });
        }
    }
    check_order(pages, &heights)?;
    let tops = heights.iter().skip(1).map(|[next, _]| *next).chain([f64::INFINITY]);
    let heights = heights.iter().zip(tops);
    Ok(Some(StackScale {
        unit: SurfaceUnit::Millimetres,
        pitch: pitch_mm,
        corner: origin.unwrap_or([0.0, f64::from(rows) * pitch_mm[1]]),
        // A thickness that reaches into the next layer, by rounding or by error, would count twice.
        heights: heights.map(|([z, top], next)| [z / 1e3, top.min(next) / 1e3]).collect(),
    }))
}

/// Returns the bottom and top of each layer in micrometers, if all are known. A layer without a
/// thickness reaches up to the next; the last is as thick as the one before it.
fn heights_um(pages: &[PageHeader]) -> Option<Vec<[f64; 2]>> {
    let bottoms: Vec<f64> = pages.iter().map(|page| page.info.z_um).collect::<Option<_>>()?;
    let gap = |k: usize| Some(bottoms.get(k + 1)? - bottoms[k]);
    let height = |(k, page): (usize, &PageHeader)| {
        let thickness = page.info.thickness_um.or_else(|| gap(k));
        let thickness = thickness.or_else(|| k.checked_sub(1).and_then(gap))?;
        Some([bottoms[k], bottoms[k] + thickness])
    };
    pages.iter().enumerate().map(height).collect()
}

/// Checks that heights are finite and go up.
fn check_order(pages: &[PageHeader], heights: &[[f64; 2]]) -> Result<(), SurfaceError> {
    let mut before = -MAX_UM;
    for (page, &[bottom, top]) in pages.iter().zip(heights) {
        let goes_up = bottom > before && top > bottom && top < MAX_UM;
        if !goes_up {
            return Err(SurfaceError::Heights { layer: page.info.index });
        }
        before = bottom;
    }
    Ok(())
}
