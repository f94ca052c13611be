//! The colors of overlays.

use crate::overlay::Overlay;

/// The colors of copies. A search found these six: they are apart from each other, from black and
/// white, and from findings and stray rows, which are seen on them, also for eyes that lack the
/// cones for red, green or blue.
pub(crate) const OF_COPIES: [[u8; 3]; 6] = [
    [0x99, 0xbb, 0xdd],
    [0xff, 0xdd, 0x33],
    [0x99, 0x33, 0xdd],
    [0x99, 0xff, 0xbb],
    [0xbb, 0x99, 0x55],
    [0xbb, 0x77, 0xff],
];

impl Overlay {
    /// The overlay's colors: red, green and blue of each.
    ///
    /// A search among strong colors found the colors of all but copies: they are far apart from each
    /// other, and from black and white, also for eyes that lack the cones for red, green or blue.
    pub fn colours(self) -> &'static [[u8; 3]] {
        match self {
            Self::Below => &[[0xaa, 0x99, 0xff]],
            Self::New => &[[0x33, 0x99, 0x00]],
            Self::Added => &[[0x88, 0xff, 0x11]],
            Self::Missing => &[[0x11, 0x33, 0xff]],
            Self::Fixed => &[[0x33, 0x55, 0x00]],
            Self::Stray => &[[0xff, 0x77, 0x99]],
            Self::Copies => &OF_COPIES,
            Self::Findings => &[[0x99, 0x00, 0x66]],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Matrix = [[f64; 3]; 3];

    /// Color vision with all cones, and without one kind of them: protanopia, deuteranopia and
    /// tritanopia, on linear light. Source: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, *A
    /// physiologically-based model for simulation of color vision deficiency*, 2009, severity 1.
    const EYES: [Matrix; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ],
    ];

    /// From sRGB's linear light to CIE XYZ under D65.
    const XYZ: Matrix = [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ];
    const WHITE: [f64; 3] = [0.95047, 1.0, 1.08883];

    fn times(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// Returns CIE L*a*b* of a color as an eye sees it.
    fn lab(colour: [u8; 3], eye: &Matrix) -> [f64; 3] {
        let linear = colour.map(|level| {
            let level = f64::from(level) / 255.0;
            if level <= 0.04045 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
        });
        let seen = times(eye, linear).map(|light| light.clamp(0.0, 1.0));
        let [x, y, z] = times(&XYZ, seen);
        let f = |share: f64| {
            if share > 216.0 / 24389.0 {
                share.cbrt()
            } else {
                (24389.0 / 27.0 * share + 16.0) / 116.0
            }
        };
        let [x, y, z] = [f(x / WHITE[0]), f(y / WHITE[1]), f(z / WHITE[2])];
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// CIEDE2000. Source: G. Sharma, W. Wu, E. N. Dalal, *The CIEDE2000 color-difference formula:
    /// implementation notes, supplementary test data, and mathematical observations*, 2005.
    fn difference(one: [f64; 3], other: [f64; 3]) -> f64 {
        let pull = |chroma: f64| (chroma.powi(7) / (chroma.powi(7) + 25f64.powi(7))).sqrt();
        let mean = (one[1].hypot(one[2]) + other[1].hypot(other[2])) / 2.0;
        let g = 0.5 * (1.0 - pull(mean));
        let polar = |[l, a, b]: [f64; 3]| {
            let a = a * (1.0 + g);
            (l, a.hypot(b), b.atan2(a).to_degrees().rem_euclid(360.0))
        };
        let ((l1, c1, h1), (l2, c2, h2)) = (polar(one), polar(other));
        let gray = c1 * c2 == 0.0;
        let turn = if gray { 0.0 } else { (h2 - h1 + 180.0).rem_euclid(360.0) - 180.0 };
        let hue = 2.0 * (c1 * c2).sqrt() * (turn / 2.0).to_radians().sin();
        let (l, c) = (f64::midpoint(l1, l2), f64::midpoint(c1, c2));
        let h = if gray { h1 + h2 } else { (h1 + turn / 2.0).rem_euclid(360.0) };
        let wave = |factor: f64, shift: f64| (factor * h + shift).to_radians().cos();
        let t = 1.0 - 0.17 * wave(1.0, -30.0) + 0.24 * wave(2.0, 0.0) + 0.32 * wave(3.0, 6.0)
            - 0.20 * wave(4.0, -63.0);
        let from_50 = (l - 50.0).powi(2);
        let dl = (l2 - l1) / (1.0 + 0.015 * from_50 / (20.0 + from_50).sqrt());
        let dc = (c2 - c1) / (1.0 + 0.045 * c);
        let dh = hue / (1.0 + 0.015 * c * t);
        let around = 30.0 * (-((h - 275.0) / 25.0).powi(2)).exp();
        let twist = -2.0 * pull(c) * (2.0 * around).to_radians().sin();
        (dl * dl + dc * dc + dh * dh + twist * dc * dh).sqrt()
    }

    #[test]
    fn differences_are_those_of_the_published_pairs() {
        let pairs = [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0009], 7.1792),
            ([2.0776, 0.0795, -1.135], [0.9033, -0.0636, -0.5514], 0.9082),
        ];
        for (one, other, published) in pairs {
            assert!((difference(one, other) - published).abs() < 1e-4, "{one:?} {other:?}");
        }
    }

    /// Checks that each two colors differ by more than `least`, for every eye. A difference of 2 to 3
    /// is just visible side by side.
    fn are_apart(colours: &[[u8; 3]], least: f64) {
        for eye in &EYES {
            for (index, &one) in colours.iter().enumerate() {
                for &other in &colours[..index] {
                    let apart = difference(lab(one, eye), lab(other, eye));
                    assert!(apart > least, "{one:x?} and {other:x?} are {apart:.1} apart");
                }
            }
        }
    }

    #[test]
    fn overlays_are_told_apart_in_colour_blindness() {
        let overlays = Overlay::ALL.into_iter().filter(|&overlay| overlay != Overlay::Copies);
        let mut colours: Vec<_> = overlays.flat_map(Overlay::colours).copied().collect();
        colours.extend([[0; 3], [255; 3]]);
        are_apart(&colours, 20.0);
    }

    #[test]
    fn copies_are_told_apart_in_colour_blindness() {
        let faults = [Overlay::Stray, Overlay::Findings].map(Overlay::colours).concat();
        are_apart(&[&OF_COPIES[..], &faults, &[[0; 3], [255; 3]]].concat(), 12.0);
    }
}
