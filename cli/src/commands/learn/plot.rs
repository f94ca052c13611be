//! Plots the errors and the times of a job's prints (004 figures 3.7 and 3.8).

use super::job::{Job, Print};
use super::measured::Measured;
use crate::plots::{Plot, Series, by_layer, curve};

/// The most prints that are drawn: the first, and the last.
const MOST: usize = 8;

/// The plots of a job, one below the other.
pub(super) fn plots_of(job: &Job) -> Vec<Plot> {
    let drawn: Vec<_> = job
        .prints
        .iter()
        .enumerate()
        .filter(|(number, _)| *number == 0 || number + MOST > job.prints.len())
        .collect();
    let mut plots = Vec::new();
    let areas: Vec<_> = drawn.iter().filter_map(|&(n, print)| areas(job, n, print)).collect();
    if !areas.is_empty() {
        let title = "Pixels to cure in each layer; below zero: too many are cured".to_owned();
        plots.push(by_layer(title, "pixels", areas));
    }
    let heights: Vec<_> = drawn.iter().filter_map(|&(n, print)| heights(n, print)).collect();
    if !heights.is_empty() {
        let title = "Measured heights less those of the part".to_owned();
        plots.push(by_layer(title, "error (µm)", heights));
    }
    let times = drawn.iter().map(|(number, print)| {
        let layers = job.part.layers().iter().zip(&print.times).rev();
        let ends = layers.flat_map(|(layer, time)| {
            [layer.z.mm(), layer.z.mm() + layer.thickness.mm()].map(|z| (z, *time))
        });
        curve(&format!("print {number}"), ends.collect())
    });
    plots.push(by_layer("Time of each layer".to_owned(), "exposure (s)", times.collect()));
    plots
}

fn areas(job: &Job, number: usize, print: &Print) -> Option<Series> {
    let (Measured::Areas(rows), _) = print.measured.as_ref()? else { return None };
    let layers = job.part.layers().iter().rev();
    let place = |layer: &lamp_planning::speed::PartLayer| {
        let row = rows.iter().find(|row| row.layer == layer.index)?;
        Some((layer.z.mm(), row.under - row.over))
    };
    Some(curve(&format!("print {number}"), layers.filter_map(place).collect()))
}

fn heights(number: usize, print: &Print) -> Option<Series> {
    let (Measured::Heights(rows), _) = print.measured.as_ref()? else { return None };
    let mut points: Vec<_> =
        rows.iter().map(|row| (row.z_mm, 1000.0 * (row.measured_mm - row.z_mm))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    Some(Series { points, ..curve(&format!("print {number}"), Vec::new()) })
}
