//! Plans the problems that `planners.py` gives to solvers of linear programs.
//!
//! Writes the wanted voxels of a problem, 0 or 1, to a file of a folder, one byte a voxel, layer
//! by layer from the light, and prints a line of its numbers. Plans it so many times, and prints
//! what the plan costs and its bound.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example planners FOLDER PROBLEM REPEATS
//! ```

use std::path::Path;

use lamp_fixtures::{Voxels, cavity_staircase, dna_helix};
use lamp_grayscale::resin::{Dose, Intensity};
use lamp_planning::solver::{Operator, Shape};
use lamp_planning::voxels::{Options, Outcome, VoxelPlanError, Window, plan};
use lamp_planning::{Blur, IntensityOf, LayerLight, Light, SampleHeight};
use lamp_stack::{Layer, Length, MaskBuilder, PageInfo, Pitch};

/// A crop of a part, and its light.
struct Problem {
    name: &'static str,
    part: Voxels,
    /// First column, row and layer (from the bottom), and as many.
    first: [usize; 3],
    size: [usize; 3],
    /// In pixels.
    sigma: f64,
    /// Light that passes a layer is 10 to the minus this.
    fade: f64,
    /// White light cures so many times the voxels of the part.
    cured: f64,
}

/// Voxels are 10 um: the problems are in pixels.
const PITCH_UM: f64 = 10.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("name a folder")?;
    let number: usize = arguments.next().ok_or("choose problem 0 or 1")?.parse()?;
    let repeats: usize = arguments.next().ok_or("say how many times")?.parse()?;
    let bridge = Problem {
        name: "bridge of the helix",
        part: dna_helix(),
        first: [16, 10, 0],
        size: [38, 38, 36],
        sigma: 2.0,
        fade: 0.04,
        cured: 1.76,
    };
    let stairs = Problem {
        name: "stairs with a cavity",
        part: cavity_staircase(1),
        first: [0, 0, 15],
        size: [50, 30, 45],
        sigma: 13.0,
        fade: 0.008,
        cured: 1.5,
    };
    let problems = [bridge, stairs];
    let problem = problems.get(number).ok_or("there are problems 0 and 1")?;
    let wanted = problem.wanted();
    let critical = problem.critical(&wanted);
    std::fs::write(Path::new(&folder).join(problem.name), &wanted)?;
    let [columns, rows, layers] = problem.size;
    let (sigma, fade) = (problem.sigma, problem.fade);
    print!("{};{layers};{rows};{columns};{sigma};{fade};{critical}", problem.name);
    let mut last = Outcome::default();
    for _ in 0..repeats {
        last = problem.plan(&wanted, critical)?;
    }
    println!(";{};{}", last.after.cost, last.bound);
    Ok(())
}

impl Problem {
    /// Returns 1 for each voxel of the part, from the light.
    fn wanted(&self) -> Vec<u8> {
        let [columns, rows, layers] = [0, 1, 2].map(|axis| {
            let first = self.first[axis];
            first..first + self.size[axis]
        });
        let mut wanted = Vec::new();
        for layer in layers.rev() {
            for row in rows.clone() {
                let holds = |column| u8::from(self.part.holds([column, row, layer]));
                wanted.extend(columns.clone().map(holds));
            }
        }
        wanted
    }

    /// Returns the dose that cures, where a lit pixel alone has 1.
    fn critical(&self, wanted: &[u8]) -> f64 {
        let [columns, rows, layers] = self.size;
        let shape = Shape::holding(layers, rows, columns);
        let light = LayerLight { passed: 10_f64.powf(-self.fade), own: 1.0 };
        let operator = Operator::<f64>::new(shape, Blur::new(self.sigma), vec![light; layers]);
        let mut white = vec![0.0; shape.voxels()];
        for (line, wanted) in white.chunks_exact_mut(shape.width).zip(wanted.chunks_exact(columns))
        {
            line.iter_mut().zip(wanted).for_each(|(light, &wanted)| *light = f64::from(wanted));
        }
        let mut doses = white.clone();
        operator.doses(&white, &mut doses);
        let lines = doses.chunks_exact(shape.width).flat_map(|line| &line[..columns]);
        let mut doses: Vec<f64> = lines.copied().collect();
        doses.sort_by(f64::total_cmp);
        let volume = wanted.iter().filter(|&&wanted| wanted == 1).count();
        doses[doses.len() - (self.cured * volume as f64).round() as usize]
    }

    fn plan(&self, wanted: &[u8], critical: f64) -> Result<Outcome, VoxelPlanError> {
        let light = Light {
            intensity: Intensity::from_mw_per_cm2(1.0),
            intensity_of: IntensityOf::Pixel(Length::from_um(PITCH_UM)),
            critical_dose: Dose::from_mj_per_cm2(critical),
            penetration_depth: Length::from_um(PITCH_UM / (self.fade * std::f64::consts::LN_10)),
            spread: [Length::from_um(self.sigma * PITCH_UM); 2],
            gamma: 1.0,
            at: SampleHeight::Top,
        };
        let whole = Window { settled: self.size[2], ahead: 0 };
        let options = Options {
            margin: Some(0.0),
            around: Some(0),
            window: Some(whole),
            ..Options::default()
        };
        let mut planned = plan(self.layers(wanted), &light, &options, |_| {})?;
        planned.by_ref().try_for_each(|layer| layer.map(drop))?;
        Ok(planned.outcome())
    }

    /// Returns the stack, bottom first.
    fn layers(&self, wanted: &[u8]) -> impl Iterator<Item = Result<Layer, VoxelPlanError>> {
        let [columns, rows, _] = self.size;
        let image = move |image: &[u8]| {
            let mut mask = MaskBuilder::new(columns as u32);
            for row in image.chunks_exact(columns) {
                let was = std::iter::once(&0).chain(row);
                let changes = (0..).zip(was.zip(row)).filter(|(_, (was, is))| was != is);
                let changes: Vec<u32> = changes.map(|(column, _)| column).collect();
                mask.push_row(&changes).expect("columns rise");
            }
            mask.finish()
        };
        (0..).zip(wanted.chunks_exact(columns * rows).rev()).map(move |(index, voxels)| {
            let info = PageInfo {
                index,
                thickness_um: Some(PITCH_UM),
                exposure_ms: Some(1000.0),
                ..PageInfo::default()
            };
            Ok(Layer {
                info,
                pitch: Pitch::of_dpi(25_400.0 / PITCH_UM),
                image: image(voxels).into(),
            })
        })
    }
}
