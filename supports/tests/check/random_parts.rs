//! Parts at random: plates, posts, tubes, boxes with a wall, holes along each axis, roofs.

use super::referee::Block;

const SIZE: [usize; 3] = [19, 17, 14];

/// SplitMix64 (G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number generators*, 2014).
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end as u64) as usize
    }

    /// Returns a first place and an end within a length, `least` apart or more.
    fn span(&mut self, length: usize, least: usize) -> [usize; 2] {
        let first = self.below(length - least + 1);
        [first, first + least + self.below(length - first - least + 1)]
    }
}

/// Returns the part of a number.
pub(crate) fn random_part(seed: u64) -> Block {
    let mut dice = Dice(seed);
    let mut white = vec![false; SIZE.iter().product()];
    let thickness_um = vec![100.0; SIZE[2]];
    let mut block = Block { size: SIZE, white: Vec::new(), pitch_um: [125.0; 2], thickness_um };
    let mut paint = |shape: [[usize; 2]; 3], color: bool| {
        for (voxel, white) in white.iter_mut().enumerate() {
            let place = block.place(voxel);
            if (0..3).all(|k| (shape[k][0]..shape[k][1]).contains(&place[k])) {
                *white = color;
            }
        }
    };
    // A plate, often.
    if dice.below(3) > 0 {
        let [columns, rows] = [SIZE[0], SIZE[1]].map(|length| dice.span(length, length / 2));
        paint([columns, rows, [0, 1 + dice.below(3)]], true);
    }
    for _ in 0..2 + dice.below(6) {
        let least = [3, 3, 2];
        let mut shape = [0, 1, 2].map(|k| dice.span(SIZE[k], least[k]));
        match dice.below(6) {
            // A block anywhere, and one from the platform.
            0 => paint(shape, true),
            1 => {
                shape[2][0] = 0;
                paint(shape, true);
            }
            // A box with walls, of which one side, or none, is open.
            k @ (2 | 3) => {
                shape[2][0] *= k - 2;
                paint(shape, true);
                let mut inside = shape.map(|[first, end]| [first + 1, (end - 1).max(first + 1)]);
                let open = dice.below(8).max(4 * dice.below(2));
                if open < 6 {
                    inside[open / 2][open % 2] = shape[open / 2][open % 2];
                }
                paint(inside, false);
            }
            // A hole along an axis, blind or through.
            4 => {
                let axis = dice.below(3);
                for k in (0..3).filter(|&k| k != axis) {
                    shape[k][1] = shape[k][1].min(shape[k][0] + 1 + dice.below(4));
                }
                if dice.below(2) == 0 {
                    shape[axis] = [0, SIZE[axis]];
                }
                paint(shape, false);
            }
            // A thin wall, or an empty layer.
            _ => match dice.below(8) {
                0 => {
                    let layer = 1 + dice.below(SIZE[2] - 1);
                    paint([[0, SIZE[0]], [0, SIZE[1]], [layer, layer + 1]], false);
                }
                k => {
                    shape[k % 2][1] = shape[k % 2][0] + 1;
                    paint(shape, true);
                }
            },
        }
    }
    // What rounding leaves.
    for _ in 0..dice.below(12) {
        let voxel = dice.below(white.len());
        white[voxel] = !white[voxel];
    }
    block.white = white;
    block
}
