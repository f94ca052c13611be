//! Options of adaptive layer heights.

use clap::Args;
use lamp_adaptive::{ByHeight, Measure, Roughness, Share};
use lamp_pipeline::heights::{HeightSettings, Seconds};
use lamp_stack::Length;

use crate::args::options::{one_of, parse_thickness};

pub(crate) const HEIGHTS: &str = "Adaptive layer heights";

/// Options of adaptive heights.
#[derive(Args, Clone)]
pub(crate) struct HeightArgs {
    /// Thinnest layer that the machine builds [default: 25um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEIGHTS)]
    min: Option<Length>,

    /// Thickest layer [default: 100um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEIGHTS)]
    max: Option<Length>,

    /// Step of layer thickness: every thickness is a multiple of it [default: 1um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEIGHTS)]
    step: Option<Length>,

    /// Measure of a layer's error: the volume missing or in excess, the height of cusps at its
    /// edge, the roughness Ra of its stairs, or the change of its section's area [default: volume, or
    /// cusp with --cusp, ra with --ra]
    #[arg(long, value_parser = one_of::<Measure>(), help_heading = HEIGHTS)]
    criterion: Option<Measure>,

    /// Largest error of a layer, as a share of its volume, or of its section's area with
    /// --criterion area: 2% or 0.02 [default: 2%]
    ///
    /// 2%@0mm..12mm,0.5%@12mm.. gives each range of height its own bound, in coordinates of the
    /// part. A layer in two ranges keeps the smaller bound
    #[arg(long, value_name = "SHARE", help_heading = HEIGHTS)]
    deviation: Option<ByHeight<Share>>,

    /// Largest cusp height: how far a layer's edge may be off the surface, along its normal
    ///
    /// 20um@0mm..12mm,5um@12mm.. gives each range of height its own bound
    #[arg(long, value_name = "LENGTH", value_parser = parse_lengths, help_heading = HEIGHTS)]
    #[arg(conflicts_with = "deviation")]
    cusp: Option<ByHeight<Length>>,

    /// Largest roughness Ra of the surface's stairs
    ///
    /// 6um@0mm..12mm,2um@12mm.. gives each range of height its own bound
    #[arg(long, value_name = "LENGTH", value_parser = parse_lengths, help_heading = HEIGHTS)]
    #[arg(conflicts_with_all = ["deviation", "cusp"])]
    ra: Option<ByHeight<Length>>,

    /// Roughness of stairs by their cusp height, Ra = K cusp + C, as measured on your machine
    /// [default: 0.25,0um, as of upright edges]
    #[arg(long, value_name = "K,C", help_heading = HEIGHTS)]
    ra_line: Option<Roughness>,

    /// Use at most N layers, with the smallest possible error (found to within one percent)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    #[arg(conflicts_with_all = ["deviation", "cusp", "ra", "time_budget"], help_heading = HEIGHTS)]
    layers_budget: Option<u32>,

    /// Build all layers within this time, for example 8h, 90min or 1200s. It includes exposures,
    /// from --material or --exposure-table, and --layer-overhead
    #[arg(long, value_name = "TIME", help_heading = HEIGHTS)]
    #[arg(conflicts_with_all = ["deviation", "cusp", "ra"])]
    time_budget: Option<Seconds>,

    /// Time per layer in addition to its exposure, mostly for recoating, for example 30s
    #[arg(long, value_name = "TIME", help_heading = HEIGHTS)]
    layer_overhead: Option<Seconds>,

    /// End layers at flat faces where the limits allow
    #[arg(long, help_heading = HEIGHTS)]
    snap: bool,

    /// Distance between the rows in which the error is measured, where facets of one layer lie
    /// above each other; thinner features may be missed there [default: four pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEIGHTS)]
    row_pitch: Option<Length>,
}

impl From<&HeightArgs> for HeightSettings {
    fn from(args: &HeightArgs) -> Self {
        Self {
            min: args.min,
            max: args.max,
            step: args.step,
            criterion: args.criterion,
            deviation: args.deviation.clone(),
            cusp: args.cusp.clone(),
            ra: args.ra.clone(),
            ra_line: args.ra_line,
            layers_budget: args.layers_budget,
            time_budget: args.time_budget,
            layer_overhead: args.layer_overhead,
            row_pitch: args.row_pitch,
            snap: args.snap,
        }
    }
}

/// Parses lengths above zero that may differ by height.
fn parse_lengths(text: &str) -> Result<ByHeight<Length>, String> {
    ByHeight::parse(text, parse_thickness).map_err(|error| error.to_string())
}
