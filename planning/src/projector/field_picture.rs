//! Light over a field, from a picture of it.

use thiserror::Error;

use crate::target::GrayPicture;

/// The light over a field, from a picture: each place as a share of the mean. Row 0 is the upper edge,
/// as in images.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldPicture {
    columns: usize,
    rows: usize,
    shares: Vec<f64>,
}

/// A picture that shows no light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("all black: it shows no light")]
pub struct NoFieldLight;

impl FieldPicture {
    /// Reads gray levels as light, proportionally.
    ///
    /// # Errors
    /// Returns an error if the picture is all black.
    pub fn of(picture: &GrayPicture) -> Result<Self, NoFieldLight> {
        let shares = picture.levels.iter().map(|&level| f64::from(level)).collect();
        Self { columns: picture.columns, rows: picture.rows, shares }.even()
    }

    /// Returns the pixels of a row, and the rows.
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Returns the share of each pixel of a row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.shares[row * self.columns..][..self.columns]
    }

    /// Returns the same field by other pixels, edge to edge. Along each axis, a pixel is the mean of
    /// the picture's pixels, by a triangle of weights around the pixel's middle. To each side it is as wide
    /// as the wider one of both kinds of pixels, so that it interpolates coarse pictures, and averages fine
    /// ones.
    ///
    /// # Errors
    /// Returns an error if all pixels are without light.
    pub fn resampled(&self, [columns, rows]: [usize; 2]) -> Result<Self, NoFieldLight> {
        let (along, down) = (triangles(self.columns, columns), triangles(self.rows, rows));
        let mean = |taps: &Taps, share: &dyn Fn(usize) -> f64| -> f64 {
            (taps.first..).zip(&taps.weights).map(|(at, weight)| weight * share(at)).sum()
        };
        let lines: Vec<f64> = (0..self.rows)
            .flat_map(|row| along.iter().map(move |taps| mean(taps, &|at| self.row(row)[at])))
            .collect();
        let shares = down.iter().flat_map(|taps| {
            let lines = &lines;
            (0..columns).map(move |column| mean(taps, &|at| lines[at * columns + column]))
        });
        Self { columns, rows, shares: shares.collect() }.even()
    }

    /// Divides by the mean.
    fn even(mut self) -> Result<Self, NoFieldLight> {
        let mean = self.shares.iter().sum::<f64>() / self.shares.len() as f64;
        if !(mean > 0.0 && mean.is_finite()) {
            return Err(NoFieldLight);
        }
        self.shares.iter_mut().for_each(|share| *share /= mean);
        Ok(self)
    }
}

/// The weights of a pixel: the first place that has one, and all from there on.
struct Taps {
    first: usize,
    weights: Vec<f64>,
}

/// Returns the weights of `from` places along an axis in each of `to` places.
fn triangles(from: usize, to: usize) -> Vec<Taps> {
    let pitch = from as f64 / to as f64;
    let half = pitch.max(1.0);
    let place = |place: usize| {
        let middle = (place as f64 + 0.5) * pitch;
        let first = (middle - half).floor().max(0.0) as usize;
        let last = ((middle + half).ceil() as usize).min(from);
        let weight = |at: usize| (1.0 - (at as f64 + 0.5 - middle).abs() / half).max(0.0);
        let weights: Vec<f64> = (first..last).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        Taps { first, weights: weights.iter().map(|weight| weight / sum).collect() }
    };
    (0..to).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(columns: usize, levels: &[u16]) -> FieldPicture {
        let (rows, levels) = (levels.len() / columns, levels.to_vec());
        FieldPicture::of(&GrayPicture { columns, rows, levels }).unwrap()
    }

    /// Returns what Pillow 13 makes of a picture of floats by `resize` with `BILINEAR`, divided by the
    /// mean.
    #[track_caller]
    fn assert_shares(found: &FieldPicture, pillow: &[f64]) {
        assert_eq!(found.shares.len(), pillow.len());
        let mean = pillow.iter().sum::<f64>() / pillow.len() as f64;
        for (at, (found, pillow)) in found.shares.iter().zip(pillow).enumerate() {
            assert!((found - pillow / mean).abs() < 1e-6, "{at}: {found} {}", pillow / mean);
        }
    }

    #[test]
    fn resampling_is_that_of_pillow() {
        let levels = [
            40576, 48495, 2336, 48668, 28662, 31404, 38183, 17862, 58791, 4181, 17397, 23618,
            34699, 25099, 8732, 3671, 1059, 3876, 9780, 59951,
        ];
        let field = picture(5, &levels);
        let coarse = [34548.059, 31588.109, 28284.340, 26591.068, 9316.005, 23405.438];
        assert_shares(&field.resampled([2, 3]).unwrap(), &coarse);
        let fine = [
            40576.000, 45101.145, 35306.715, 2336.000, 35430.285, 40094.000, 28662.000, 31404.000,
            35277.715, 32377.000, 17862.000, 47097.000, 35386.715, 4181.000, 17397.000, 20951.857,
            26784.000, 34699.000, 27841.857, 18084.572, 8732.000, 3671.000, 2178.428, 1863.857,
            3876.000, 8093.143, 31281.857, 59951.000,
        ];
        assert_shares(&field.resampled([7, 4]).unwrap(), &fine);
        let same = levels.map(f64::from);
        assert_shares(&field.resampled([5, 4]).unwrap(), &same);
    }

    #[test]
    fn a_plane_of_light_stays_a_plane() {
        let plane = |columns: usize, rows: usize| -> Vec<u16> {
            let level = |at: usize| {
                let [x, y] = [at % columns, at / columns].map(|at| at as f64 + 0.5);
                (20_000.0 + 12_000.0 * x / columns as f64 - 6_000.0 * y / rows as f64) as u16
            };
            (0..columns * rows).map(level).collect()
        };
        let shares = picture(300, &plane(300, 200)).resampled([60, 50]).unwrap();
        let expected = picture(60, &plane(60, 50));
        // Edges have half of their triangle.
        for row in 1..49 {
            for (found, expected) in shares.row(row)[1..59].iter().zip(&expected.row(row)[1..59]) {
                assert!((found - expected).abs() < 1e-4, "{row}: {found} {expected}");
            }
        }
        assert_eq!(shares.size(), [60, 50]);
    }

    #[test]
    fn shares_are_of_the_mean() {
        let field = picture(2, &[0, 1000, 2000, 5000]);
        assert_eq!(field.shares, [0.0, 0.5, 1.0, 2.5]);
        let black = GrayPicture { columns: 3, rows: 1, levels: vec![0; 3] };
        assert_eq!(FieldPicture::of(&black), Err(NoFieldLight));
    }
}
