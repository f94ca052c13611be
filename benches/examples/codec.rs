//! Times decoding and encoding every page of a stack, in seconds.
//!
//! In memory, on one thread, the median of five for each page. `libtiff.c` does the same with
//! libtiff. The `fax` crate must decode every page to the same image.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example codec blade.tif
//! ```

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use lamp_stack::{Image, Mask, Pages, g4};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stack = std::env::args().nth(1).ok_or("name a stack")?;
    let mut masks = Vec::new();
    for layer in Pages::open(Path::new(&stack))?.layers() {
        match layer?.image.into_image() {
            Image::Mask(mask) => masks.push(mask),
            Image::Gray(_) => return Err("only 1-bit stacks are in Group 4".into()),
        }
    }
    let strips: Vec<_> = masks.iter().map(g4::encode).collect();
    for (page, (strip, mask)) in strips.iter().zip(&masks).enumerate() {
        let mut rows = mask.rows();
        let mut same = true;
        fax::decoder::decode_g4(strip.iter().copied(), mask.width(), Some(mask.height()), |row| {
            let row = row.iter().copied().filter(|&column| column < mask.width());
            same &= rows.next().is_some_and(|ours| row.eq(ours.iter().copied()));
        })
        .ok_or("the fax crate cannot decode our strip")?;
        assert!(same && rows.next().is_none(), "the fax crate decodes page {page} otherwise");
    }
    println!("transitions {}", masks.iter().map(Mask::change_count).sum::<usize>());
    let decode = |(strip, mask): (&Vec<u8>, &Mask)| {
        let decoded = g4::decode(strip, mask.width(), mask.height()).expect("our own strip");
        drop(black_box(decoded));
    };
    println!("decode {:.6}", seconds(strips.iter().zip(&masks), decode));
    println!("encode {:.6}", seconds(masks.iter(), |mask| drop(black_box(g4::encode(mask)))));
    Ok(())
}

/// Returns the time of all pages, each the median of five.
fn seconds<T: Copy>(pages: impl Iterator<Item = T>, work: impl Fn(T)) -> f64 {
    pages
        .map(|page| {
            let mut five = [0.0; 5].map(|_: f64| {
                let start = Instant::now();
                work(page);
                start.elapsed().as_secs_f64()
            });
            five.sort_by(f64::total_cmp);
            five[2]
        })
        .sum()
}
