//! The pixels that are white in a layer of a part or in one below it, for layers in any order.

use lamp_stack::{Mask, Op};

/// The number of layers after which the union is kept. Going down takes at most as many layers,
/// each a page to be decoded.
const EVERY: usize = 64;

/// The union of a part's layers, from the lowest up to one that is asked for.
#[derive(Debug)]
pub(super) struct Rising {
    /// The unions after [`EVERY`] layers, after twice as many, and so on, as far as was asked for.
    marks: Vec<Mask>,
    /// The union that was asked for last, after the number of its layers.
    last: (usize, Mask),
    none: Mask,
}

/// Why nothing rose.
#[derive(Debug)]
pub(super) enum RisingError<E> {
    /// A layer could not be read.
    Layer(E),
    /// There are more runs than an image can hold.
    TooManyRuns,
}

impl Rising {
    /// Starts below the lowest layer, of images of a size.
    pub(super) fn new(width: u32, height: u32) -> Self {
        let none = Mask::black(width, height);
        Self { marks: Vec::new(), last: (0, none.clone()), none }
    }

    /// Returns the union of the lowest `count` layers, given the white pixels of each, if it has an
    /// image.
    pub(super) fn up_to<E>(
        &mut self,
        count: usize,
        mut white: impl FnMut(usize) -> Result<Option<Mask>, E>,
    ) -> Result<Mask, RisingError<E>> {
        let (mut done, mut risen) = self.nearest(count);
        while done < count {
            if let Some(white) = white(done).map_err(RisingError::Layer)? {
                risen = white.combined(Op::Union, &risen).ok_or(RisingError::TooManyRuns)?;
            }
            done += 1;
            // Marks have no gaps: every way up begins at or below the last one.
            if done == (self.marks.len() + 1) * EVERY {
                self.marks.push(risen.clone());
            }
        }
        self.last = (count, risen.clone());
        Ok(risen)
    }

    /// Returns the largest known union of no more than `count` layers, after the number of its
    /// layers.
    fn nearest(&self, count: usize) -> (usize, Mask) {
        let marks = (count / EVERY).min(self.marks.len());
        if self.last.0 <= count && self.last.0 >= marks * EVERY {
            return self.last.clone();
        }
        match marks.checked_sub(1) {
            Some(mark) => (marks * EVERY, self.marks[mark].clone()),
            None => (0, self.none.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn unions_in_any_order_are_those_from_the_lowest_layer() {
        // Each layer is white in a pixel of its own, some in none.
        let white = |layer: usize| -> Result<Option<Mask>, Infallible> {
            let column = (layer * 37 % 300) as u32;
            let mask = Mask::new(301, vec![0, 2], vec![column, column + 1]).unwrap();
            Ok((layer % 5 != 3).then_some(mask))
        };
        let plain = |count: usize| {
            let whites = (0..count).filter_map(|layer| white(layer).unwrap());
            whites.fold(Mask::black(301, 1), |all, one| all.combined(Op::Union, &one).unwrap())
        };
        let mut rising = Rising::new(301, 1);
        for count in [200, 0, 64, 63, 65, 65, 300, 130, 128, 127, 299, 1, 300] {
            assert_eq!(rising.up_to(count, white).unwrap(), plain(count), "{count}");
        }
        // From the nearest mark, no more layers are asked for than lie between two.
        let mut asked = 0;
        let counted = |layer: usize| {
            asked += 1;
            white(layer)
        };
        rising.up_to(191, counted).unwrap();
        assert_eq!(asked, 63);
    }
}
