//! `lamp mesh-out`: writes the surface of a stack.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_slicing::write_stl;
use lamp_stack::IndexedStack;
use lamp_view::{CellGrid, MAX_CELLS, StackSurface, SurfaceError, SurfaceOptions, SurfaceUnit};

use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::endings::{STL, check_ending};
use crate::output::numbers::number_of;
use crate::streams::{check_not_input, failed_at, input_name, open_indexed, write_mesh};
use crate::terminal::progress::Progress;

/// Write the surface of a stack as a mesh
///
/// The stack is divided into cubic cells, a whole number of pixels wide. The surface is where cells
/// are half white: features thinner than half a cell are left out, and edges are rounded by up to
/// half a cell. A gray level counts as its share of white. The mesh is a closed binary STL in
/// millimeters, at the part's position.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp mesh-out build.tif -o surface.stl
  lamp mesh-out fixed.tif -o part.stl --cells 512
  slice blade.stl | fix | lamp mesh-out -o - | lamp mesh check -")]
pub(crate) struct MeshOutArgs {
    /// The stack: a TIFF or picture file, a folder of pages, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    stack: PathBuf,

    /// Where to write the mesh: an STL file, or - for standard output
    #[arg(short, long, value_name = "OUT.stl")]
    output: PathBuf,

    /// Approximate number of cells along the longest side, from 8 to 1024
    #[arg(long, value_name = "N", default_value = "256", value_parser = parse_cells)]
    cells: NonZeroU32,
}

/// The triangles in an STL of two gigabytes.
const MAX_TRIANGLES: usize = 40_000_000;

fn parse_cells(text: &str) -> Result<NonZeroU32, String> {
    let cells =
        text.parse().ok().filter(|cells: &NonZeroU32| (8..=MAX_CELLS).contains(&cells.get()));
    cells.ok_or_else(|| format!("`{text}` is not a number of cells from 8 to {MAX_CELLS}"))
}

pub(crate) fn run(args: &MeshOutArgs, common: &Common) -> Result<(), Exit> {
    check_not_input(&args.output, [&args.stack])?;
    check_ending(&args.output, &STL)?;
    let stack = open(&args.stack)?;
    let progress = Progress::new("mesh-out", common, true);
    let surface = surface_of(&stack, args, &progress);
    progress.done();
    let surface = surface?;
    if surface.unit == SurfaceUnit::Pixels {
        progress.say(
            "the stack does not state its resolution and heights: the mesh's unit is a pixel, and a \
             layer is as thick as a pixel is wide",
        );
    }
    write_mesh(&args.output, |out| write_stl(surface.facets(), out))?;
    progress.wrote(&args.output, &[number_of(surface.facets().len() as u64, "facet")]);
    Ok(())
}

/// Opens a stack that is whole.
fn open(path: &Path) -> Result<IndexedStack, Exit> {
    let whole = open_indexed(path)?.into_whole();
    whole.map_err(|error| failed_at(input_name(path), error))
}

fn surface_of(
    stack: &IndexedStack,
    args: &MeshOutArgs,
    progress: &Progress,
) -> Result<StackSurface, Exit> {
    let name = input_name(&args.stack);
    let at_stack = |error: SurfaceError| Exit::from(error).at(name.clone());
    let options =
        // All layers are read, as the mesh is to be kept; the viewer takes samples of them.
        SurfaceOptions { cells: args.cells, layers_a_cell: None, max_triangles: MAX_TRIANGLES };
    let grid = CellGrid::new(stack.headers(), &options).map_err(at_stack)?;
    progress.expect(grid.layers() as u64);
    grid.surface(|position| {
        let layer = stack.layer(position).map_err(|error| failed_at(name.clone(), error))?;
        progress.layer_done();
        Ok(layer)
    })
    .map_err(|error: Exit| match error.cause::<SurfaceError>() {
        Some(_) => error.at(name.clone()),
        // Errors of layers have their place.
        None => error,
    })
}
