//! Makes the layers of a beta build and writes them, or their strips or fields, to compare what both cost.
//!
//! ```sh
//! lamp sample blade -o blade.stl
//! slice blade.stl --dpi 1500 --thickness 100um --layers 600..612 -o blade.tif
//! cargo build --release -p lamp-build --example strips
//! time target/release/examples/strips blade.tif build
//! time target/release/examples/strips blade.tif strips/ 1920 64 comb
//! time target/release/examples/strips blade.tif fields/ 2560x1600 4 comb
//! ```

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use lamp_build::{
    FieldForm, FieldWriter, HeightOptions, Layout, MeshOptions, Pack, PartStack, TileError,
};
use lamp_stack::{EncodedPage, FolderBeside, Format, Layer, PageWriter, Pages};

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [part, out, numbers @ ..] = &arguments[..] else {
        return Err("give a part's stack, and build or a folder, mirrors, overlap and seam".into());
    };
    let layers: Vec<Layer> =
        Pages::open(Path::new(part))?.map(|page| page?.decode()).collect::<Result<_, _>>()?;
    let placed = layers.iter().cloned().map(Ok::<_, TileError>);
    let part = PartStack::of_outline(part, placed)?.ok_or("no layers")?;
    let mesh = MeshOptions::default();
    let area = "584.2x584.2mm".parse()?;
    let layout = Layout::packed(vec![part], &[None], area, mesh.gap(), Pack::default())?;
    let layout = layout.with_mesh(&mesh)?;
    let layers = layers.into_iter().map(Ok::<_, TileError>);
    let build = layout.build(vec![layers], HeightOptions::default(), |_| ());
    match numbers {
        [] => {
            let file = File::create(out)?;
            let mut pages = PageWriter::new(BufWriter::new(file), Format::Big);
            for layer in build {
                pages.push(EncodedPage::new(&layer?))?;
            }
            pages.finish()?;
        }
        [mirrors, overlap, seam] => {
            let folder = FolderBeside::replacing(Path::new(out))?;
            // WxH makes fields.
            let (width, height) = match mirrors.split_once('x') {
                Some((width, height)) => (width.parse()?, Some(height.parse()?)),
                None => (mirrors.parse()?, None),
            };
            let form = FieldForm { width, height, overlap: overlap.parse()?, seam: seam.parse()? };
            let mut strips = FieldWriter::new(folder, form, Format::Big)?;
            for layer in build {
                strips.push(&layer?)?;
            }
            strips.finish()?;
        }
        _ => return Err("give mirrors, overlap and seam".into()),
    }
    Ok(())
}
