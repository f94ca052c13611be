//! Parts copies that overlap, by guided local search.

use super::board::{Board, PlacedCopy};
use super::random::Random;

/// Tries without an improvement before the best is taken up again, and how often.
const PATIENCE: u32 = 60;
const STRIKES: u32 = 3;

/// Moves copies until none overlap, or gives up. Returns whether none do; if some do, the board is
/// as it was when they overlapped least.
pub(super) fn separate(board: &mut Board, random: &mut Random, most_work: u64) -> bool {
    board.weights.fill(1.0);
    let mut least = board.overlap();
    let mut best: Vec<PlacedCopy> = board.copies.clone();
    let mut order: Vec<usize> = (0..board.copies.len()).collect();
    for _ in 0..STRIKES {
        let before = least;
        let mut idle = 0;
        while idle < PATIENCE && least > 0 && board.work < most_work {
            random.shuffle(&mut order);
            for &copy in &order {
                if board.overlaps(copy) {
                    board.relocate(copy, random);
                }
            }
            let overlap = board.overlap();
            if overlap < least {
                // Ever smaller gains would never end: only 2 % and more renew the patience.
                if overlap * 50 < least * 49 {
                    idle = 0;
                }
                least = overlap;
                best.clone_from(&board.copies);
            } else {
                idle += 1;
            }
            board.weigh();
        }
        board.set(&best);
        if least == 0 || board.work >= most_work || least * 50 > before * 49 {
            break;
        }
    }
    least == 0
}
