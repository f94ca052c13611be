//! Places points of cells and blocks: sums of x, y and 1.

/// The sums that are x and y.
pub(super) type Rows = [[f64; 3]; 2];

pub(super) const IDENTITY: Rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

pub(super) fn at(rows: &Rows, [x, y]: [f64; 2]) -> [f64; 2] {
    rows.map(|row| row[0] * x + row[1] * y + row[2])
}

/// Returns the sums that apply `inner` first.
pub(super) fn placed(rows: &Rows, inner: &Rows) -> Rows {
    rows.map(|[a, b, c]| {
        let mut sum: [f64; 3] = std::array::from_fn(|k| a * inner[0][k] + b * inner[1][k]);
        sum[2] += c;
        sum
    })
}

/// Returns the sine and cosine of an angle, which are exact for quarter turns.
pub(super) fn sin_cos(degrees: f64) -> (f64, f64) {
    // Sine and cosine of 90° in radians are not exactly 1 and 0.
    let quarters = (degrees / 90.0).round();
    let (mut sin, mut cos) = (degrees - 90.0 * quarters).to_radians().sin_cos();
    for _ in 0..quarters.rem_euclid(4.0) as u32 {
        (sin, cos) = (cos, -sin);
    }
    (sin, cos)
}
