//! One error for all rooms.

use lamp_adaptive::HeightsError;
use lamp_batch::{BatchError, NightError, StoreError};
use lamp_build::{FieldsError, LayoutError, RecipeError, TileError};
use lamp_edit::EditError;
use lamp_gantry::GantryError;
use lamp_grayscale::DitherError;
use lamp_grayscale::exposure::ExposureError;
use lamp_machine::MachineLimit;
use lamp_offset::CompensateError;
use lamp_planning::speed::SpeedPlanError;
use lamp_planning::voxels::VoxelPlanError;
use lamp_planning::{LightError, NoLight};
use lamp_plots::PlotError;
use lamp_slicing::SliceError;
use lamp_stack::StackError;
use lamp_supports::{CheckError, SupportError};
use lamp_view::ViewError;

/// Lists the errors of rooms, each under the name of its case.
macro_rules! errors {
    ($($case:ident($error:ty)),+ $(,)?) => {
        /// The error of any room, so that `?` works along a whole chain.
        #[derive(Debug, thiserror::Error)]
        #[non_exhaustive]
        #[allow(missing_docs, reason = "each case is the error of its name")]
        pub enum Error {
            $(
                #[error(transparent)]
                $case(#[from] $error),
            )+
        }
    };
}

errors!(
    Batch(BatchError),
    Check(CheckError),
    Compensate(CompensateError),
    Dither(DitherError),
    Edit(EditError),
    Exposure(ExposureError),
    Gantry(GantryError),
    Heights(HeightsError),
    Io(std::io::Error),
    Layout(LayoutError),
    Light(LightError),
    Machine(MachineLimit),
    Night(NightError),
    NoLight(NoLight),
    Pipeline(lamp_pipeline::Error),
    Plot(PlotError),
    Recipe(RecipeError),
    Slice(SliceError),
    SpeedPlan(SpeedPlanError),
    Stack(StackError),
    Store(StoreError),
    Strips(FieldsError),
    Support(SupportError),
    Tile(TileError),
    View(ViewError),
    VoxelPlan(VoxelPlanError),
);
