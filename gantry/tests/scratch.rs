//! Builds of a few pixels, and machines to scan them.

use std::path::PathBuf;

use lamp_gantry::{
    BuildPages, Disturbance, Frames, GantryError, GrayBy, Job, JobOptions, JobSeam, LayerDose,
    MirrorArray, expose,
};
use lamp_machine::Machine;
use lamp_stack::{
    Catalogued, Destination, Format, GrayMask, Image, Layer, PageInfo, Pitch, StackError,
    write_stack,
};

/// A pixel is 0.1 mm.
pub(crate) const DPI: f64 = 254.0;

/// Returns a machine whose mirrors are so many across the scan and along it. `more` adds keys of
/// `[scan]`.
pub(crate) fn machine(mirrors: [u32; 2], overlap: u32, more: &str) -> Machine {
    let [across, along] = mirrors;
    Machine::from_toml(&format!(
        "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"500x500mm\"\nsource = \"-\"\n\
         [scan]\nmirrors = [{across}, {along}]\noverlap = {overlap}\nspeed = [\"0.01mm/s\", \"5000mm/s\"]\n\
         acceleration = \"2000mm/s2\"\nrow_clock_hz = 22000\nboth_ways = true\nsource = \"-\"\n{more}"
    ))
    .unwrap()
}

/// A build in a folder that is removed with it.
pub(crate) struct Build {
    _folder: tempfile::TempDir,
    pub(crate) path: PathBuf,
    pub(crate) pages: BuildPages,
    pub(crate) images: Vec<Image>,
}

impl Build {
    /// Writes images as layers of 100 ms, 200 ms and so on.
    pub(crate) fn new(images: Vec<Image>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("build.tif");
        let layers = images.iter().zip(0_u32..).map(|(image, index)| {
            let exposure_ms = Some(100.0 * f64::from(index + 1));
            let info = PageInfo { index, exposure_ms, ..PageInfo::default() };
            Ok::<_, StackError>(Layer {
                info,
                pitch: Pitch::of_dpi(DPI),
                image: image.clone().into(),
            })
        });
        write_stack(layers, Destination::File(path.clone()), Format::Big).unwrap();
        let pages = BuildPages::open(&path).unwrap();
        Self { _folder: folder, path, pages, images }
    }

    pub(crate) fn job(
        &self,
        machine: &Machine,
        mirrors: &MirrorArray,
        seam: JobSeam,
        gray: GrayBy,
    ) -> Result<Job, GantryError> {
        let options = JobOptions { seam: Some(seam), gray, layers: 0..u32::MAX };
        Job::plan(&self.pages, "build.tif".to_owned(), machine, mirrors, &options)
    }

    /// Shows the first layer of a job on a machine, and returns its doses.
    pub(crate) fn exposed(
        &self,
        job: &Job,
        mirrors: &MirrorArray,
        machine: &Disturbance,
        map: impl FnMut(u32, usize, &[f32]),
    ) -> LayerDose {
        let layer = &job.layers[0];
        let count = job.layout().count(job.pixels[0]).unwrap();
        let images = self.pages.swaths(layer.page, 0..count, &job.layout()).unwrap();
        let show = |pass: &lamp_gantry::JobSwath, to: &mut dyn FnMut(&lamp_gantry::Frame<'_>)| {
            let image = &images[pass.swath as usize];
            let mut frames = Frames::new(job.swath(pass, image)?, mirrors);
            assert_eq!(frames.len(), pass.frames);
            while let Some(frame) = frames.next() {
                to(&frame);
            }
            Ok::<_, GantryError>(())
        };
        expose(job, layer, &self.images[layer.page], machine, show, map).unwrap()
    }
}

/// Returns an image of levels, row after row.
pub(crate) fn gray(width: u32, levels: &[u8]) -> Image {
    let mut image = GrayMask::new(width);
    for row in levels.chunks_exact(width as usize) {
        image.push_runs(row.iter().map(|&level| (1, level))).unwrap();
    }
    Image::Gray(image)
}

/// Returns an image of white and black.
pub(crate) fn mask(width: u32, white: &[bool]) -> Image {
    let levels: Vec<u8> = white.iter().map(|&white| 255 * u8::from(white)).collect();
    let Image::Gray(gray) = gray(width, &levels) else { unreachable!("it is gray") };
    gray.to_mask().expect("black and white").into()
}
