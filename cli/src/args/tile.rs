//! Options of builds.

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Args, Command};
use lamp_build::{Moat, PackBy};
use lamp_pipeline::tile::{MeshSettings, TileSettings, TileTurns};
use lamp_stack::{Length, Size};

use crate::args::options::{one_of_described, parse_area, parse_distance, parse_thickness};

/// How a build is laid out.
#[derive(Args, Clone)]
pub(crate) struct TileStageArgs {
    /// Machine: alpha, beta or a file (see lamp machine). A build beyond its area, height,
    /// resolution or layer thickness is refused
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Build area, for example 4x4.5in or 100x80mm [default: the machine's, or 4x4.5in]
    #[arg(long, value_name = "WxH")]
    area: Option<Size>,

    /// Number of copies of a single stack [default: as many as fit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    copies: Option<u32>,

    /// Use the counts of several stacks as shares: blade.tif:3 core.tif:1 places as many as fit,
    /// three blades per core, to within one copy
    #[arg(long)]
    shares: bool,

    /// Smallest distance between copies [default: twice the mesh's clearance plus 2mm; 1mm with
    /// --mesh none]. With --layout, closer copies cause a warning
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    gap: Option<Length>,

    /// Smallest distance between copies and the area's edges
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    #[arg(default_value = "0mm")]
    edge_gap: Length,

    /// Place parts by the extent of white in all layers, not by their full images. Stacks are read
    /// twice; standard input is kept in a temporary file
    #[arg(long)]
    fit: bool,

    /// Shape that keeps copies apart; outline implies --fit
    #[arg(long, default_value_t, value_parser = one_of_described::<PackBy>(&[
        "The boxes around the parts",
        "The parts' outlines, if these place more copies than boxes: one after another or, for one \
         part, on a lattice",
    ]))]
    pack: PackBy,

    /// Rotations that packing may use if more copies fit [default: none, or quarters with --pack
    /// outline]. An angle below 90deg packs outlines, and writes a script instead of a build
    #[arg(long, value_name = "TURNS", value_parser = TurnsParser)]
    turns: Option<TileTurns>,

    /// Place copies from this file, instead of packing them
    #[arg(long, value_name = "FILE.json")]
    #[arg(conflicts_with_all = ["copies", "shares", "edge_gap", "pack", "turns"])]
    layout: Option<PathBuf>,

    /// Measure heights from each stack's first layer, so that all parts are on the platform
    #[arg(long)]
    settle: bool,

    /// Accept layers that do not match: the build has the heights of the first stack. For each
    /// layer of the build, every other stack supplies the layer that contains the top of the
    /// build's layer
    #[arg(long)]
    resample: bool,

    #[command(flatten)]
    mesh: MeshStageArgs,
}

const HEADING: &str = "Mesh around the parts";

/// Options of the mesh.
#[derive(Args, Clone)]
pub(crate) struct MeshStageArgs {
    /// Mesh around the parts, which keeps the suspension from sloshing: hexagon, square, an image
    /// to repeat, or none
    #[arg(long, value_name = "hexagon|square|none|FILE", default_value = "hexagon")]
    #[arg(help_heading = HEADING)]
    mesh: PathBuf,

    /// Distance between the centers of neighboring cells [default: 5mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    cell: Option<Length>,

    /// Thickness of the walls between cells [default: 500um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    wall: Option<Length>,

    /// Width of the moat that stays free around each part [default: 1mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, help_heading = HEADING)]
    clearance: Option<Length>,

    /// Shape that the moat follows [default: rising]
    #[arg(long, help_heading = HEADING, value_parser = one_of_described::<Moat>(&[
        "The part in each layer and in the layers below it: no mesh is on upward faces",
        "The part in each layer: mesh cures onto upward faces, and in cross bores",
        "The part's outline over all layers, even below downward faces; implies --fit",
    ]))]
    moat: Option<Moat>,

    /// Smallest area of a piece of mesh in a layer. Smaller pieces are left out, as are pieces not
    /// joined to mesh below; 0 keeps all joined pieces [default: 1mm2]
    #[arg(long, value_name = "AREA", value_parser = parse_area, help_heading = HEADING)]
    least_piece: Option<f64>,

    /// Width of the break lines. They run through the mesh from each part up, down, left and right
    /// to the next part or the area's edge; 0 makes none [default: 500um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, help_heading = HEADING)]
    break_width: Option<Length>,

    /// Distance between the break lines of a part [default: 20mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    break_pitch: Option<Length>,

    /// Number of layers of pure mesh below the parts; finished parts break off from them [default:
    /// 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..100_000))]
    #[arg(help_heading = HEADING)]
    base_layers: Option<u32>,
}

impl From<TileStageArgs> for TileSettings {
    fn from(args: TileStageArgs) -> Self {
        Self {
            machine: args.machine,
            area: args.area,
            copies: args.copies,
            shares: args.shares,
            gap: args.gap,
            edge_gap: args.edge_gap,
            fit: args.fit,
            pack: args.pack,
            turns: args.turns,
            layout: args.layout,
            settle: args.settle,
            resample: args.resample,
            mesh: args.mesh.into(),
        }
    }
}

impl From<MeshStageArgs> for MeshSettings {
    fn from(args: MeshStageArgs) -> Self {
        Self {
            mesh: args.mesh,
            cell: args.cell,
            wall: args.wall,
            clearance: args.clearance,
            moat: args.moat,
            least_piece: args.least_piece,
            break_width: args.break_width,
            break_pitch: args.break_pitch,
            base_layers: args.base_layers,
        }
    }
}

/// Parses names and angles.
#[derive(Clone)]
struct TurnsParser;

impl TypedValueParser for TurnsParser {
    type Value = TileTurns;

    fn parse_ref(
        &self,
        command: &Command,
        option: Option<&Arg>,
        value: &OsStr,
    ) -> Result<TileTurns, clap::Error> {
        let parsed = StringValueParser::new().try_map(|text| text.parse::<TileTurns>());
        parsed.parse_ref(command, option, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let values = [
            ("none", "Parts keep their sliced orientation"),
            ("half", "By 180 degrees"),
            ("quarters", "By 90, 180 and 270 degrees"),
            (
                "15deg",
                "By all multiples of 15 degrees, or of another angle that divides a right angle \
                 into at most 18 parts; packed by outlines. Instead of a build, this writes a \
                 script, which slices the parts at the chosen angles and lays the build out",
            ),
        ];
        let values = values.map(|(name, help)| PossibleValue::new(name).help(help));
        Some(Box::new(values.into_iter()))
    }
}

#[cfg(test)]
mod tests {
    use lamp_build::Turns;

    use super::*;

    #[test]
    fn right_angles_are_turns_of_images() {
        let parsed = |text: &str| {
            let option = Arg::new("turns").value_parser(TurnsParser);
            let matches = Command::new("tile").no_binary_name(true).arg(option);
            let matches =
                matches.try_get_matches_from([text]).map_err(|error| error.to_string())?;
            Ok::<_, String>(*matches.get_one::<TileTurns>("turns").unwrap())
        };
        for (text, turns) in
            [("half", Turns::Half), ("quarters", Turns::Quarters), ("90deg", Turns::Quarters)]
        {
            assert_eq!(parsed(text), Ok(TileTurns::Images(turns)), "{text}");
        }
        assert_eq!(parsed("15deg"), Ok(TileTurns::Free("15deg".parse().unwrap())));
        assert!(parsed("7deg").unwrap_err().contains("at most 18"));
        assert!(parsed("some").unwrap_err().contains("none, half, quarters or an angle"));
    }
}
