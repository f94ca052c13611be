//! What is done to a part before it is sliced.

use clap::Args;
use lamp_slicer::{Axis, Placement};

use crate::options::one_of;

const HEADING: &str = "Placement of the part, in this order";

/// Options that place a part.
#[derive(Args, Clone)]
pub(crate) struct PlacementOptions {
    /// Make the part larger, by one factor or one for each axis: 1.02 makes up for about 2 % of
    /// shrinkage
    #[arg(long, value_name = "F|X,Y,Z", value_parser = parse_scale, help_heading = HEADING)]
    #[arg(allow_hyphen_values = true)]
    scale: Option<[f64; 3]>,

    /// Mirror the part: x swaps its left and its right
    #[arg(long, value_name = "AXIS", value_parser = one_of::<Axis>(), value_delimiter = ',')]
    #[arg(help_heading = HEADING)]
    mirror: Vec<Axis>,

    /// Turn the part about an axis through 0, by degrees counter-clockwise seen from the axis's
    /// tip; several one after another, as x:90,z:-12.5. Quarter turns are exact
    #[arg(long, value_name = "AXIS:DEGREES", value_parser = parse_rotation)]
    #[arg(value_delimiter = ',', help_heading = HEADING)]
    rotate: Vec<(Axis, f64)>,

    /// Move the part, in millimetres. The image goes with it: its origin and the heights of the
    /// layers are in the coordinates that the part then has
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_translation, help_heading = HEADING)]
    #[arg(allow_hyphen_values = true)]
    translate: Option<[f64; 3]>,
}

impl PlacementOptions {
    pub(crate) fn placement(&self) -> Placement {
        let mut placement = Placement::default().scaled(self.scale.unwrap_or([1.0; 3]));
        for &axis in &self.mirror {
            let mut factors = [1.0; 3];
            factors[axis as usize] = -1.0;
            placement = placement.scaled(factors);
        }
        for &(axis, degrees) in &self.rotate {
            placement = placement.rotated(axis, degrees);
        }
        placement.translated(self.translate.unwrap_or([0.0; 3]))
    }

    /// The options that were given, as the stack remembers them.
    pub(crate) fn command_line(&self) -> String {
        let mut line = String::new();
        if let Some([x, y, z]) = self.scale {
            line += &format!(" --scale {x},{y},{z}");
        }
        if !self.mirror.is_empty() {
            let axes: Vec<String> = self.mirror.iter().map(Axis::to_string).collect();
            line += &format!(" --mirror {}", axes.join(","));
        }
        if !self.rotate.is_empty() {
            let turn = |(axis, degrees): &(Axis, f64)| format!("{axis}:{degrees}");
            let turns: Vec<String> = self.rotate.iter().map(turn).collect();
            line += &format!(" --rotate {}", turns.join(","));
        }
        if let Some([x, y, z]) = self.translate {
            line += &format!(" --translate {x},{y},{z}");
        }
        line
    }
}

/// Parses `X,Y` or `X,Y,Z`.
pub(crate) fn parse_numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
    text.split(',').map(number).collect::<Option<Vec<_>>>()?.try_into().ok()
}

fn parse_scale(text: &str) -> Result<[f64; 3], String> {
    let factors = match parse_numbers(text) {
        Some([factor]) => Some([factor; 3]),
        None => parse_numbers(text),
    };
    let wrong = || format!("`{text}` is not a scale: write a factor, or X,Y,Z, as 1.02,1.02,1.015");
    match factors.ok_or_else(wrong)? {
        factors if factors.contains(&0.0) => Err(format!("`{text}` leaves nothing of the part")),
        factors if factors.iter().any(|&f| f < 0.0) => {
            Err(format!("`{text}` is below zero: --mirror turns a part over"))
        }
        factors => Ok(factors),
    }
}

fn parse_rotation(text: &str) -> Result<(Axis, f64), String> {
    let wrong = || format!("`{text}` is not a rotation: write AXIS:DEGREES, as x:90 or z:-12.5");
    let (axis, degrees) = text.split_once(':').ok_or_else(wrong)?;
    let axis = axis.trim().to_ascii_lowercase().parse().map_err(|_| wrong())?;
    let [degrees] = parse_numbers(degrees).ok_or_else(wrong)?;
    Ok((axis, degrees))
}

fn parse_translation(text: &str) -> Result<[f64; 3], String> {
    parse_numbers(text.trim_end_matches("mm"))
        .ok_or_else(|| format!("`{text}` is not a way: write X,Y,Z in millimetres, as -5,0,12.7"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_people_write() {
        assert_eq!(parse_scale("1.02"), Ok([1.02; 3]));
        assert_eq!(parse_scale("1, 2,.5"), Ok([1.0, 2.0, 0.5]));
        assert_eq!(parse_rotation("x:90"), Ok((Axis::X, 90.0)));
        assert_eq!(parse_rotation("Z: -12.5"), Ok((Axis::Z, -12.5)));
        assert_eq!(parse_translation("-5,0,1e4mm"), Ok([-5.0, 0.0, 1e4]));
        for wrong in ["", "0", "-1", "1,2", "1,2,0", "1,2,3,4", "nan", "inf", "1e999", "two"] {
            assert!(parse_scale(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "x", "x90", "90", "w:90", "x:", "x:nan", "x:inf", "x:1:2"] {
            assert!(parse_rotation(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "1", "1,2", "1,2,3,4", "1,nan,2", "1,2,inf"] {
            assert!(parse_translation(wrong).is_err(), "{wrong}");
        }
    }
}
