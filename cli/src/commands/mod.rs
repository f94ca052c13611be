//! The commands, one file each: options, a library call, a report.

mod batch;
mod brep;
mod calibrate;
pub(crate) mod check;
mod compare;
mod compensate;
mod completions;
mod compose;
mod config;
mod convert;
mod cure;
mod demo;
mod dither;
mod doctor;
mod edit;
mod expose;
mod fix;
mod frames;
mod heights;
mod help;
mod info;
mod info_fields;
mod job;
mod join;
mod learn;
mod machine;
mod man;
mod material;
mod mesh;
mod mesh_out;
mod orient;
mod pack;
pub(crate) mod plan;
mod print_sim;
mod projector;
mod report;
mod sample;
mod show;
pub(crate) mod slice;
mod split;
pub(crate) mod support;
mod target;
pub(crate) mod tile;
mod verify;
mod view;

use clap::{ArgMatches, FromArgMatches, Subcommand};

use crate::args::options::Common;
use crate::exit::Exit;

#[derive(Subcommand)]
pub(crate) enum Command {
    Slice(slice::SliceArgs),
    Fix(fix::FixArgs),
    Dither(dither::DitherArgs),
    Compensate(compensate::CompensateArgs),
    Edit(edit::EditArgs),
    Tile(tile::TileArgs),
    Compose(compose::ComposeArgs),
    Sample(sample::SampleArgs),
    Demo(demo::DemoArgs),
    Info(info::InfoArgs),
    Verify(verify::VerifyArgs),
    Compare(compare::CompareArgs),
    Check(check::CheckArgs),
    Support(support::SupportArgs),
    Show(show::ShowArgs),
    Report(report::ReportArgs),
    View(view::ViewArgs),
    Convert(convert::ConvertArgs),
    Pack(pack::PackArgs),
    Join(join::JoinArgs),
    Split(split::SplitArgs),
    Job(job::JobArgs),
    Frames(frames::FramesArgs),
    Expose(expose::ExposeArgs),
    Machine(machine::MachineArgs),
    Material(material::MaterialArgs),
    Projector(projector::ProjectorArgs),
    Plan(plan::PlanArgs),
    Learn(learn::LearnArgs),
    PrintSim(print_sim::PrintSimArgs),
    Cure(cure::CureArgs),
    Calibrate(calibrate::CalibrateArgs),
    Target(target::TargetArgs),
    Heights(heights::HeightsArgs),
    Orient(orient::OrientArgs),
    Brep(brep::BrepArgs),
    Mesh(mesh::MeshArgs),
    MeshOut(mesh_out::MeshOutArgs),
    Batch(Box<batch::BatchArgs>),
    Config(config::ConfigArgs),
    Doctor(doctor::DoctorArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
    Help(help::HelpArgs),
}

impl Command {
    /// A stage of the pipeline, called by its own name.
    pub(crate) fn of_stage(name: &str, matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(match name {
            "slice" => Self::Slice(FromArgMatches::from_arg_matches(matches)?),
            "fix" => Self::Fix(FromArgMatches::from_arg_matches(matches)?),
            "dither" => Self::Dither(FromArgMatches::from_arg_matches(matches)?),
            "tile" => Self::Tile(FromArgMatches::from_arg_matches(matches)?),
            _ => unreachable!("{name} is no stage"),
        })
    }

    pub(crate) fn run(&self, common: &Common) -> Result<(), Exit> {
        match self {
            Self::Slice(args) => slice::run(args, common),
            Self::Fix(args) => fix::run(args, common),
            Self::Dither(args) => dither::run(args, common),
            Self::Compensate(args) => compensate::run(args, common),
            Self::Edit(args) => edit::run(args, common),
            Self::Tile(args) => tile::run(args, common),
            Self::Compose(args) => compose::run(args, common),
            Self::Sample(args) => sample::run(args, common),
            Self::Demo(args) => demo::run(args, common),
            Self::Info(args) => info::run(args),
            Self::Verify(args) => verify::run(args, common),
            Self::Compare(args) => compare::run(args, common),
            Self::Check(args) => check::run(args, common),
            Self::Support(args) => support::run(args, common),
            Self::Show(args) => show::run(args, common),
            Self::Report(args) => report::run(args, common),
            Self::View(args) => view::run(args, common),
            Self::Convert(args) => convert::run(args, common),
            Self::Pack(args) => pack::run(args, common),
            Self::Join(args) => join::run(args, common),
            Self::Split(args) => split::run(args, common),
            Self::Job(args) => job::run(args, common),
            Self::Frames(args) => frames::run(args, common),
            Self::Expose(args) => expose::run(args, common),
            Self::Machine(args) => machine::run(args),
            Self::Material(args) => material::run(args, common),
            Self::Projector(args) => projector::run(args),
            Self::Plan(args) => plan::run(args, common),
            Self::Learn(args) => learn::run(args, common),
            Self::PrintSim(args) => print_sim::run(args, common),
            Self::Cure(args) => cure::run(args, common),
            Self::Calibrate(args) => calibrate::run(args, common),
            Self::Target(args) => target::run(args, common),
            Self::Heights(args) => heights::run(args, common),
            Self::Orient(args) => orient::run(args, common),
            Self::Brep(args) => brep::run(args),
            Self::Mesh(args) => mesh::run(args, common),
            Self::MeshOut(args) => mesh_out::run(args, common),
            Self::Batch(args) => batch::run(args, common),
            Self::Config(args) => config::run(args, common),
            Self::Doctor(args) => doctor::run(args),
            Self::Completions(args) => completions::run(args),
            Self::Man(args) => man::run(args),
            Self::Help(args) => help::run(args),
        }
    }
}
