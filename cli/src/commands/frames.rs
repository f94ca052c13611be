//! `lamp frames`: the pictures on the mirrors while a swath is scanned.

use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_gantry::{
    BuildPages, Frame, FrameHeader, FrameWriter, Frames, GantryError, Job, JobFolder, JobLayer,
    JobSwath, MirrorArray,
};
use lamp_machine::ScanDirection;
use lamp_stack::{write_gray_animation, write_gray_png};

use crate::args::options::{Common, parse_range};
use crate::commands::job::ScanArgs;
use crate::exit::Exit;
use crate::output::endings::{FRAMES, check_ending};
use crate::output::numbers::number_of;
use crate::streams::{extension, input_name, is_stream, write_file};
use crate::terminal::progress::Progress;

/// Write the frames of a swath: a picture of the mirrors for each row of the scan
///
/// While the head moves on by one pixel, the mirrors show one frame. Mirror row j of a frame is
/// over the image row that is j rows above the frame's position. Frames are packed, 1 bit a mirror,
/// after a header of 64 bytes (docs/gantry.md). A .png shows one frame, or several as an animation.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp frames job/ --layer 812 --swath 3 -o swath.frames
  lamp frames job/ --layer 812 --swath 3 | controller
  lamp frames build.tif --machine mine.toml --layer 812 --swath 3 -o swath.frames
  lamp frames job/ --layer 812 --swath 3 --frames 700 -o frame.png")]
pub(crate) struct FramesArgs {
    /// Folder of lamp job, or a build: a stack, or a folder of strips
    #[arg(value_name = "JOB|BUILD")]
    input: PathBuf,

    #[command(flatten)]
    scan: ScanArgs,

    /// Index of the layer
    #[arg(long, value_name = "N")]
    layer: u32,

    /// Number of the swath, from the left, from 0
    #[arg(long, value_name = "N")]
    swath: u32,

    /// Number of the pass over the swath, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pass: u32,

    /// Write only these frames: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = |text: &str| parse_range(text, "frame"))]
    frames: Option<Range<u32>>,

    /// File of frames, a .png to look at, or - for standard output
    #[arg(short, long, value_name = "OUT", default_value = "-")]
    output: PathBuf,
}

/// The frames of a picture that moves: 12 pictures a second.
const PICTURES_PER_SECOND: u16 = 12;

/// The most frames of an animation.
const MAX_PICTURES: u64 = 2000;

pub(crate) fn run(args: &FramesArgs, common: &Common) -> Result<(), Exit> {
    let progress = Progress::new("frames", common, true);
    if !is_stream(&args.output) {
        check_ending(&args.output, &FRAMES)?;
    }
    let (job, pages, mirrors) = args.job()?;
    let at = |error: GantryError| Exit::from(error).at(input_name(&args.input));
    let (layer, pass) = args.pass(&job)?;
    let image = pages.swaths(layer.page, pass.swath..pass.swath + 1, &job.layout()).map_err(at)?;
    let swath = job.swath(pass, &image[0]).map_err(at)?;
    // Builds have less than 2^31 columns.
    let first_column = swath.first_column as i32;
    let mut frames = Frames::new(swath, &mirrors);
    let all = 0..frames.len();
    let wanted =
        args.frames.as_ref().map_or(all.clone(), |range| range.start.into()..range.end.into());
    let wanted = wanted.start..wanted.end.min(all.end);
    if wanted.is_empty() {
        return Err(Exit::usage(format!("--frames: the swath has frames 0 to {}", all.end - 1)));
    }
    for _ in 0..wanted.start {
        frames.next();
    }
    let header = FrameHeader {
        mirrors: job.mirrors,
        layer: layer.layer,
        swath: pass.swath,
        first_column,
        first_position: frames.next_position(),
        frames: wanted.end - wanted.start,
        rows_hz: layer.row_clock_hz,
        is_upward: pass.direction == ScanDirection::Up,
    };
    if ["png", "apng"].contains(&extension(&args.output).as_str()) {
        args.write_picture(&mut frames, &header)?;
        progress.wrote(&args.output, &[number_of(header.frames, "frame")]);
        return Ok(());
    }
    let write = |out: &mut dyn Write| -> io::Result<()> {
        let mut writer = FrameWriter::new(out, header)?;
        for _ in wanted.clone() {
            writer.push(&frames.next().expect("as many as there are"))?;
        }
        writer.finish().map(drop)
    };
    if !is_stream(&args.output) {
        write_file(&args.output, write)?;
        progress.wrote(&args.output, &[number_of(header.frames, "frame")]);
        return Ok(());
    }
    let mut write = write;
    let mut out = BufWriter::with_capacity(1 << 20, io::stdout().lock());
    let written = write(&mut out).and_then(|()| out.flush());
    written.map_err(|error| Exit::output(error, "standard output"))
}

impl FramesArgs {
    /// Reads the job, or plans the layer of a build.
    fn job(&self) -> Result<(Job, BuildPages, MirrorArray), Exit> {
        if !JobFolder::is_job(&self.input) {
            let layers = self.layer..self.layer.saturating_add(1);
            let (job, pages, scanner) = self.scan.plan(&self.input, String::new(), layers)?;
            return Ok((job, pages, scanner.mirrors));
        }
        if !self.scan.is_default() {
            return Err(Exit::usage(
                "a job has its machine, seams and gray: give --machine, --seam and --gray-by to lamp job",
            ));
        }
        let folder = JobFolder::open(&self.input)?;
        let pages = folder.build()?;
        Ok((folder.job, pages, folder.mirrors))
    }

    /// Finds the pass.
    fn pass<'a>(&self, job: &'a Job) -> Result<(&'a JobLayer, &'a JobSwath), Exit> {
        let failed = |problem: String| Exit::Failed(anyhow!(problem)).at(input_name(&self.input));
        let Some(layer) = job.layers.iter().find(|layer| layer.layer == self.layer) else {
            return Err(failed(format!("the job has no layer {}", self.layer)));
        };
        let is_wanted = |pass: &&JobSwath| (pass.swath, pass.pass) == (self.swath, self.pass);
        if let Some(pass) = layer.swaths.iter().find(is_wanted) {
            return Ok((layer, pass));
        }
        let count = job.layout().count(job.pixels[0]).map_err(|error| failed(error.to_string()))?;
        Err(failed(match self.swath < count {
            false => {
                format!("layer {} has swaths 0 to {}, and no {}", self.layer, count - 1, self.swath)
            }
            true if layer.swaths.iter().any(|pass| pass.swath == self.swath) => {
                format!(
                    "swath {} has passes 0 to {}, and no {}",
                    self.swath,
                    layer.passes - 1,
                    self.pass
                )
            }
            true => format!(
                "swath {} of layer {} is black: the job leaves it out",
                self.swath, self.layer
            ),
        }))
    }

    /// Writes frames as a picture, or as an animation if there are several.
    fn write_picture(&self, frames: &mut Frames<'_>, header: &FrameHeader) -> Result<(), Exit> {
        let [across, along] = header.mirrors;
        if header.frames > MAX_PICTURES {
            return Err(Exit::usage(format!(
                "an animation has at most {MAX_PICTURES} frames, and these are {}: choose some with --frames",
                header.frames
            )));
        }
        let mut picture = || levels(&frames.next().expect("as many as there are"), across);
        write_file(&self.output, |out| match header.frames {
            1 => {
                let levels = picture();
                let rows = levels.chunks(across as usize).map(<[u8]>::to_vec);
                write_gray_png(out, across, along, rows)
            }
            count => {
                let pictures = (0..count as usize).map(|_| picture());
                write_gray_animation(out, [across, along], PICTURES_PER_SECOND, pictures)
            }
        })
    }
}

/// Returns the mirrors of a frame as levels, 255 for bright.
fn levels(frame: &Frame<'_>, across: u32) -> Vec<u8> {
    let row = |words: &[u64]| -> Vec<u8> {
        let level =
            |column: u32| 255 * (words[column as usize / 64] >> (63 - column % 64) & 1) as u8;
        (0..across).map(level).collect()
    };
    frame.words.chunks(across.div_ceil(64) as usize).flat_map(row).collect()
}
