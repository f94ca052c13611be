//! Advice for the command line when a library reports an error.
//!
//! Libraries state facts and know no options; this is the one place that adds them.

use std::error::Error;
use std::io;

use lamp_adaptive::HeightsError;
use lamp_build::{FieldsError, LayoutError, RecipeError, TileError};
use lamp_edit::{EditError, EditProblem, LayerProblem};
use lamp_grayscale::calibrate::DataError;
use lamp_grayscale::exposure::{ExposureError, LampError};
use lamp_grayscale::material::MaterialError;
use lamp_machine::{MachineError, MachineLimit};
use lamp_offset::{CompensateError, CompensateProblem};
use lamp_planning::LightError;
use lamp_planning::ecpl;
use lamp_planning::learn::{JobError, JobFileError, LearnError};
use lamp_planning::projector::ProjectorError;
use lamp_planning::speed::PartError;
use lamp_planning::target::TargetError;
use lamp_planning::voxels::VoxelPlanError;
use lamp_plots::PlotError;
use lamp_slicing::brep::{BrepError, Matter, StepError};
use lamp_slicing::topology::NoSolid;
use lamp_slicing::{ContourFault, SliceError, ThreeMfError};
use lamp_stack::{CatalogueError, FileFormat, Length, PartFormat, StackError};
use lamp_supports::SupportError;
use lamp_view::SurfaceError;

fn plot(error: &PlotError) -> Option<String> {
    let hint = match error {
        PlotError::TooLarge(_) => "choose a smaller --zoom, or less with --along and --layers",
        _ => return None,
    };
    Some(hint.to_owned())
}

/// Returns what to try about an error, to stand after its message.
pub(crate) fn hint(error: &(dyn Error + 'static)) -> Option<String> {
    // The error is generic over what is wrong with a document, so each type is tried by itself.
    let catalogued = || {
        let material = error.downcast_ref::<CatalogueError<MaterialError>>();
        let machine = error.downcast_ref::<CatalogueError<MachineError>>();
        let projector = error.downcast_ref::<CatalogueError<ProjectorError>>();
        let hint = material.and_then(catalogue).or_else(|| machine.and_then(catalogue));
        hint.or_else(|| projector.and_then(catalogue))
    };
    let hint = error.downcast_ref().and_then(slicing);
    hint.or_else(|| error.downcast_ref().and_then(heights))
        .or_else(|| error.downcast_ref().and_then(tile))
        .or_else(|| error.downcast_ref().and_then(layout))
        .or_else(|| error.downcast_ref().and_then(recipe))
        .or_else(|| error.downcast_ref().and_then(edit))
        .or_else(|| error.downcast_ref().and_then(support))
        .or_else(|| error.downcast_ref().and_then(surface))
        .or_else(|| error.downcast_ref().and_then(compensate))
        .or_else(|| error.downcast_ref().and_then(lamp))
        .or_else(|| error.downcast_ref().and_then(exposure))
        .or_else(|| error.downcast_ref().and_then(light))
        .or_else(|| error.downcast_ref().and_then(plan))
        .or_else(|| error.downcast_ref().and_then(ecpl))
        .or_else(|| error.downcast_ref().and_then(target))
        .or_else(|| error.downcast_ref().and_then(timed_part))
        .or_else(|| error.downcast_ref().and_then(job))
        .or_else(|| error.downcast_ref().and_then(learning))
        .or_else(|| error.downcast_ref().and_then(plot))
        .or_else(|| error.downcast_ref().and_then(fields))
        .or_else(|| error.downcast_ref().and_then(machine_limit))
        .or_else(|| error.downcast_ref().map(no_solid))
        .or_else(|| error.downcast_ref().and_then(data))
        .or_else(|| error.downcast_ref().and_then(stack))
        .or_else(|| error.downcast_ref().and_then(input_output))
        .or_else(catalogued)
}

fn slicing(error: &SliceError) -> Option<String> {
    let hint = match error {
        SliceError::Ascii { .. } => "export the part again",
        SliceError::EmptyFile | SliceError::Count { .. } => "export it again",
        SliceError::Folder => "name the part's file in it",
        SliceError::Changed { .. } => "slice it again once nothing writes to it",
        SliceError::Packed(_) => "pack it again",
        SliceError::Inflated { .. } => "unpack it first",
        SliceError::OtherFormat(format) => return other_format(*format),
        SliceError::OtherArchive { .. } => "unpack it first, and name the part in it",
        SliceError::NotStep(FileFormat::Part(PartFormat::Gzip)) => "unpack it first",
        SliceError::NotStep(FileFormat::Part(PartFormat::Zip)) => {
            "slice and lamp mesh check read it if it is a 3MF"
        }
        SliceError::NotStep(FileFormat::Part(_)) => "slice and lamp mesh check read it",
        SliceError::NotStep(format) => return other_format(*format),
        SliceError::Iges => IGES_KERNEL,
        SliceError::NotStl { .. } => "export the part as STL, STEP, 3MF or OBJ",
        SliceError::WildVertex { .. } => {
            "repair or export the part again, or give --trust-extent if the vertex is right"
        }
        SliceError::TooManyRows { .. } => {
            "check --units, --dpi and --thickness, or give --trust-extent if the part is this large"
        }
        SliceError::TooManyCrossings { .. } => "check it for facets that repeat, and --dpi",
        SliceError::ThreeMf(error) => match **error {
            ThreeMfError::Unread { .. } => "export it as a plain mesh",
            ThreeMfError::Encrypted(_) => "export it without protection",
            ThreeMfError::NothingToBuild { .. } => "give items to build the type part",
            _ => "export the part again",
        },
        SliceError::Obj { .. } => "export the part again",
        SliceError::Contours { fault, .. } => return contours(fault),
        SliceError::NotFinite { .. } => "repair or export the part again",
        SliceError::NothingLeft { .. } => "export the part again",
        SliceError::TooManyFacets { .. } => "export it with fewer facets",
        SliceError::TooFar { .. } => "check --units, --scale and --translate",
        SliceError::TooLarge { .. } => "check --units and --dpi",
        SliceError::OutsideFrame { .. } => "move or enlarge the frame with --origin and --size",
        SliceError::TooManyLayers { .. } => "check --units and --thickness",
        SliceError::GraySide => "leave out --antialias or --side",
        SliceError::GrayPlane => "slice them with --plane top",
        SliceError::Faulty { .. } => {
            return Some(format!(
                "lamp brep reports more, {OTHER_KERNEL}, and --fallback part.stl can bridge gaps"
            ));
        }
        SliceError::KernelsDisagree { .. } => {
            "lamp brep --both reports more; --kernel lamp or occt slices what one of them reads"
        }
        SliceError::Brep(BrepError::Step(error)) => return of_step(error),
        SliceError::Timeout { tolerance, .. } => {
            return Some(format!(
                "give it more with --timeout, or let facets lie more than {} from the surfaces",
                lamp_pipeline::step::length(tolerance.mm())
            ));
        }
        _ => return None,
    };
    Some(hint.to_owned())
}

/// Returns what to do about a contour file or a layout, unless the fault says it.
fn contours(fault: &ContourFault) -> Option<String> {
    let hint = match fault {
        ContourFault::CutOff | ContourFault::CutHeader => "copy or export the file again",
        ContourFault::Open
        | ContourFault::OpenLines(_)
        | ContourFault::Twice(_)
        | ContourFault::TooManyCoats(_)
        | ContourFault::Crossed(_) => return None,
        ContourFault::NoArea(_) => "check which layers and shapes were exported",
        ContourFault::TooManyCopies(_) | ContourFault::TooManyCorners(_) => {
            "export fewer shapes to a file"
        }
        ContourFault::Unread(_) | ContourFault::Command(_) => "export plain closed polygons",
        _ => "export the file again",
    };
    Some(hint.to_owned())
}

/// Returns what to do about a file of another format than a part has.
fn other_format(format: FileFormat) -> Option<String> {
    let hint = match format {
        FileFormat::Layers(_) => {
            "lamp info describes layers; slice the part that the layers were made from"
        }
        FileFormat::Archive(_) => "unpack it first",
        FileFormat::PrintJob(_) => "slice the part that it was made from",
        FileFormat::WebPage => "download the file itself, not the page that shows it",
        FileFormat::Pointer("a Git LFS pointer") => "run git lfs pull to get the file itself",
        FileFormat::Pointer("a git-annex pointer") => "run git annex get to get the file itself",
        FileFormat::Pointer("a DVC pointer") => "run dvc pull to get the file itself",
        FileFormat::Pointer(_) => "name the file that it points to",
        _ => "export the part as STL, STEP, 3MF or OBJ",
    };
    Some(hint.to_owned())
}

fn of_step(error: &StepError) -> Option<String> {
    let hint = match error {
        StepError::Other { matter: Matter::Elsewhere { .. }, .. } => {
            "slice those files, or export the assembly as one"
        }
        StepError::Empty | StepError::Other { .. } | StepError::Elements { .. } => {
            "export the part as solids"
        }
        StepError::Unsupported { .. } => OTHER_KERNEL,
        _ => return None,
    };
    Some(hint.to_owned())
}

#[cfg(feature = "occt")]
const IGES_KERNEL: &str = "give --kernel occt, or export the part as STL, STEP, 3MF or OBJ";
#[cfg(not(feature = "occt"))]
const IGES_KERNEL: &str = "export the part as STL, STEP, 3MF or OBJ, or read it with --kernel occt of a \
     build with --features occt";
#[cfg(feature = "occt")]
const OTHER_KERNEL: &str = "the other --kernel may read it";
#[cfg(not(feature = "occt"))]
const OTHER_KERNEL: &str = "a build with --features occt may read it";

fn heights(error: &HeightsError) -> Option<String> {
    let hint = match error {
        HeightsError::NoThickness { .. } => "give a smaller --step, or a wider --min and --max",
        HeightsError::TooManySteps { min_step, .. } => {
            return Some(format!("give a --step above {min_step}"));
        }
        HeightsError::TooHigh { .. } => "check --units, --min and --max",
        HeightsError::TooManyRows { .. } => "give a wider --row-pitch",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn tile(error: &TileError) -> Option<String> {
    let hint = match error {
        TileError::TooLarge { .. } => {
            "give a larger --area, or --fit if the image is wider than the part"
        }
        TileError::TooMany { .. } => {
            "give a larger --area, a smaller --gap or fewer copies; --pack outline may place more than \
             boxes do"
        }
        TileError::NoCells { .. } => "give a larger --cell or a smaller --wall",
        TileError::FineMesh => "give a larger --cell, or --mesh none",
        TileError::ManyBreaks => "give a wider --break-pitch, or --break-width 0um",
        TileError::NoOutline { .. } => "give --fit",
        TileError::LargePiece { .. } => "give a smaller --least-piece, or --mesh none",
        TileError::WideEdgeGap { .. } => "give a smaller --edge-gap or a larger --area",
        TileError::WideMoat { .. } => "give a smaller --clearance, or --mesh none",
        TileError::TooManyRuns { .. } => "place fewer copies",
        TileError::Resolutions { .. } => "slice the parts at one resolution",
        TileError::NotSquare { .. } => "give no --turns quarters, and no turn of 90 degrees",
        TileError::Changed { .. } => "run tile again",
        TileError::Overlap { .. } => {
            "move one of them, or give --fit if only their black margins do"
        }
        TileError::OutOfArea { .. } => "move it, or give --fit if only its black margin does",
        TileError::OtherStart { .. } => {
            "slice them with the same first layer, or give --settle to set all on the platform"
        }
        TileError::OtherHeights { build: [bottom, top], first, .. } => {
            let thickness = Length::from_um(top.um() - bottom.um()).to_whole_nm();
            return Some(format!(
                "slice it again with --thickness {thickness}, or give --resample to take the \
                 layer at each height of {first}"
            ));
        }
        TileError::Exposures { .. } => "slice the parts for the same exposure",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn layout(error: &LayoutError) -> Option<String> {
    match error {
        LayoutError::Unused { .. } => Some("leave that stack out, or add copies".to_owned()),
        // It is transparent, so that it is no cause of its own.
        LayoutError::Tile(error) => tile(error),
        _ => None,
    }
}

fn edit(error: &EditError) -> Option<String> {
    let hint = match error {
        EditError::Edit { problem, .. } => match problem {
            EditProblem::IntersectInCopies => "intersect the part before tile",
            EditProblem::Angle => "turn the part with slice --rotate",
            EditProblem::OtherResolution { .. } => "slice both stacks at one resolution",
            _ => return None,
        },
        EditError::Layer { problem, .. } => match problem {
            LayerProblem::StrayColumns => "fix the stack first",
            LayerProblem::NoCopies => "copies are for builds that tile made",
            _ => return None,
        },
        // It is transparent, so that it is no cause of its own.
        EditError::Page(error) => return stack(error),
        _ => return None,
    };
    Some(hint.to_owned())
}

fn support(error: &SupportError) -> Option<String> {
    let hint = match error {
        SupportError::NoResolution | SupportError::NoOrigin | SupportError::NoHeight { .. } => {
            "support the stack that slice or fix wrote"
        }
        SupportError::TooMany => "give a wider --hold, or turn or change the part",
        SupportError::MissingLayers => "support it again once nothing writes to it",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn surface(error: &SurfaceError) -> Option<String> {
    let hint = match error {
        SurfaceError::Nothing { .. } => "give more --cells",
        SurfaceError::TooManyTriangles { .. } => "give fewer --cells",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn compensate(error: &CompensateError) -> Option<String> {
    let hint = match error.problem {
        CompensateProblem::GrayGrows => "dither the stack first",
        CompensateProblem::TooDeep { .. } => "give a smaller --min-feature, or 0um to let walls go",
        CompensateProblem::TooFarForWalls { .. } | CompensateProblem::UnequalWithWalls(_) => {
            "--min-feature 0um lets walls go and reports what is lost"
        }
        CompensateProblem::Tiled => "compensate for shrinkage before tile",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn lamp(error: &LampError) -> Option<String> {
    match error {
        LampError::NoOwnLight(_) => Some("give --lamp-intensity as 1.2W/cm2".to_owned()),
        _ => None,
    }
}

fn exposure(error: &ExposureError) -> Option<String> {
    match error {
        ExposureError::Lamp(error) => lamp(error),
        _ => None,
    }
}

fn light(error: &LightError) -> Option<String> {
    match error {
        LightError::TooWide { .. } => {
            Some("check [spread] in the material's file, or slice with a lower --dpi".to_owned())
        }
        _ => None,
    }
}

fn plan(error: &VoxelPlanError) -> Option<String> {
    let hint = match error {
        // It is transparent, so that it is no cause of its own.
        VoxelPlanError::Light(error) => return light(error),
        VoxelPlanError::Silent { what: "exposure", .. } => "give --expose, as 2s",
        VoxelPlanError::Silent { .. } => "plan the stack that slice wrote",
        VoxelPlanError::Unlike { .. } => "plan the stack before its layers are cropped",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn ecpl(error: &ecpl::RingPlanError) -> Option<String> {
    let hint = match error {
        ecpl::RingPlanError::TooHigh { .. } => {
            "make it lower, or the chamber of the projector higher"
        }
        ecpl::RingPlanError::TooWide { .. } => {
            "make it smaller, or take a projector with more mirrors"
        }
        ecpl::RingPlanError::TooDim { .. } => "make it lower, or the projector's light brighter",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn target(error: &TargetError) -> Option<String> {
    let hint = match error {
        // It is transparent, so that it is no cause of its own.
        TargetError::Part(error) => return slicing(error),
        TargetError::NoScale => "give --pixel, such as 10um, and --full, such as 500um",
        TargetError::Open { .. } => "lamp mesh repair fixes what it can",
        TargetError::NotOnGlass { .. } => "put the part on its flat side",
        TargetError::AboveChamber { .. } | TargetError::Wide { .. } => {
            "check the target's lengths, or take another --projector"
        }
        TargetError::Empty { .. } => "check the target's lengths",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn timed_part(error: &PartError) -> Option<String> {
    let hint = match error {
        PartError::NoResolution(_) | PartError::NoThickness(_) => "use the stack that slice wrote",
        PartError::Unlike(_) => "use the stack from before its layers were cropped",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn job(error: &JobError) -> Option<String> {
    match error {
        JobError::NoJob(_) => Some(
            "begin it with lamp learn JOB --start STACK --material M, or with the folder of a plan on a \
             glass and its --projector"
                .to_owned(),
        ),
        JobError::Part(error) => timed_part(error),
        JobError::File { problem, .. } => match problem {
            JobFileError::Io(error) => input_output(error),
            JobFileError::Material(error) => catalogue(error),
            JobFileError::Part(error) => timed_part(error),
            _ => None,
        },
        _ => None,
    }
}

fn learning(error: &LearnError) -> Option<String> {
    match error {
        LearnError::Part(error) => timed_part(error),
        _ => None,
    }
}

fn recipe(error: &RecipeError) -> Option<String> {
    let hint = match error {
        RecipeError::Json { .. }
        | RecipeError::Schema { .. }
        | RecipeError::Code { .. }
        | RecipeError::Changed
        | RecipeError::NoPiece { .. } => "write it again with tile --recipe",
        RecipeError::OtherPart { .. } => {
            "bring that stack back, or write the recipe again with tile --recipe"
        }
        RecipeError::NoPart { .. } => {
            "a recipe names its parts from its own folder: put them there, or write it again with \
             tile --recipe"
        }
        _ => return None,
    };
    Some(hint.to_owned())
}

fn fields(error: &FieldsError) -> Option<String> {
    let hint = match error {
        FieldsError::TooManyStrips { .. } => "give more --mirrors",
        FieldsError::TooManyFields { .. } => "give larger --fields",
        FieldsError::Already { .. } => "lamp join makes the build of its folder again",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn machine_limit(error: &MachineLimit) -> Option<String> {
    let hint = match error {
        MachineLimit::Area { .. } => "give a smaller --area",
        MachineLimit::Footprint { .. } => "check --units, or turn or scale the part",
        MachineLimit::Height { .. } => "check --units, or lay the part down with --rotate",
        MachineLimit::Dpi { .. } => "slice with such a --dpi",
        MachineLimit::PanelPitch { .. } => "slice with that resolution",
        MachineLimit::Thickness { .. } => {
            "slice with such a --thickness, or --min and --max with --adaptive"
        }
        _ => return None,
    };
    Some(format!("{hint}, or take another --machine"))
}

fn no_solid(error: &NoSolid) -> String {
    let hint = match error {
        NoSolid::Crossed { .. } | NoSolid::Wound { .. } => {
            "lamp mesh check --self-intersections lists the facets"
        }
        _ => "lamp mesh check names the facets, and lamp mesh repair fixes what it can",
    };
    hint.to_owned()
}

fn data(error: &DataError) -> Option<String> {
    match error {
        DataError::NoLight => Some("give --intensity, as 1.6W/cm2".to_owned()),
        _ => None,
    }
}

fn stack(error: &StackError) -> Option<String> {
    let hint = match error {
        StackError::Check { .. }
        | StackError::EndedEarly { .. }
        | StackError::MissingPages { .. } => {
            "make the stack again, or accept it with lamp convert --ignore-checks"
        }
        StackError::NotTiff {
            format: Some(FileFormat::Part(PartFormat::Zip | PartFormat::Gzip)),
            ..
        } => "if a part is in it, slice it first; if it holds pages, unpack it first",
        StackError::NotTiff { format: Some(FileFormat::Part(_)), .. } => "slice it first",
        StackError::NotTiff { format: Some(format), .. } => match other_format(*format) {
            // A part alone is no stack yet.
            Some(hint) if hint.starts_with("export") => return Some(hint + ", and slice it first"),
            hint => return hint,
        },
        StackError::NotTiff { .. } => "if it is a part, slice it first",
        StackError::Exists => "--force replaces a folder of an earlier run",
        StackError::NotOurs | StackError::NotReplaceable { .. } => {
            "choose another name, or remove the folder yourself"
        }
        // It is in a box, so that it is no cause of its own.
        StackError::InFile { source, .. } if matches!(**source, StackError::Check { .. }) => {
            return stack(source);
        }
        // It is transparent, so that it is no cause of its own.
        StackError::Io(error) => return input_output(error),
        _ => return None,
    };
    Some(hint.to_owned())
}

fn input_output(error: &io::Error) -> Option<String> {
    let hint = match error.kind() {
        io::ErrorKind::FileTooLarge => "raise the limit (ulimit -f), or write to another disk",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "make room, or write to another disk"
        }
        io::ErrorKind::ReadOnlyFilesystem => "write to another disk",
        _ => return None,
    };
    Some(hint.to_owned())
}

fn catalogue<F>(error: &CatalogueError<F>) -> Option<String> {
    match error {
        CatalogueError::Syntax { kind, .. } => Some(format!("lamp {kind} show prints some")),
        _ => None,
    }
}
