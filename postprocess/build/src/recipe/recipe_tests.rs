//! Composed layers against the layers of the build, and texts that are not recipes.

use std::fs::{self, File};
use std::ops::Range;
use std::path::{Path, PathBuf};

use lamp_stack::{
    Destination, Format, GrayMask, Image, Layer, Length, Mask, MaskBuilder, Pages, StackError,
    StackInfo, digest_of, write_stack,
};

use super::super::testing::layer;
use super::super::{
    BuildFinding, BuildWanted, CellShape, HeightOptions, Layout, MeshOptions, MeshPattern, Moat,
    Pack, PackBy, PartStack, TileError, Turns,
};
use super::form::RecipeForm;
use super::{Composer, Recipe, RecipeError, RecipePart, TILE_CODE};

/// Numbers that look random, the same each time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: u32) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(end)) as u32
    }
}

/// Boxes that change from layer to layer, within a margin of 2 pixels.
fn boxes(numbers: &mut Numbers, width: u32, height: u32) -> Mask {
    let mut boxes = Vec::new();
    for _ in 0..3 {
        let (left, top) = (2 + numbers.below(width - 8), 2 + numbers.below(height - 8));
        let right = (left + 1 + numbers.below(9)).min(width - 2);
        boxes.push((left..right, top..(top + 1 + numbers.below(7)).min(height - 2)));
    }
    let mut mask = MaskBuilder::new(width);
    for y in 0..height {
        let is_white =
            |x: u32| boxes.iter().any(|(across, down)| across.contains(&x) && down.contains(&y));
        let changes = (0..width).filter(|&x| is_white(x) != (x > 0 && is_white(x - 1)));
        mask.push_row(&changes.collect::<Vec<_>>()).unwrap();
    }
    mask.finish()
}

/// Writes a stack of boxes, and returns its file.
fn written(folder: &Path, name: &str, layers: u32, thickness_um: f64, gray: bool) -> PathBuf {
    let mut numbers = Numbers(layers.into());
    let layers: Vec<Layer> = (0..layers)
        .map(|index| {
            let mask = boxes(&mut numbers, 24, 20);
            let image = if gray && index % 3 == 1 {
                Image::Gray(GrayMask::from(&mask))
            } else {
                mask.into()
            };
            let mut layer = layer(index, image);
            layer.info.z_um = Some(f64::from(index) * thickness_um);
            layer.info.thickness_um = Some(thickness_um);
            layer.info.stray_rows = if index % 7 == 3 { vec![4, 9] } else { Vec::new() };
            let stack =
                StackInfo { part: "p".to_owned(), layers: Some(layers), ..StackInfo::default() };
            layer.info.stack = (index == 0).then_some(stack);
            layer
        })
        .collect();
    let path = folder.join(name);
    let layers = layers.into_iter().map(Ok::<_, StackError>);
    write_stack(layers, Destination::File(path.clone()), Format::Big).unwrap();
    path
}

#[derive(Debug)]
struct Failure;

impl From<TileError> for Failure {
    fn from(error: TileError) -> Self {
        panic!("{error}")
    }
}

/// Reads layers of a stack, as `tile --layers` does.
fn read(path: &Path, layers: Option<&Range<u32>>) -> Vec<Result<Layer, Failure>> {
    let all = Pages::open(path).unwrap().layers().map(|layer| Ok(layer.unwrap()));
    let Some(layers) = layers else { return all.collect() };
    let mut stack = None;
    let mut some = Vec::new();
    for layer in all {
        let mut layer = layer.unwrap();
        let own = layer.info.stack.take().map(|own| own.of_range(layer.info.index, layers));
        stack = own.or(stack);
        if layers.contains(&layer.info.index) {
            layer.info.stack = stack.take();
            some.push(Ok(layer));
        }
    }
    some
}

/// A build to be made in both ways.
struct Plan {
    files: Vec<PathBuf>,
    fit: bool,
    pack: Pack,
    heights: HeightOptions,
    mesh: Option<MeshOptions>,
    layers: Option<Range<u32>>,
}

fn mesh(moat: Moat) -> MeshOptions {
    let [cell, wall] = [9.0, 2.0].map(Length::from_mm);
    MeshOptions {
        pattern: MeshPattern::Cells { shape: CellShape::Hexagon, cell, wall },
        clearance: Length::from_mm(1.5),
        moat,
        least_piece_mm2: 4.0,
        break_width: Length::from_mm(1.0),
        break_pitch: Length::from_mm(11.0),
        base_layers: 3,
    }
}

impl Plan {
    fn of(files: &[PathBuf], moat: Option<Moat>) -> Self {
        Self {
            files: files.to_vec(),
            fit: moat == Some(Moat::Outline),
            pack: Pack::default(),
            heights: HeightOptions::default(),
            mesh: moat.map(mesh),
            layers: None,
        }
    }

    /// Returns the build, and its recipe.
    fn made(&self) -> (Vec<Layer>, Recipe) {
        let from_bottom = self.mesh.as_ref().is_some_and(|mesh| mesh.moat != Moat::Outline);
        let part = |file: &PathBuf| {
            let name = file.file_name().unwrap().to_str().unwrap();
            let mut layers = read(file, self.layers.as_ref()).into_iter();
            match self.fit {
                true => PartStack::of_outline(name, layers).unwrap().unwrap(),
                false => PartStack::of_image(name, &layers.next().unwrap().unwrap()).unwrap(),
            }
        };
        let parts: Vec<PartStack> = self.files.iter().map(part).collect();
        let counts: &[Option<u32>] = if parts.len() > 1 { &[Some(3), Some(2)] } else { &[Some(4)] };
        let area = "110x84mm".parse().unwrap();
        let placed = Layout::packed(parts, counts, area, Length::from_mm(3.0), self.pack).unwrap();
        let named = |file: &PathBuf| {
            let digest = digest_of(File::open(file).unwrap()).unwrap();
            RecipePart::new(file.file_name().unwrap().to_str().unwrap(), digest)
        };
        let files = self.files.iter().map(named).collect();
        let mut recipe =
            Recipe::new(&placed, files, self.heights, self.mesh.as_ref(), self.layers.clone());
        let mut layout = placed;
        if let Some(mesh) = &self.mesh {
            let first = self.layers.as_ref().map_or(0, |layers| layers.start);
            layout = layout.with_mesh(mesh).unwrap().from_layer(first);
        }
        let range = self.layers.clone().map(|l| if from_bottom { 0..l.end } else { l });
        let stacks =
            || self.files.iter().map(|file| read(file, range.as_ref()).into_iter()).collect();
        let told = |found: BuildFinding, recipe: &mut Recipe| {
            if let BuildFinding::Loose(loose) = found {
                recipe.add_loose(loose);
            }
        };
        let walked = layout.clone().build_telling(stacks(), self.heights, wanted(false), |found| {
            told(found, &mut recipe);
        });
        let pages: Vec<Layer> = walked.collect::<Result<_, Failure>>().unwrap();
        let mut again = recipe.clone();
        again.form.loose.clear();
        let build = layout
            .build_telling(stacks(), self.heights, wanted(true), |found| told(found, &mut again));
        let build: Vec<Layer> = build.collect::<Result<_, Failure>>().unwrap();
        assert!(again == recipe, "a walk without images tells the same");
        assert!(pages.iter().map(|page| &page.info).eq(build.iter().map(|layer| &layer.info)));
        (build, recipe)
    }

    /// Checks that composed layers equal the layers of the build, in any order.
    fn check(&self, folder: &Path) {
        let (build, recipe) = self.made();
        let recipe = Recipe::from_json(&recipe.to_json()).map(|read| {
            assert_eq!(read, recipe);
            read
        });
        let recipe = recipe.unwrap();
        let mut composer = Composer::new(&recipe, folder).unwrap();
        assert!(composer.indices().iter().eq(build.iter().map(|layer| &layer.info.index)));
        let mut numbers = Numbers(3);
        for _ in 0..2 * build.len() {
            let expected = &build[numbers.below(build.len() as u32) as usize];
            assert_eq!(composer.layer(expected.info.index).unwrap(), *expected);
        }
        let all: Vec<Layer> = composer.range(0..u32::MAX).unwrap().map(Result::unwrap).collect();
        assert!(all == build);
        let first = build[0].info.index;
        for range in [first..first + 2, first + 5..first + 6, first + 9..u32::MAX] {
            let composed = composer.range(range.clone()).unwrap().map(Result::unwrap);
            let stack = build[0].info.stack.clone().unwrap().of_range(first, &range);
            let some = build.iter().filter(|layer| range.contains(&layer.info.index));
            let mut some: Vec<Layer> = some.cloned().collect();
            some[0].info.stack = Some(stack);
            assert!(composed.collect::<Vec<_>>() == some, "{range:?}");
        }
        let last = build.last().unwrap().info.index;
        let missing = composer.layer(last + 1).unwrap_err().to_string();
        assert_eq!(
            missing,
            format!("the build has no layer {}: it has layers {first} to {last}", last + 1)
        );
        assert!(composer.range(last + 1..last + 9).is_err());
    }
}

fn wanted(images: bool) -> BuildWanted {
    BuildWanted { images, areas: false }
}

#[test]
fn composed_layers_are_those_of_the_build_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let one = [written(folder.path(), "one.tif", 70, 100.0, false)];
    for moat in [None, Some(Moat::Rising), Some(Moat::Layer), Some(Moat::Outline)] {
        let plan = Plan::of(&one, moat);
        plan.check(folder.path());
        Plan { layers: Some(11..60), ..plan }.check(folder.path());
    }
    let two = [
        written(folder.path(), "two.tif", 31, 100.0, true),
        written(folder.path(), "high.tif", 40, 70.0, false),
    ];
    let heights = HeightOptions { settle: true, resample: true };
    for moat in [None, Some(Moat::Rising), Some(Moat::Layer)] {
        let pack = Pack {
            by: PackBy::Outlines,
            turns: Turns::Quarters,
            edge_gap: Length::from_mm(2.0),
            ..Pack::default()
        };
        let plan = Plan { fit: true, heights, pack, ..Plan::of(&two, moat) };
        plan.check(folder.path());
        Plan { layers: Some(4..25), ..plan }.check(folder.path());
    }
    let rows = [vec![0, 3], vec![1], vec![], vec![2, 4]];
    let mut image = MaskBuilder::new(7);
    rows.iter().for_each(|row| image.push_row(row).unwrap());
    let pattern = MeshPattern::Image { name: "w".to_owned(), image: image.finish() };
    let options = MeshOptions { pattern, base_layers: 0, ..mesh(Moat::Layer) };
    Plan { mesh: Some(options), ..Plan::of(&one, None) }.check(folder.path());
}

#[test]
fn pieces_that_float_stand_in_the_recipe() {
    let folder = tempfile::tempdir().unwrap();
    let one = [written(folder.path(), "one.tif", 70, 100.0, false)];
    let plan = Plan::of(&one, Some(Moat::Layer));
    let (_, recipe) = plan.made();
    assert!(recipe.form.loose.iter().any(|pieces| !pieces.starts.is_empty()));
    // Where they are moved, there is no such piece.
    let mut wrong = recipe.clone();
    let pieces = wrong.form.loose.iter_mut().find(|pieces| !pieces.starts.is_empty()).unwrap();
    pieces.starts[0][1] += 1;
    let layer = pieces.layer + 3;
    let error = Composer::new(&wrong, folder.path()).unwrap().layer(layer).unwrap_err();
    assert!(matches!(error, RecipeError::NoPiece { .. }), "{error}");
}

#[test]
fn what_is_no_recipe_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let one = [written(folder.path(), "one.tif", 12, 100.0, false)];
    let plan = Plan { fit: true, ..Plan::of(&one, Some(Moat::Rising)) };
    let text = plan.made().1.to_json();
    let refused = |text: &str| {
        // With a digest of what it says now, if it says something.
        let form = serde_json::from_str::<RecipeForm>(text);
        let text = form.map_or_else(|_| text.to_owned(), |form| form.to_json());
        let composed = Recipe::from_json(&text)
            .and_then(|recipe| Composer::new(&recipe, folder.path()))
            .and_then(|mut composer| composer.range(0..99)?.collect::<Result<Vec<_>, _>>());
        composed.unwrap_err().to_string()
    };
    let changed = Recipe::from_json(&text.replacen("110x84mm", "110x85mm", 1));
    assert!(matches!(changed, Err(RecipeError::Changed)));
    for end in (0..text.len() - 2).step_by(7) {
        assert!(refused(&text[..end]).starts_with("this is not a recipe: "), "{end}");
    }
    let code = format!("\"code\": {TILE_CODE}");
    for (from, to, said) in [
        ("lamp-recipe-1", "lamp-recipe-2", "of the form lamp-recipe-1, but \"lamp-recipe-2\""),
        (&*code, "\"code\": 2", "by code 2"),
        (&*code, "\"cod\": 3", "by code 0"),
        ("\"command\"", "\"comand\"", "comand"),
        ("110x84mm", "-110x84mm", "not a size"),
        ("110x84mm", "1e300x84mm", "2^26 pixels"),
        ("110x84mm", "11x84mm", "copies[0]: it reaches beyond the area"),
        ("\"left\":", "\"left\":4294967295,\"top\":", "duplicate"),
        ("\"part\":0", "\"part\":7", "no such part"),
        ("\"part\":0", "\"part\":-1", "-1"),
        ("one.tif", "two.tif", "No such file"),
        ("one.tif", ".", "this is no file"),
        ("blake3:", "blake3:0", "is not the stack that the recipe is for"),
        ("\"extents\":[2", "\"extents\":[22", "extents: these are not the part's"),
        ("\"extents\":[2", "\"extents\":[4294967295", "extents: these are not the part's"),
        ("\"extents\":[2,2", "\"extents\":[3,2", "not as it was when"),
        ("9mm", "0mm", "no holes"),
        ("9mm", "1e400mm", "not a length"),
        ("\"clearance\":\"1500um", "\"clearance\":\"-1um", "below zero"),
        ("\"clearance\":\"1500um", "\"clearance\":\"1e9um", "wider than the build area"),
        ("\"clearance\":\"1500um", "\"clearance\":\"1500", "no unit"),
        ("\"clearance\":\"1.5mm", "\"clearance\":\"-1um", "below zero"),
        ("\"base_layers\":3", "\"base_layers\":4000000000", "below 100000"),
        ("\"least_piece_mm2\":4.0", "\"least_piece_mm2\":-4.0", "below zero"),
        ("\"rising\"", "\"sinking\"", "sinking"),
        ("\"copies\": [\n", "\"layers\": [9, 9],\n  \"copies\": [\n", "no layer between"),
        ("\"copies\": [\n", "\"layers\": [90, 99],\n  \"copies\": [\n", "one.tif has none of them"),
    ] {
        if text.contains(from) {
            let error = refused(&text.replacen(from, to, 1));
            assert!(error.contains(said) && !error.contains('\n'), "{to}: {error}");
        } else {
            assert!(from.contains("clearance"), "{from} in {text}");
        }
    }
}

#[test]
fn parts_that_changed_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let one = [written(folder.path(), "one.tif", 12, 100.0, false)];
    let (_, recipe) = Plan::of(&one, None).made();
    let path = folder.path().join("build.json");
    fs::write(&path, recipe.to_json()).unwrap();
    let mut bytes = fs::read(&one[0]).unwrap();
    let mut opened = Composer::open(&path).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&one[0], &bytes[..bytes.len() - 1]).unwrap();
    assert!(opened.layer(3).unwrap_err().to_string().contains("has changed since it was opened"));
    let error = Composer::open(&path).err().unwrap().to_string();
    assert!(error.contains("one.tif is not the stack that the recipe is for"), "{error}");
    fs::remove_file(&one[0]).unwrap();
    assert!(matches!(Composer::open(&path), Err(RecipeError::NoPart { .. })));
}
