//! Times the frames of a layer of a job, in frames a second, on all threads.
//!
//! Each thread makes the frames of a swath and sums a word of each, as a controller that takes them
//! would read them.
//!
//! ```sh
//! lamp job build.tif --machine mine.toml --layers 400 -o job/
//! cargo run --release -p lamp-benches --example frames job/ 400
//! ```

use std::path::Path;
use std::time::Instant;

use lamp_gantry::{Frames, GantryError, JobFolder};
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(folder), Some(index)) = (words.next(), words.next()) else {
        return Err("name a job's folder and a layer".into());
    };
    let (folder, index) = (JobFolder::open(Path::new(&folder))?, index.parse::<u32>()?);
    let (job, pages) = (&folder.job, folder.build()?);
    let layer = job.layers.iter().find(|layer| layer.layer == index).ok_or("no such layer")?;
    let count = job.layout().swaths(job.pixels[0])?.count();
    let started = Instant::now();
    let images = pages.swaths(layer.page, 0..count, &job.layout())?;
    println!("read and cut: {:.3} s", started.elapsed().as_secs_f64());
    let mut seconds: Vec<f64> = Vec::new();
    let frames: u64 = layer.swaths.iter().map(|pass| pass.frames).sum();
    for _ in 0..3 {
        let started = Instant::now();
        let sums = layer.swaths.par_iter().map(|pass| {
            let mut frames =
                Frames::new(job.swath(pass, &images[pass.swath as usize])?, &folder.mirrors);
            let mut sum = 0_u64;
            while let Some(frame) = frames.next() {
                let last = frame.words.len() - 1;
                sum = sum.wrapping_add(frame.words[last / 2] ^ frame.words[last]);
            }
            Ok(sum)
        });
        let sums: Result<Vec<u64>, GantryError> = sums.collect();
        std::hint::black_box(sums?);
        seconds.push(started.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    let (swaths, [across, along]) = (layer.swaths.len(), job.mirrors);
    println!(
        "{swaths} swaths, {frames} frames of {across} x {along}: {:.3} s, {:.0} frames a second",
        seconds[1],
        frames as f64 / seconds[1]
    );
    Ok(())
}
