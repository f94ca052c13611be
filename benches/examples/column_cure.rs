//! Plans the column cure that `column_cure.py` also gives to general solvers.
//!
//! `matrix` writes the light of every mirror on every column voxel to files of a folder, as a matrix
//! for each axis, the doses wanted, and the allowed times. `plan` finds the times of mirrors, and
//! writes them there. The shape `zhao` has the rays of Zhao (2009) and a blur in um; others have
//! Gaussian light and a blur in mirrors.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example column_cure matrix|plan FOLDER COLUMNS ROWS SHAPE BLUR
//! ```

use std::path::Path;

use lamp_planning::column::{
    Allowed, GlassLight, MirrorSpread, Setup, Stop, Tracing, nearest_times,
};

/// From one mirror to the next on the glass, in um (000: 13.65 um at 132/152).
const PITCH_UM: f64 = 11.85;
const VOXEL_UM: f64 = 10.0;
/// 000's rays: points and directions along an axis, and the power of one, in mW.
const RAYS: [usize; 2] = [9, 15];
const RAY_MW: f64 = 8.0275e-11;
/// PEGDA (000 appendix E): its critical exposure in mJ/cm2, and D_pL in um.
const CRITICAL: f64 = 11.593;
const DEPTH_UM: f64 = 302.8253;
/// The longest time of Zhao's lenses, in seconds.
const LONGEST: f64 = 300.0;
/// The share to which doses are known, and the longest time in times of a wide field.
const DOSE_ERROR: f64 = 0.03;
const WIDE_FIELDS: f64 = 3.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, folder, columns, rows, shape, blur] = arguments.as_slice() else {
        return Err("say matrix or plan, a folder, columns, rows, a shape and its blur".into());
    };
    let case = Case::of([columns.parse()?, rows.parse()?], shape, blur.parse()?)?;
    let folder = Path::new(folder);
    match what.as_str() {
        "matrix" => {
            write(&folder.join("wanted"), &case.wanted)?;
            let Allowed { max_s, evenness } = case.allowed;
            write(&folder.join("allowed"), [max_s, evenness, case.gap])?;
            write_matrix(folder, &case.light)?;
        }
        _ => {
            let stop = Stop { gap: case.gap, steps: 100_000 };
            let Case { light, wanted, allowed, .. } = &case;
            let times = nearest_times(light, wanted, *allowed, &[0.0], stop, &|| false);
            let price = times.price / times.error;
            println!("{} steps, gap {:.1e}, price {price:.1e}", times.steps, times.relative_gap());
            write(&folder.join("times"), &times.seconds)?;
        }
    }
    Ok(())
}

struct Case {
    light: GlassLight,
    wanted: Vec<f64>,
    allowed: Allowed,
    gap: f64,
}

impl Case {
    fn of(mirrors: [usize; 2], shape: &str, blur: f64) -> Result<Self, String> {
        let [points, directions] = RAYS;
        let rays = (points * directions).pow(2) as f64;
        let zhao = Setup {
            mirrors,
            display: mirrors,
            pitch_um: PITCH_UM,
            lit_um: PITCH_UM * 12.65 / 13.65,
            spread: MirrorSpread::Cone(blur),
            tracing: Tracing::Rays { points, directions },
            irradiance: rays * RAY_MW / (PITCH_UM * 1e-4).powi(2),
            flat_field: Vec::new(),
            voxels: mirrors.map(|mirrors| (mirrors as f64 * PITCH_UM / VOXEL_UM).round() as usize),
            voxel_um: VOXEL_UM,
        };
        if shape == "zhao" {
            let wanted = doses(zhao.voxels, lens_on_a_base);
            let allowed = Allowed { max_s: LONGEST, evenness: 0.0 };
            return Ok(Self { light: GlassLight::new(zhao), wanted, allowed, gap: 1e-4 });
        }
        let spread = MirrorSpread::Gaussian(blur * PITCH_UM);
        let setup = Setup { spread, tracing: Tracing::Exact, ..zhao };
        let side = setup.voxels[0].min(setup.voxels[1]) as f64 * VOXEL_UM;
        let height = height_of(shape).ok_or_else(|| format!("`{shape}` is no shape"))?;
        let wanted = doses(setup.voxels, |x, y| height(x / side, y / side));
        let highest = wanted.iter().copied().fold(0.0, f64::max);
        let columns = (setup.pitch_um / setup.voxel_um).powi(2);
        let allowed = Allowed {
            max_s: WIDE_FIELDS * highest / setup.irradiance,
            evenness: columns * (DOSE_ERROR * setup.irradiance).powi(2),
        };
        Ok(Self { light: GlassLight::new(setup), wanted, allowed, gap: 1e-3 })
    }
}

/// Returns the height in um of a shape, for places as shares of a field's side from its middle.
fn height_of(shape: &str) -> Option<fn(f64, f64) -> f64> {
    Some(match shape {
        // Nine, each 0.29 of the side wide.
        "lenses" => |x, y| {
            let from = |at: f64| at - (3.0 * at).round().clamp(-1.0, 1.0) / 3.0;
            250.0 * (1.0 - from(x).hypot(from(y)).powi(2) / 0.021).max(0.0)
        },
        "cone" => |x, y| 300.0 * (1.0 - x.hypot(y) / 0.45).max(0.0),
        "asphere" => |x, y| {
            let share = x.hypot(y) / 0.45;
            (300.0 * (1.0 - 0.7 * share.powi(2) - 0.3 * share.powi(6))).max(0.0)
        },
        "waves" => |x, y| {
            let wave = 150.0 + 100.0 * (16.0 * std::f64::consts::TAU * x).cos();
            if x.abs().max(y.abs()) < 0.45 { wave } else { 0.0 }
        },
        "rings" => |x, y| {
            let ring = (x.hypot(y) * 24.0) as usize;
            if ring % 2 == 1 && ring < 11 { 200.0 } else { 0.0 }
        },
        "channels" => |x, y| {
            let is_channel = (x * 20.0).rem_euclid(1.0) < 0.25;
            if x.abs().max(y.abs()) < 0.45 && !is_channel { 250.0 } else { 0.0 }
        },
        _ => return None,
    })
}

/// Returns the height in um of lenses 1.2 mm wide and 0.2 mm high, every 1.5 mm on a base of 0.25 mm.
fn lens_on_a_base(x: f64, y: f64) -> f64 {
    let (half, high, every) = (600.0_f64, 200.0, 1500.0);
    let radius = (half * half + high * high) / (2.0 * high);
    let from_lens = |um: f64| um - every * (um / every).round();
    let square = from_lens(x).powi(2) + from_lens(y).powi(2);
    let is_lens = square < half * half;
    250.0 + if is_lens { (radius * radius - square).sqrt() - (radius - high) } else { 0.0 }
}

/// Returns the doses that cure a height at each place in um from the middle.
fn doses([columns, rows]: [usize; 2], height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let um = |voxel: usize, count: usize| (voxel as f64 - (count as f64 - 1.0) / 2.0) * VOXEL_UM;
    let dose = |row: usize, column: usize| match height(um(column, columns), um(row, rows)) {
        height if height > 0.0 => CRITICAL * (1.0 + height / DEPTH_UM),
        _ => 0.0,
    };
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| dose(row, column))
        .collect()
}

/// Writes a matrix for each axis, mirrors by column voxels: their products are the light of mirrors.
fn write_matrix(folder: &Path, light: &GlassLight) -> std::io::Result<()> {
    let setup = light.setup();
    let [columns, rows] = setup.mirrors;
    let of = |is_on: &dyn Fn(usize) -> bool| {
        light.doses(&(0..columns * rows).map(|m| f64::from(u8::from(is_on(m)))).collect::<Vec<_>>())
    };
    let [width, height] = setup.voxels;
    let (middle, line) = (height / 2 * width + width / 2, height / 2 * width);
    // A line of mirrors lights a line of voxels by a number of that axis, times all light of the other.
    let along = (0..columns)
        .flat_map(|on| of(&|mirror| mirror % columns == on)[line..line + width].to_vec());
    write(&folder.join("along"), along)?;
    let all = of(&|_| true)[middle];
    let down = (0..rows).flat_map(|on| {
        let doses = of(&|mirror| mirror / columns == on);
        (0..height).map(move |row| doses[row * width + width / 2] / all).collect::<Vec<_>>()
    });
    write(&folder.join("down"), down)
}

fn write<N: std::borrow::Borrow<f64>>(
    path: &Path,
    numbers: impl IntoIterator<Item = N>,
) -> std::io::Result<()> {
    let bytes: Vec<u8> =
        numbers.into_iter().flat_map(|number| number.borrow().to_le_bytes()).collect();
    std::fs::write(path, bytes)
}
