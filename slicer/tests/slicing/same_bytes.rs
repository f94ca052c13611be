//! Layers depend on the part and the options alone: not on threads, memory,
//! the order of facets, or the way the part came in.

use std::fs;

use lamp_fixtures::{Mesh, sphere, tower};
use lamp_slicing::{Fill, LayerHeights, OpenOptions, Part, Shading, SliceOptions, Slices};
use lamp_stack::{DepthLevels, Layer, Length};

use super::common::{
    block, joined, mask, model, options, slice, try_layers, white_pixels, without_stack,
};

/// A binary file, a text and facets in memory, of which no number fills
/// blocks.
#[test]
fn several_files_are_one_part() {
    let meshes = [tower(9_000), sphere(30.0, 5_000), block([-20.0; 3], [9.0; 3])];
    let (mut binary, mut text) = (Vec::new(), Vec::new());
    meshes[0].write_stl("a", &mut binary).unwrap();
    meshes[1].write_ascii_stl("b", &mut text).unwrap();
    let read = || {
        let [a, b] = [("a", &binary), ("b", &text)].map(|(name, bytes)| {
            Part::from_stream(name, &bytes[..], &OpenOptions::default()).unwrap()
        });
        [a, b, Part::from_facets("c", meshes[2].facets.clone())]
    };
    let whole = joined(&meshes);
    for fill in [Fill::EvenOdd, Fill::Solid] {
        for memory in [30_000, 1 << 30] {
            let options = SliceOptions { fill, memory, ..coarse() };
            let layers = try_layers(Part::joined(read().into()), &options).unwrap();
            assert!(without_stack(layers) == without_stack(slice(&whole, &options)));
        }
    }
    let model = Part::joined(read().into());
    assert_eq!((model.name(), model.facet_count()), ("a+b+c", whole.facets.len()));
    let digests = read().map(|model| model.digest().to_owned()).concat();
    assert_eq!(model.digest(), format!("blake3:{}", blake3::hash(digests.as_bytes()).to_hex()));
    let [alone, ..] = read();
    let (name, digest) = (alone.name().to_owned(), alone.digest().to_owned());
    let alone = Part::joined(vec![alone]);
    assert_eq!((alone.name(), alone.digest()), (name.as_str(), digest.as_str()));
}

/// Several blocks of facets, with rows of many crossings.
fn part() -> Mesh {
    tower(20_000)
}

fn coarse() -> SliceOptions {
    options(120.0, 700.0)
}

fn with_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
}

#[test]
fn threads_and_memory_do_not_change_the_layers() {
    let mesh = part();
    let expected = slice(&mesh, &coarse());
    assert!(expected.len() > 100 && white_pixels(&expected) > 100_000);
    for threads in 1..=3 {
        for memory in [1, 3_000, 100_000, 1 << 30] {
            let options = SliceOptions { memory, ..coarse() };
            let layers = with_threads(threads, || slice(&mesh, &options));
            assert!(layers == expected, "{threads} threads, {memory} bytes");
        }
    }
}

/// The facets of one block lie in few of its layers: more crossings come
/// than the memory was planned for.
#[test]
fn crowded_layers_in_little_memory_do_not_change() {
    let needle = block([0.0; 3], [0.1, 0.1, 60.0]);
    for z in [0.0, 30.0, 55.0] {
        let crowd = sphere(2.0, 3_000).map(|p| [p[0], p[1], p[2] + z]);
        let mesh = joined(&[crowd, needle.clone()]);
        let expected = slice(&mesh, &options(2400.0, 100.0));
        for power in [14, 16, 17, 18, 20] {
            let options = SliceOptions { memory: 1 << power, ..options(2400.0, 100.0) };
            assert!(slice(&mesh, &options) == expected, "z {z}, 2^{power} bytes");
        }
    }
}

#[test]
fn threads_may_change_between_layers() {
    let mesh = part();
    let options = SliceOptions { memory: 100_000, ..coarse() };
    let mut slices = Slices::new(model(&mesh), &options).unwrap();
    let mut layers: Vec<Layer> = Vec::new();
    while let Some(layer) = with_threads(1 + layers.len() % 3, || slices.next()) {
        layers.push(layer.unwrap());
    }
    assert!(layers == slice(&mesh, &coarse()));
}

#[test]
fn the_order_of_facets_and_corners_does_not_change_the_layers() {
    let mesh = part();
    let count = mesh.facets.len();
    // A step prime to the count meets every facet.
    let step = (7919..).find(|step| step % 2 == 1 && gcd(*step, count) == 1).unwrap();
    let mixed = (0..count).map(|k| {
        let mut facet = mesh.facets[k * step % count];
        facet.rotate_left(k % 3);
        facet
    });
    let mixed = Mesh { facets: mixed.collect() };
    for fill in [Fill::EvenOdd, Fill::Solid] {
        let options = SliceOptions { fill, memory: 50_000, ..coarse() };
        let [mesh, mixed] = [&mesh, &mixed].map(|mesh| without_stack(slice(mesh, &options)));
        assert!(mesh == mixed, "{fill:?}");
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[test]
fn a_range_of_layers_is_that_part_of_the_whole() {
    let mesh = part();
    let whole = slice(&mesh, &coarse());
    let count = whole.len() as u32;
    for (start, end) in [(0, 1), (0, count), (3, 41), (count - 1, count), (60, count + 100)] {
        let layers = Some(start..end);
        let some = slice(&mesh, &SliceOptions { layers, memory: 20_000, ..coarse() });
        let (start, end) = (start as usize, end.min(count) as usize);
        let mut stack = whole[0].info.stack.clone().unwrap();
        stack.layers = Some((end - start) as u32);
        assert_eq!(some[0].info.stack, Some(stack));
        assert!(without_stack(some) == without_stack(whole[start..end].to_vec()));
    }
}

#[test]
fn files_streams_and_memory_give_the_same_layers() {
    let mesh = part();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    let (mut binary, mut text) = (Vec::new(), Vec::new());
    mesh.write_stl("a tower", &mut binary).unwrap();
    mesh.write_ascii_stl("a tower", &mut text).unwrap();
    let expected = slice(&mesh, &coarse());
    for bytes in [binary, text] {
        fs::write(&path, &bytes).unwrap();
        let from_file =
            try_layers(Part::open(&path, &OpenOptions::default()).unwrap(), &coarse()).unwrap();
        let stream = Part::from_stream("part", &bytes[..], &OpenOptions::default()).unwrap();
        assert_eq!(stream.facet_count(), mesh.facets.len());
        assert!(try_layers(stream, &coarse()).unwrap() == from_file);

        let stack = from_file[0].info.stack.clone().unwrap();
        assert_eq!(stack.part, "part");
        assert_eq!(stack.digest, format!("blake3:{}", blake3::hash(&bytes).to_hex()));
        assert!(without_stack(from_file) == without_stack(expected.clone()));
    }
}

/// The even layers of 700 um as a list of heights.
fn even_heights(mesh: &Mesh) -> LayerHeights {
    let bottom = mesh.bounds_mm().0[2] * 1000.0;
    let count = slice(mesh, &coarse()).len() as u32;
    LayerHeights::new((0..=count).map(|k| bottom + f64::from(k) * 700.0).collect()).unwrap()
}

/// Thick and thin layers, from below the part to above it.
fn uneven_heights() -> LayerHeights {
    let mut boundaries = vec![-500.0];
    while boundaries[boundaries.len() - 1] < 78_000.0 {
        let k = boundaries.len();
        let thickness = [700.0, 100.0, 33.3, 1500.0, 12.7][k * k % 5];
        boundaries.push(boundaries[k - 1] + thickness);
    }
    LayerHeights::new(boundaries).unwrap()
}

#[test]
fn even_heights_as_a_list_make_the_same_layers() {
    let mesh = part();
    let heights = Some(even_heights(&mesh));
    let gray = DepthLevels::new(Length::from_um(900.0), |g| Length::from_um(900.0 * g));
    let shadings = [Shading::White, Shading::ByDepth(gray.into())];
    let cases = shadings.into_iter().flat_map(|it| [(it.clone(), false), (it, true)]);
    for (shading, antialias) in cases {
        let uniform = SliceOptions { shading, antialias, ..coarse() };
        let given = SliceOptions { heights: heights.clone(), ..uniform.clone() };
        assert!(slice(&mesh, &given) == slice(&mesh, &uniform));
    }
}

#[test]
fn uneven_layers_depend_on_the_part_and_their_heights_alone() {
    let mesh = part();
    let heights = uneven_heights();
    let options = SliceOptions { heights: Some(heights.clone()), ..coarse() };
    let expected = slice(&mesh, &options);
    for (layer, ends) in expected.iter().zip(heights.boundaries_um().windows(2)) {
        let (z, thickness) = (layer.info.z_um.unwrap(), layer.info.thickness_um.unwrap());
        assert!((z - ends[0]).abs() < 1e-3 && (z + thickness - ends[1]).abs() < 2e-3);
    }
    let mut reversed = mesh.clone();
    reversed.facets.reverse();
    for (threads, memory) in [(1, 1), (2, 3_000), (3, 100_000), (2, 1 << 30)] {
        let options = SliceOptions { memory, ..options.clone() };
        let layers = with_threads(threads, || slice(&mesh, &options));
        assert!(layers == expected, "{threads} threads, {memory} bytes");
        let layers = with_threads(threads, || slice(&reversed, &options));
        assert!(without_stack(layers) == without_stack(expected.clone()));
    }
}

/// Each layer alone, cut by a plane at its top, is that of the list.
#[test]
fn uneven_layers_are_sections_at_their_tops() {
    let mesh = part();
    let heights = uneven_heights();
    let layers = slice(&mesh, &SliceOptions { heights: Some(heights.clone()), ..coarse() });
    for (layer, ends) in layers.iter().zip(heights.boundaries_um().windows(2)).step_by(7) {
        let alone = LayerHeights::new(ends.to_vec()).unwrap();
        let alone = slice(&mesh, &SliceOptions { heights: Some(alone), ..coarse() });
        assert!(mask(&alone[0]) == mask(layer), "{ends:?}");
    }
    assert_eq!(white_pixels(&layers[..1]), 0);
    assert_eq!(white_pixels(&layers[layers.len() - 1..]), 0);
    let middle = layers.len() / 2;
    assert!(white_pixels(&layers[middle..middle + 1]) > 0);
}
