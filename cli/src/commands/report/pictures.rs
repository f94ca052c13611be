//! Pictures within a page.

use lamp_stack::{Layer, Pitch};
use serde::{Deserialize, Serialize};

use lamp_plots::{EvidencePicture, Picture, PictureRegion, PictureScale, StackViews};

use crate::output::base64::base64;

/// The longer side of a layer on the sheet, in pixels.
const SIDE: u32 = 260;

/// A PNG as the address of an image, and its caption.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::commands) struct InlinePicture {
    pub(in crate::commands) address: String,
    pub(in crate::commands) caption: String,
}

/// Draws a layer. An image without pixels has none.
pub(in crate::commands) fn of_layer(layer: &Layer) -> InlinePicture {
    let region = PictureRegion::of(&layer.image);
    let mut png = Vec::new();
    if !region.columns.is_empty() && !region.rows.is_empty() {
        let aspect = layer.pitch.map_or(1.0, Pitch::aspect);
        let scale = PictureScale::fitting(&region, SIDE, aspect);
        let picture = Picture::new(&layer.image, region, scale, aspect);
        let written = picture.write_png(&mut png);
        written.expect("memory takes all");
    }
    InlinePicture { address: address(&png), caption: layer.info.name() }
}

/// Draws a stack from above, from the front and from the right.
pub(super) fn of_views(views: &StackViews) -> Vec<InlinePicture> {
    let picture = |name: &str, picture: Picture<'_>| {
        let mut png = Vec::new();
        picture.write_png(&mut png).expect("memory takes all");
        InlinePicture { address: address(&png), caption: name.to_owned() }
    };
    vec![
        picture("from above", views.above()),
        picture("from the front", views.front()),
        picture("from the right", views.right()),
    ]
}

/// Draws a finding.
pub(super) fn of_finding(picture: EvidencePicture<'_>) -> InlinePicture {
    let mut png = Vec::new();
    picture.write_png(&mut png).expect("memory takes all");
    InlinePicture { address: address(&png), caption: String::new() }
}

fn address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(png))
}
