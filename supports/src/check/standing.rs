//! White that stands on the platform, and white that floats, as layers are added.

use lamp_stack::{Mask, MaskBuilder};

use super::contact::{Labelled, LayerContact};
use super::live::{Group, Live, Next};

/// The white of the last layer: whether it stands.
pub(crate) struct Standing {
    live: Live<bool>,
    last: Option<Labelled>,
    /// For each component of the last layer, its pixels above white.
    support: Vec<u64>,
}

impl Default for Standing {
    fn default() -> Self {
        Self { live: Live::new(true), last: None, support: Vec::new() }
    }
}

impl Standing {
    /// Adds a layer. White of the first one stands on the platform; other white stands if a way
    /// through the layers so far leads down there.
    pub(crate) fn add(&mut self, mask: Mask) {
        let layer = Labelled::new(mask);
        // Only joints matter here.
        let contact = self.last.as_ref().map(|below| LayerContact::new(below, &layer, None, 1));
        let joints = contact.as_ref().map_or(&[][..], |contact| &contact.joints);
        self.support = vec![0; layer.components.all.len()];
        for joint in joints.iter().filter(|joint| layer.is_white(joint.component)) {
            self.support[joint.component as usize] += joint.pixels;
        }
        let Next { groups, .. } = self.live.add(&layer, joints);
        for Group { bodies, .. } in groups {
            self.live.put(contact.is_none() || bodies.contains(&true));
        }
        self.last = Some(layer);
    }

    /// Returns the component of the last layer that holds a pixel.
    pub(crate) fn component_at(&self, [column, row]: [u32; 2]) -> u32 {
        let layer = self.layer();
        layer.components.at(&layer.mask, column, row)
    }

    /// Returns the runs of a component of the last layer, as rows and columns from the top.
    pub(crate) fn runs(&self, component: u32) -> Vec<(u32, std::ops::Range<u32>)> {
        let layer = self.layer();
        layer.components.runs(&layer.mask, component).collect()
    }

    /// Returns whether a white component of the last layer stands.
    pub(crate) fn stands(&self, component: u32) -> bool {
        self.live.of_components().nth(component as usize).flatten() == Some(&true)
    }

    /// Returns a component's pixels that rest on white, and all of them.
    pub(crate) fn support(&self, component: u32) -> [u64; 2] {
        let area = self.layer().components.all[component as usize].area;
        [self.support[component as usize], area]
    }

    /// Lets the body of a component stand from this layer on.
    pub(crate) fn hold(&mut self, component: u32) {
        if let Some(stands) = self.live.body_mut(component) {
            *stands = true;
        }
    }

    /// Returns the last layer.
    pub(crate) fn mask(&self) -> &Mask {
        &self.layer().mask
    }

    /// Returns the white of the last layer that stands, unless all of it does.
    pub(crate) fn standing_mask(&self) -> Option<Mask> {
        let floats: Vec<bool> =
            self.live.of_components().map(|stands| stands == Some(&false)).collect();
        if !floats.contains(&true) {
            return None;
        }
        let Labelled { mask, components } = self.layer();
        let mut standing = MaskBuilder::new(mask.width());
        let mut left = Vec::new();
        for (number, row) in (0..).zip(mask.rows()) {
            left.clear();
            // White segments have odd numbers.
            for (k, &label) in components.of_row(number).iter().enumerate().skip(1).step_by(2) {
                if !floats[label as usize] {
                    left.extend(row[k - 1..].iter().take(2));
                }
            }
            standing.push_row(&left).expect("they are transitions of a row");
        }
        Some(standing.finish())
    }

    fn layer(&self) -> &Labelled {
        self.last.as_ref().expect("a layer was added")
    }
}
