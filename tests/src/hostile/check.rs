//! Checks of arbitrary stacks.

use lamp_stack::{Layer, Length, Mask, MaskBuilder, Orientation, PageInfo, Pages, Pitch};
use lamp_supports::{CheckError, CheckOptions, Findings, IslandEnd};

use super::{MAX_ROWS, decoded, file_of, one_line};

/// Checks bytes as a stack, and as the pixels of a small one: columns, rows and the side of
/// squares, then eight pixels a byte. The findings fit the images, and mirrored or turned images have
/// the same findings.
///
/// # Panics
/// If that does not hold.
pub fn check(bytes: &[u8]) {
    let file = file_of(bytes);
    if let Ok(layers) = decoded(Pages::open(file.path()))
        && layers.iter().all(|layer| layer.image.height() <= MAX_ROWS)
    {
        find(&layers, &CheckOptions::default());
    }
    if let [columns, rows, side, pixels @ ..] = bytes {
        let size = [columns, rows].map(|size| u32::from(size % 24 + 1));
        let rounding = u32::from(side % 4 + 1).try_into().expect("it is not zero");
        let speck = Length::from_um(63.5 * f64::from(side % 4));
        let layers = block(size, pixels);
        find(&layers, &CheckOptions { speck, rounding, ..CheckOptions::default() });
    }
}

/// Returns layers of 63.5 um as thick as wide, with the pixels of all, at most 60.
fn block([columns, rows]: [u32; 2], pixels: &[u8]) -> Vec<Layer> {
    let area = (columns * rows) as usize;
    let bits = pixels.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 == 1));
    let bits: Vec<bool> = bits.take(60 * area).collect();
    let layers = (0..).zip(bits.chunks_exact(area));
    let layer = |(index, bits): (u32, &[bool])| {
        let thickness_um = Some(63.5);
        let info = PageInfo { index, thickness_um, ..PageInfo::default() };
        let image = mask(columns, bits).into();
        Layer { info, pitch: Pitch::of_dpi(400.0), image }
    };
    layers.map(layer).collect()
}

fn mask(columns: u32, bits: &[bool]) -> Mask {
    let mut mask = MaskBuilder::new(columns);
    for row in bits.chunks(columns as usize) {
        let changes = (0..columns).filter(|&column| {
            let at = column as usize;
            row[at] != (at > 0 && row[at - 1])
        });
        mask.push_row(&changes.collect::<Vec<_>>()).expect("columns in rising order");
    }
    mask.finish()
}

fn find(layers: &[Layer], options: &CheckOptions) {
    let found = match checked(layers.to_vec(), options) {
        Ok(found) => found,
        Err(error) => return drop(one_line(&error)),
    };
    fits(&found, layers);
    let counts = counts(&found);
    let is_wide = layers.iter().any(|layer| layer.image.width() > MAX_ROWS);
    // The columns of a wide image would be more rows than that.
    let orientations = Orientation::ALL.into_iter().filter(|to| !is_wide || to.quarters() % 2 == 0);
    for orientation in orientations {
        let turned = layers.iter().map(|layer| {
            let image = layer.image.oriented(orientation)?;
            // Another frame would be at another place.
            let info = PageInfo { origin_mm: None, ..layer.info.clone() };
            Some(Layer { info, image: image.into(), pitch: layer.pitch })
        });
        // Images with too many runs cannot be turned.
        if let Some(turned) = turned.collect::<Option<Vec<_>>>() {
            let found = checked(turned, options).expect("it was checked before");
            assert_eq!(self::counts(&found), counts, "{orientation}");
        }
    }
}

fn checked(layers: Vec<Layer>, options: &CheckOptions) -> Result<Findings, CheckError> {
    lamp_supports::check(layers.into_iter().map(Ok), Ok, options)
}

/// Checks that islands float in white, pockets lie in black, and layers are layers of the stack.
fn fits(found: &Findings, layers: &[Layer]) {
    let white: u64 = layers.iter().map(white_pixels).sum();
    let all: u64 = layers
        .iter()
        .map(|layer| u64::from(layer.image.width()) * u64::from(layer.image.height()))
        .sum();
    let islands = || found.islands.list.iter().chain(&found.specks.list);
    assert!(islands().map(|island| island.floating_pixels).sum::<u64>() <= white);
    assert!(found.pockets.list.iter().map(|pocket| pocket.pixels).sum::<u64>() <= all - white);
    assert!(found.overhangs.list.iter().map(|overhang| overhang.area).sum::<u64>() <= white);
    let layers = layers.len() as u32;
    for island in islands() {
        assert!(island.area <= island.largest_area);
        assert!(island.largest_area <= island.floating_pixels);
        let end = match island.end {
            IslandEnd::Loose => layers,
            IslandEnd::JoinsPart { layer } => layer,
            IslandEnd::JoinsIsland { layer, number } => {
                assert!(number != island.number);
                layer
            }
        };
        let floats = island.layer..end;
        assert!(end <= layers && floats.contains(&island.largest_layer), "{island:?}");
    }
}

fn white_pixels(layer: &Layer) -> u64 {
    let rows = 0..layer.image.height();
    let row =
        |row| layer.image.runs(row).map(|(start, end, _)| u64::from(end - start)).sum::<u64>();
    rows.map(row).sum()
}

/// Returns the findings that do not depend on where rows and columns begin.
fn counts(found: &Findings) -> String {
    // Which of two equal islands born in one layer goes on, and so which is a speck, depends.
    let islands = found.islands.count() + found.specks.count();
    let mut joints: Vec<_> = found
        .weak_joints
        .list
        .iter()
        .map(|joint| (joint.layer, joint.area, joint.support))
        .collect();
    joints.sort_unstable();
    let mut overhangs: Vec<_> = found
        .overhangs
        .list
        .iter()
        .map(|over| (over.layers, over.area, over.reach_squared as u64, over.reach_layer))
        .collect();
    overhangs.sort_unstable();
    let mut pockets: Vec<_> = found
        .pockets
        .list
        .iter()
        .map(|pocket| (pocket.kind, pocket.layers, pocket.pixels))
        .collect();
    pockets.sort_unstable();
    format!("{islands} {joints:?} {overhangs:?} {pockets:?}")
}
