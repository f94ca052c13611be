use clap::Args;
use lamp_postprocess::Band;
use lamp_stack::{Image, Layer, PageInfo};

use crate::options::{Common, Input, Output};
use crate::stop::Stop;
use crate::streams::{read_layers, report, write_layers};

/// Correct stray rows: rows that a gap in the mesh made run to the image's edge
///
/// A row is stray if it ends white (every part leaves the last column black), or if `slice` found that its crossings do not balance. Each
/// pixel of a band of stray rows takes the colour that the good rows above and below share. What
/// was changed is said for each layer and stands on its page. Gray layers pass unchanged.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix > blade.tif
  fix stack.tif -o fixed.tif
  fix pages/ --layers 100..200 -o fixed/")]
pub(crate) struct FixArgs {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(args: &FixArgs, common: &Common) -> Result<(), Stop> {
    let report = report("fix", common, &args.output);
    let mut gray = 0;
    let layers = read_layers(&args.input, &report)?.inspect(|layer| {
        gray += u64::from(matches!(layer, Ok(Layer { image: Image::Gray(_), .. })));
    });
    let fixed = lamp_postprocess::fix(layers, |info, bands| {
        report.say(&describe(info, bands));
    });
    write_layers(fixed, &args.output, &report)?;
    if gray > 0 {
        report.say(&format!(
            "{gray} gray layers passed unchecked: stray rows are only found in 1-bit layers"
        ));
    }
    Ok(())
}

/// `layer 812 (z 81.20 mm): rows 1034-1036, 1070 corrected, 214 pixels changed`.
fn describe(info: &PageInfo, bands: &[Band]) -> String {
    let rows: Vec<String> = bands
        .iter()
        .map(|&Band { first_row, rows, .. }| match rows {
            1 => first_row.to_string(),
            _ => format!("{first_row}-{}", first_row + rows - 1),
        })
        .collect();
    let word = if bands.len() == 1 && bands[0].rows == 1 { "row" } else { "rows" };
    let pixels: u64 = bands.iter().map(|band| band.pixels).sum();
    format!("{}: {word} {} corrected, {pixels} pixels changed", info.name(), rows.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_is_described_in_one_line() {
        let info = PageInfo { index: 812, z_um: Some(81_200.0), ..PageInfo::default() };
        let band = |first_row, rows| Band { first_row, rows, pixels: 107 };
        assert_eq!(
            describe(&info, &[band(1034, 3), band(1070, 1)]),
            "layer 812 (z 81.20 mm): rows 1034-1036, 1070 corrected, 214 pixels changed"
        );
        assert_eq!(
            describe(&PageInfo::default(), &[band(7, 1)]),
            "layer 0: row 7 corrected, 107 pixels changed"
        );
    }
}
