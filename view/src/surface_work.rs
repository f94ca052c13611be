//! Makes the surface of a stack for the page.

use lamp_stack::StackError;
use thiserror::Error;

use crate::background::WorkProgress;
use crate::error::ViewError;
use crate::stack::ViewedStack;
use crate::surface::{CellGrid, SurfaceError, SurfaceOptions};

/// Makes the surface of a stack. One thread does, so that the others are free for tiles.
pub(crate) fn surface_of(stack: &ViewedStack, progress: &WorkProgress) -> Result<Vec<u8>, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|error| error.to_string())?;
    let made = pool.install(|| -> Result<Vec<u8>, SurfaceFault> {
        let grid = CellGrid::new(stack.headers(), &SurfaceOptions::default())?;
        progress.expect(grid.layers() as u64);
        let layer = |position| {
            progress.one_done();
            Ok::<_, SurfaceFault>(stack.page(position)?.decode()?)
        };
        Ok(grid.surface(layer)?.to_bytes())
    });
    made.map_err(|fault| fault.to_string())
}

/// Why there is no surface.
#[derive(Debug, Error)]
enum SurfaceFault {
    #[error("{0}")]
    Surface(#[from] SurfaceError),
    #[error("{}", ViewError::from(.0))]
    Stack(#[from] StackError),
}
