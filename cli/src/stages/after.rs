//! Stages that need the whole stack, and those behind them.

use std::path::{Path, PathBuf};

use lamp_batch::{Call, Cost, Kind, WholeCall, WriteLayers};
use lamp_grayscale::material::Material;
use lamp_machine::Machine;
use lamp_pipeline::documents::is_file;
use lamp_pipeline::part_file::PartFile;
use lamp_pipeline::slice::Counts;
use lamp_pipeline::support;
use lamp_pipeline::watcher::KeptRemarks;
use lamp_pipeline::{Error, RangeFindings, Stage, Survey, named};
use lamp_planning::speed::SPEED_CODE;
use lamp_planning::voxels::VOXELS_CODE;
use lamp_stack::{Page, Pages, PassingLayer, map_in_order};

use crate::args::planning_options::PlanningOptions;
use crate::commands::plan::speed::SpeedArgs;
use crate::commands::plan::voxels::VoxelsArgs;
use crate::commands::support::SupportArgs;
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::terminal::progress::Progress;

/// A stage that works on a whole stack.
#[derive(Clone)]
pub(crate) enum After {
    Support(Box<SupportArgs>),
    Voxels(Box<VoxelsArgs>),
    Speed(Box<SpeedArgs>),
    /// A stage from layers to layers, behind one that needs the whole stack.
    Layers(Stage),
}

impl Call for After {
    fn canonical(&self) -> String {
        match self {
            Self::Support(args) => args.canonical(),
            Self::Voxels(args) => args.canonical(),
            Self::Speed(args) => args.canonical(),
            Self::Layers(stage) => stage.canonical(),
        }
    }

    fn input_files(&self) -> Result<Vec<PathBuf>, Error> {
        let material = |planning: &PlanningOptions| {
            let material = Some(planning.material.clone());
            Ok(material.into_iter().filter(|path| is_file::<Material>(path)).collect())
        };
        match self {
            Self::Voxels(args) => material(&args.planning),
            Self::Speed(args) => material(&args.planning),
            Self::Support(args) => {
                let machine = Some(args.machine.clone());
                Ok(machine.into_iter().filter(|path| is_file::<Machine>(path)).collect())
            }
            Self::Layers(stage) => stage.input_files(),
        }
    }

    fn code(&self) -> (&'static str, u32) {
        match self {
            Self::Support(_) => ("support", support::CODE),
            Self::Voxels(_) => ("plan voxels", VOXELS_CODE),
            Self::Speed(_) => ("plan speed", SPEED_CODE),
            Self::Layers(stage) => stage.code(),
        }
    }
}

impl WholeCall for After {
    fn kind(&self) -> Kind {
        match self {
            Self::Support(_) | Self::Layers(_) => Kind::Whole,
            Self::Voxels(_) | Self::Speed(_) => Kind::Plan,
        }
    }

    fn cost(&self, survey: &Survey, bytes: u64) -> Cost {
        let all = 0..survey.layers;
        let memory = |given: Option<u64>| given.expect("stages have a memory");
        let (cpu_s, memory) = match self {
            Self::Support(_) | Self::Layers(_) => (survey.cost_s(&all) * 0.3, survey.memory),
            Self::Voxels(args) => survey.voxel_plan(memory(args.memory)),
            Self::Speed(args) => survey.speed_plan(memory(args.memory)),
        };
        let disk = if matches!(self, Self::Voxels(_)) { survey.planned_bytes() } else { bytes };
        Cost { cpu_s, memory, disk }
    }
}

impl After {
    /// Returns whether pages get exposures that they did not have.
    pub(crate) fn gives_exposures(&self) -> bool {
        match self {
            Self::Voxels(args) => args.expose.is_some(),
            Self::Speed(_) => true,
            Self::Support(_) | Self::Layers(_) => false,
        }
    }

    /// Makes the layers that come of a stack of a part, and gives them to `write`.
    ///
    /// # Errors
    /// Returns the first error of the stage or of `write`.
    pub(crate) fn run(
        &self,
        part: &Path,
        stack: &Path,
        write: &mut WriteLayers<'_, Exit>,
    ) -> Result<RangeFindings, Exit> {
        let kept = KeptRemarks::default();
        let mut findings = RangeFindings::new(Counts::default(), false);
        match self {
            Self::Support(args) => {
                let mut args = SupportArgs::clone(args);
                args.part = vec![PartFile { path: part.to_owned(), placement: None }];
                args.stack = stack.to_owned();
                let mut stack = KeptStack::new(stack);
                let progress = Progress::keeping("support", &kept);
                let mut layers = args.layers(&mut stack, &progress)?;
                write(&mut layers)?;
            }
            Self::Voxels(args) => {
                let mut args = VoxelsArgs::clone(args);
                args.input.stack = stack.to_owned();
                let progress = Progress::keeping("plan", &kept);
                args.plan(&progress, |layers, _| write(layers))?;
            }
            Self::Speed(args) => {
                let mut args = SpeedArgs::clone(args);
                args.input.stack = stack.to_owned();
                args.plan(&Progress::keeping("plan", &kept), |layers, _| write(layers))?;
            }
            Self::Layers(stage) => {
                let working = stage.start(&kept)?;
                let failed = |error| Error::from(error).at(stack.display().to_string());
                let pages = Pages::open(stack).map_err(failed)?;
                let layers =
                    map_in_order(pages.map(move |page| page.map_err(failed)), move |page: Page| {
                        page.decode().map(PassingLayer::from).map_err(failed)
                    });
                // All of the stack is here, so both ends are its own.
                let layers = working.layers(Box::new(layers), 0..u32::MAX, [true; 2])?;
                let mut decoded = layers.map(|layer| {
                    let layer = layer.and_then(|layer| Ok(layer.decode()?));
                    layer.map_err(|error| Exit::from(named(error, part)))
                });
                write(&mut decoded)?;
                // It borrows the stage, whose findings come next.
                drop(decoded);
                working.find(0, &part.display().to_string(), &mut findings);
            }
        }
        findings.of_part = kept.take();
        Ok(findings)
    }
}
