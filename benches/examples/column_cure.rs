//! Plans the column cure that `column_cure.py` also gives to general solvers.
//!
//! `matrix` writes the light of every mirror on every column voxel to files of a folder, found by
//! lighting mirrors that lie too far apart to meet, and the doses wanted. `plan` finds the times of
//! mirrors, and writes them there.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example column_cure matrix|plan FOLDER COLUMNS ROWS CONE_UM
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
/// No mirror is on for longer, in seconds.
const LONGEST: f64 = 300.0;
/// Mirrors so far apart light no voxel together.
const APART: usize = 16;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, folder, columns, rows, cone] = arguments.as_slice() else {
        return Err("say matrix or plan, a folder, columns, rows and the cone in um".into());
    };
    let setup = setup([columns.parse()?, rows.parse()?], cone.parse()?);
    let (folder, wanted) = (Path::new(folder), lenses(setup.voxels));
    let light = GlassLight::new(setup);
    match what.as_str() {
        "matrix" => {
            write(&folder.join("wanted"), &wanted)?;
            write_matrix(folder, &light)?;
        }
        _ => {
            let allowed = Allowed { max_s: LONGEST, evenness: 0.0 };
            let stop = Stop { gap: 1e-4, steps: 100_000 };
            let times = nearest_times(&light, &wanted, allowed, &[0.0], stop, &|| false);
            println!("{} steps", times.steps);
            write(&folder.join("times"), &times.seconds)?;
        }
    }
    Ok(())
}

fn setup(mirrors: [usize; 2], cone_um: f64) -> Setup {
    let [points, directions] = RAYS;
    let rays = (points * directions).pow(2) as f64;
    Setup {
        mirrors,
        display: mirrors,
        pitch_um: PITCH_UM,
        lit_um: PITCH_UM * 12.65 / 13.65,
        spread: MirrorSpread::Cone(cone_um),
        tracing: Tracing::Rays { points, directions },
        irradiance: rays * RAY_MW / (PITCH_UM * 1e-4).powi(2),
        flat_field: Vec::new(),
        voxels: mirrors.map(|mirrors| (mirrors as f64 * PITCH_UM / VOXEL_UM).round() as usize),
        voxel_um: VOXEL_UM,
    }
}

/// Returns the doses of lenses 1.2 mm wide and 0.2 mm high, every 1.5 mm on a base of 0.25 mm.
fn lenses([columns, rows]: [usize; 2]) -> Vec<f64> {
    let (half, high, every) = (600.0_f64, 200.0, 1500.0);
    let radius = (half * half + high * high) / (2.0 * high);
    let from_lens = |voxel: usize, count: usize| {
        let um = (voxel as f64 - (count as f64 - 1.0) / 2.0) * VOXEL_UM;
        um - every * (um / every).round()
    };
    let dose = |row: usize, column: usize| {
        let square = from_lens(column, columns).powi(2) + from_lens(row, rows).powi(2);
        let is_lens = square < half * half;
        let lens = if is_lens { (radius * radius - square).sqrt() - (radius - high) } else { 0.0 };
        CRITICAL * (1.0 + (250.0 + lens) / DEPTH_UM)
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| dose(row, column))).collect()
}

/// Writes the matrix by columns: `starts` of each mirror's entries, their `voxels` and `weights`.
fn write_matrix(folder: &Path, light: &GlassLight) -> std::io::Result<()> {
    let setup = light.setup();
    let [columns, rows] = setup.mirrors;
    let mut entries = vec![Vec::new(); columns * rows];
    for comb in 0..APART * APART {
        let teeth = [comb % APART, comb / APART];
        let is_on = |mirror: usize| {
            mirror % columns % APART == teeth[0] && mirror / columns % APART == teeth[1]
        };
        let on: Vec<_> = (0..columns * rows).map(|m| f64::from(u8::from(is_on(m)))).collect();
        for (voxel, weight) in light.doses(&on).into_iter().enumerate().filter(|&(_, w)| w > 0.0) {
            let [x, y] = [voxel % setup.voxels[0], voxel / setup.voxels[0]];
            let mirror = [nearest(x, teeth[0], 0, setup), nearest(y, teeth[1], 1, setup)];
            entries[mirror[1] * columns + mirror[0]].push((voxel, weight));
        }
    }
    let mut count = 0;
    let ends = entries.iter().map(|entries| {
        count += entries.len();
        count as f64
    });
    let starts: Vec<_> = std::iter::once(0.0).chain(ends).collect();
    let entries: Vec<_> = entries.into_iter().flatten().collect();
    write(&folder.join("starts"), &starts)?;
    write(&folder.join("voxels"), entries.iter().map(|&(voxel, _)| voxel as f64))?;
    write(&folder.join("weights"), entries.iter().map(|&(_, weight)| weight))
}

/// Returns which mirror of a comb lies nearest to a voxel along an axis.
fn nearest(voxel: usize, tooth: usize, axis: usize, setup: &Setup) -> usize {
    let middle = |count: usize| (count as f64 - 1.0) / 2.0;
    let um = (voxel as f64 - middle(setup.voxels[axis])) * VOXEL_UM;
    let mirror = um / PITCH_UM + middle(setup.mirrors[axis]);
    let teeth = (tooth..setup.mirrors[axis]).step_by(APART);
    let far = |&tooth: &usize| (tooth as f64 - mirror).abs();
    teeth.min_by(|a, b| far(a).total_cmp(&far(b))).expect("combs have teeth")
}

fn write<N: std::borrow::Borrow<f64>>(
    path: &Path,
    numbers: impl IntoIterator<Item = N>,
) -> std::io::Result<()> {
    let bytes: Vec<u8> =
        numbers.into_iter().flat_map(|number| number.borrow().to_le_bytes()).collect();
    std::fs::write(path, bytes)
}
