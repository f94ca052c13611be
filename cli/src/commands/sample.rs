//! `lamp sample`: writes sample parts.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lamp_fixtures::{Defect, Mesh, Sample, StepSample, StepUnit, build, inject, step};
use lamp_stack::Length;

use crate::args::options::{Common, parse_count};
use crate::exit::Exit;
use crate::output::endings::{SAMPLE, check_ending, is_step_name};
use crate::output::numbers::number_of;
use crate::streams::{is_stream, write_file};
use crate::terminal::progress::Progress;

/// Write a sample part as STL, intact or with defects, or as STEP with exact surfaces
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp sample blade -o blade.stl --facets 750k
  lamp sample torus | slice - | lamp info
  lamp sample tower -o tower.step
  lamp sample tower --defect drop --count 20 --seed 7 -o broken.stl")]
pub(crate) struct SampleArgs {
    /// Part to write
    #[arg(value_parser = parts())]
    part: Sample,

    /// Approximate number of facets
    #[arg(long, value_name = "N", default_value = "100k", value_parser = parse_count)]
    facets: usize,

    /// Write ASCII instead of binary STL
    #[arg(long)]
    ascii: bool,

    /// Break the mesh: drop, flip or duplicate facets, nudge a corner of each facet, or open a gap
    /// along an edge of each
    #[arg(long, value_parser = PossibleValuesParser::new(Defect::NAMES))]
    defect: Option<String>,

    /// Number of facets to break
    #[arg(long, value_name = "N", default_value = "10", value_parser = parse_count, requires = "defect")]
    count: usize,

    /// Random seed for the choice of facets: the same seed breaks the same facets
    #[arg(long, value_name = "N", default_value_t = 1, requires = "defect")]
    seed: u64,

    /// Distance by which a nudge moves a corner, or width of a gap
    #[arg(long, value_name = "LENGTH", default_value = "50um", requires = "defect")]
    by: Length,

    /// Where to write the STL: a file, or - for standard output; a file that ends in .step gets
    /// exact surfaces (sphere, torus, cone, tower)
    #[arg(short, long, value_name = "OUT", default_value = "-")]
    output: PathBuf,
}

fn parts() -> impl TypedValueParser<Value = Sample> {
    let value = |part: Sample| PossibleValue::new(part.name()).help(part.description());
    PossibleValuesParser::new(Sample::ALL.map(value))
        .map(|name| Sample::from_name(&name).expect("only names of parts pass"))
}

pub(crate) fn run(args: &SampleArgs, common: &Common) -> Result<(), Exit> {
    let part = args.part;
    check_ending(&args.output, &SAMPLE)?;
    if is_step_name(&args.output) {
        return args.write_step(part, common);
    }
    let mut mesh = build(part, args.facets).map_err(Exit::wrong_options)?;
    if let Some(name) = &args.defect {
        let defect = Defect::from_name(name, args.by.mm() as f32).expect("only names pass");
        inject(&mut mesh, defect, args.count, args.seed);
    }
    let write = |out: &mut dyn Write| {
        if args.ascii {
            mesh.write_ascii_stl(part.name(), out)
        } else {
            mesh.write_stl(part.name(), out)
        }
    };
    if !is_stream(&args.output) {
        write_file(&args.output, write)?;
        say_size(args, common, &mesh);
        return Ok(());
    }
    if io::stdout().is_terminal() {
        return Err(Exit::usage("an STL is not for terminals: name a file with -o, or pipe it on"));
    }
    // Facets are written one by one, 50 bytes each.
    let mut out = BufWriter::new(io::stdout().lock());
    let written = write(&mut out).and_then(|()| out.flush());
    written.map_err(|error| Exit::output(error, "standard output"))
}

impl SampleArgs {
    fn write_step(&self, part: Sample, common: &Common) -> Result<(), Exit> {
        let part = match part {
            Sample::Sphere => StepSample::Sphere,
            Sample::Torus => StepSample::Torus,
            Sample::Cone => StepSample::Cone,
            Sample::Tower => StepSample::Tower,
            _ => {
                let why = format!("{} is available as STL only: name a .stl file", part.name());
                return Err(Exit::usage(why));
            }
        };
        // Exact surfaces have no facets to break.
        if self.ascii || self.defect.is_some() {
            return Err(Exit::usage("--ascii and --defect are for STL: name a .stl file"));
        }
        let text = step(part, StepUnit::Millimetre);
        write_file(&self.output, |out| out.write_all(text.as_bytes()))?;
        Progress::new("sample", common, true).wrote(&self.output, &[]);
        Ok(())
    }
}

fn say_size(args: &SampleArgs, common: &Common, mesh: &Mesh) {
    let progress = Progress::new("sample", common, true);
    progress.wrote(&args.output, &[number_of(mesh.facets.len() as u64, "facet")]);
}
