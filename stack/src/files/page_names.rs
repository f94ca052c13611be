//! Chooses and orders the pages of a folder by the names of its files.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::codec::picture_format::PictureFormat;
use crate::error::StackError;
use crate::files::folder_list::FOLDER_LIST;
use crate::files::input::Pages;
use crate::note::{PageGap, StackNote};
use crate::text::one_line;

/// The pages of a folder, and the notes on the names in it.
#[derive(Debug)]
pub(crate) struct PageFiles {
    /// The pages in order.
    pub(crate) files: Vec<PathBuf>,
    /// Reasons to doubt that the names belong to one whole stack. The texts of pages, where they
    /// have any, prove more.
    pub(crate) doubts: Vec<StackNote>,
    /// The files that are left out.
    pub(crate) left_out: Vec<StackNote>,
}

impl PageFiles {
    /// Lists a folder. Its pages are the pictures with a number in their names, or all pictures if
    /// most have none. Numbers are compared as numbers.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be read, if two names have one page number, or if pages
    /// are of two formats.
    pub(crate) fn of(folder: &Path) -> Result<Self, StackError> {
        let (mut pages, mut pictures, mut files) = (Vec::new(), Vec::new(), Vec::new());
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            match page_format(&entry.path()) {
                _ if entry.path().is_dir() || name == FOLDER_LIST => {}
                None => files.push(name),
                // macOS and other systems put pictures of their own next to files.
                Some(_) if name.starts_with('.') => pictures.push(name),
                // A pipe would wait for a writer.
                Some(_) if entry.path().metadata().is_ok_and(|it| !it.is_file()) => {
                    return Err(StackError::NoFile { name: one_line(&name) });
                }
                Some(format) => pages.push(PictureFile::new(entry.path(), name, format)),
            }
        }
        let is_usual = |page: &PictureFile| matches!(page.format, "TIFF" | "PNG");
        // Next to TIFF and PNG pages, pictures in other formats are previews and the like.
        if pages.iter().any(is_usual) {
            pictures.extend(pages.extract_if(.., |page| !is_usual(page)).map(|page| page.name));
        }
        read_fractions(&mut pages);
        pages.sort_by(PictureFile::order);
        let forms = keep_numbered(&mut pages, &mut pictures)?;
        if let Some(pair) = pages.windows(2).find(|pair| pair[0].format != pair[1].format) {
            let mut formats = [pair[0].format, pair[1].format];
            formats.sort_unstable();
            return Err(StackError::MixedPages { formats });
        }
        let gaps = gaps(&largest_form(&pages));
        let gaps = (!gaps.is_empty()).then_some(StackNote::Gaps(gaps));
        let note = |mut names: Vec<String>, note: fn(Vec<String>) -> StackNote| {
            names.sort_unstable();
            (!names.is_empty()).then(|| note(names))
        };
        let pictures = note(pictures, StackNote::OtherPictures);
        let files = note(files, StackNote::OtherFiles);
        Ok(Self {
            files: pages.into_iter().map(|page| page.path).collect(),
            doubts: [forms, gaps].into_iter().flatten().collect(),
            left_out: [pictures, files].into_iter().flatten().collect(),
        })
    }
}

/// Returns the format of a folder's file by its name, if it is one of pages.
fn page_format(file: &Path) -> Option<&'static str> {
    let extension = file.extension()?.to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "tif" | "tiff" => Some("TIFF"),
        "png" => Some("PNG"),
        extension => PictureFormat::of_extension(extension).map(PictureFormat::name),
    }
}

/// A picture in a folder.
struct PictureFile {
    path: PathBuf,
    name: String,
    format: &'static str,
    /// The texts around the numbers in its name, without the extension: one more than numbers.
    texts: Vec<String>,
    numbers: Vec<Number>,
}

/// A number in a name, as it is written.
#[derive(Clone, Debug)]
struct Number {
    whole: String,
    /// The digits after a decimal point, if there is one.
    fraction: String,
}

impl Number {
    /// Compares values. Names may have more digits than any type of numbers.
    fn order(&self, other: &Self) -> Ordering {
        let digits = |number: &Self| {
            // Without zeros in front, the longer number is the greater.
            let whole = number.whole.trim_start_matches('0').to_owned();
            (whole.len(), whole, number.fraction.trim_end_matches('0').to_owned())
        };
        digits(self).cmp(&digits(other))
    }

    /// Returns the value, if it is exact.
    fn value(&self) -> Option<f64> {
        // Doubles hold 15 decimal digits exactly.
        let is_short = self.whole.len() + self.fraction.len() <= 15;
        is_short.then(|| format!("{}.{}", self.whole, self.fraction).parse().ok())?
    }

    fn written(&self) -> String {
        match &*self.fraction {
            "" => self.whole.clone(),
            fraction => format!("{}.{fraction}", self.whole),
        }
    }
}

impl PictureFile {
    fn new(path: PathBuf, name: String, format: &'static str) -> Self {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let (mut texts, mut numbers) = (vec![String::new()], Vec::<Number>::new());
        let mut in_number = false;
        for c in stem.chars() {
            let text = texts.last_mut().expect("there is a first text");
            match (c.is_ascii_digit(), in_number) {
                (false, _) => text.push(c),
                (true, false) => {
                    texts.push(String::new());
                    numbers.push(Number { whole: c.to_string(), fraction: String::new() });
                }
                (true, true) => numbers.last_mut().expect("a number began").whole.push(c),
            }
            in_number = c.is_ascii_digit();
        }
        Self { path, name, format, texts, numbers }
    }

    /// Returns the first number after which the next is its fraction: `0.05`, but not `1.2.3`.
    fn point(&self, from: usize) -> Option<usize> {
        let is_point = |text: usize| self.texts.get(text).is_some_and(|text| text == ".");
        (from..self.numbers.len().saturating_sub(1))
            .find(|&i| is_point(i + 1) && !is_point(i) && !is_point(i + 2))
    }

    fn order(&self, other: &Self) -> Ordering {
        let pairs =
            self.numbers.iter().zip(&other.numbers).zip(self.texts.iter().zip(&other.texts));
        let first = pairs.map(|((a, b), texts)| texts.0.cmp(texts.1).then_with(|| a.order(b)));
        first
            .fold(Ordering::Equal, Ordering::then)
            .then_with(|| {
                let both = self.numbers.len().min(other.numbers.len());
                self.texts[both..].cmp(&other.texts[both..])
            })
            .then_with(|| self.numbers.len().cmp(&other.numbers.len()))
    }

    /// Returns the width and height, if the picture can be read.
    fn size(&self) -> Option<[u32; 2]> {
        Some(Pages::open(&self.path).ok()?.headers().next()?.ok()?.size)
    }
}

/// Joins numbers with their fractions, unless the digits after the points count on as whole
/// numbers do: in `1.9` and `1.10`, a fraction would not need its zero.
fn read_fractions(pages: &mut [PictureFile]) {
    let points = |page: &PictureFile| {
        let next = |&i: &usize| page.point(i + 1);
        std::iter::successors(page.point(0), next).collect::<Vec<_>>()
    };
    let fractions = || {
        pages.iter().flat_map(|page| points(page).into_iter().map(|i| &page.numbers[i + 1].whole))
    };
    let shortest = fractions().map(String::len).min().unwrap_or(0);
    if fractions().any(|digits| digits.len() > shortest && digits.ends_with('0')) {
        return;
    }
    for page in pages {
        while let Some(i) = page.point(0) {
            page.numbers[i].fraction = page.numbers.remove(i + 1).whole;
            page.texts.remove(i + 1);
        }
    }
}

/// Returns the pages of the form that most names have: they differ in numbers alone.
fn largest_form(pages: &[PictureFile]) -> Vec<&PictureFile> {
    let mut forms: BTreeMap<&[String], Vec<&PictureFile>> = BTreeMap::new();
    for page in pages {
        forms.entry(&page.texts).or_default().push(page);
    }
    // `max_by_key` takes the last of several, and the first form should win.
    forms.into_values().rev().max_by_key(Vec::len).unwrap_or_default()
}

/// Moves pictures without the names of pages to `others`: where most have a number, pictures that
/// have none, and pictures with another form of name and another size. Returns a doubt if names of
/// several forms remain.
fn keep_numbered(
    pages: &mut Vec<PictureFile>,
    others: &mut Vec<String>,
) -> Result<Option<StackNote>, StackError> {
    let has_number = |page: &PictureFile| !page.numbers.is_empty();
    let numbered = pages.iter().filter(|page| has_number(page)).count();
    if numbered == 0 {
        return Ok(None);
    }
    if 2 * numbered >= pages.len() {
        others.extend(pages.extract_if(.., |page| !has_number(page)).map(|page| page.name));
    }
    let is_twice = |pair: &&[PictureFile]| {
        has_number(&pair[0]) && pair[0].order(&pair[1]).is_eq() && pair[0].format == pair[1].format
    };
    // In order, pages of one number are neighbors.
    if let Some(pair) = pages.windows(2).find(is_twice) {
        return Err(StackError::SamePage { files: [pair[0].name.clone(), pair[1].name.clone()] });
    }
    let form = largest_form(pages);
    if form.len() == pages.len() {
        return Ok(None);
    }
    let texts = form[0].texts.clone();
    let of_form = |page: &PictureFile| page.texts == texts;
    if form.len() > 1 {
        let size = form[0].size();
        // A picture that cannot be read stays, for reading it says why.
        let is_other = |page: &mut PictureFile| {
            !of_form(page) && size.zip(page.size()).is_some_and(|(form, size)| form != size)
        };
        let other: Vec<PictureFile> = pages.extract_if(.., is_other).collect();
        others.extend(other.into_iter().map(|page| page.name));
        let (form, rest): (Vec<&PictureFile>, Vec<_>) =
            pages.iter().partition(|page| of_form(page));
        refuse_copies(&form, &rest)?;
    }
    let mut forms: BTreeMap<&[String], &str> = BTreeMap::new();
    for page in &*pages {
        forms.entry(&page.texts).or_insert(&page.name);
    }
    let names: Vec<String> = forms.into_values().map(str::to_owned).collect();
    Ok((names.len() > 1).then_some(StackNote::Forms(names)))
}

/// Refuses a picture that is a copy of a page by its name, as `5 (1).png` is of `5.png`.
fn refuse_copies(form: &[&PictureFile], others: &[&PictureFile]) -> Result<(), StackError> {
    let Some((position, _)) = page_numbers(form) else { return Ok(()) };
    for other in others {
        let is_original = |page: &&&PictureFile| {
            let numbers = page.numbers[..=position].iter();
            other.numbers.len() > position
                && page.texts[..=position] == other.texts[..=position]
                && numbers.zip(&other.numbers).all(|(a, b)| a.order(b).is_eq())
        };
        // File managers put a space before the mark of a copy, or a bracket.
        let is_marked =
            other.texts.get(position + 1).is_some_and(|text| text.starts_with([' ', '(']));
        if let Some(page) = form.iter().find(is_original).filter(|_| is_marked) {
            let files = [page.name.clone(), other.name.clone()];
            return Err(StackError::SamePage { files });
        }
    }
    Ok(())
}

/// Returns which number in names of one form counts the pages, and its values: one that increases
/// in equal steps, or else one that increases, or else the last one.
fn page_numbers(form: &[&PictureFile]) -> Option<(usize, Vec<f64>)> {
    let values = |position: usize| {
        let values = form.iter().map(|page| page.numbers[position].value());
        Some((position, values.collect::<Option<Vec<f64>>>()?))
    };
    let varies = |(_, values): &(usize, Vec<f64>)| values.iter().any(|value| *value != values[0]);
    let count = form.first()?.numbers.len();
    let mut varying: Vec<_> = (0..count).filter_map(values).filter(varies).collect();
    let increase = |(_, values): &(usize, Vec<f64>)| values.is_sorted_by(|a, b| a < b);
    let run_on = |numbers: &(usize, Vec<f64>)| {
        // Values that vary are two at least.
        let step = numbers.1[1] - numbers.1[0];
        increase(numbers) && numbers.1.windows(2).all(|pair| is_step(pair, step))
    };
    let best = varying.iter().position(run_on).or_else(|| varying.iter().position(increase));
    match best {
        Some(best) => Some(varying.swap_remove(best)),
        None => varying.pop(),
    }
}

/// Returns whether two numbers differ by a step. Fractions are not exact in binary.
fn is_step(pair: &[f64], step: f64) -> bool {
    (pair[1] - pair[0] - step).abs() <= 1e-6 * step.abs()
}

/// Returns where the numbers of pages do not run on in their usual step.
fn gaps(form: &[&PictureFile]) -> Vec<PageGap> {
    let Some((position, values)) = page_numbers(form) else { return Vec::new() };
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_by(f64::total_cmp);
    let alike = steps.chunk_by(|a, b| is_step(&[0.0, *b], *a));
    // Of several steps that are as frequent, the least.
    let Some(step) = alike.rev().max_by_key(|alike| alike.len()).map(|alike| alike[0]) else {
        return Vec::new();
    };
    let decimals = form.iter().map(|page| page.numbers[position].fraction.len()).max();
    let decimals = decimals.unwrap_or(0);
    let mut gaps = Vec::new();
    for (pages, pair) in form.windows(2).zip(values.windows(2)) {
        if is_step(pair, step) {
            continue;
        }
        let missing = ((pair[1] - pair[0]) / step).round() - 1.0;
        let is_whole = missing >= 1.0 && is_step(pair, step * (missing + 1.0));
        let name = |value: f64| name_with(pages[0], position, value, decimals);
        gaps.push(PageGap {
            before: pages[0].name.clone(),
            after: pages[1].name.clone(),
            missing: is_whole.then(|| [name(pair[0] + step), name(pair[1] - step)]),
        });
    }
    gaps
}

/// Returns the name of a page with another number, written alike.
fn name_with(page: &PictureFile, position: usize, value: f64, decimals: usize) -> String {
    let point = usize::from(decimals > 0);
    let width = page.numbers[position].whole.len() + point + decimals;
    let mut name = page.texts[0].clone();
    for (i, (number, text)) in page.numbers.iter().zip(&page.texts[1..]).enumerate() {
        match i == position {
            true => name += &format!("{value:0width$.decimals$}"),
            false => name += &number.written(),
        }
        name += text;
    }
    let extension = page.path.extension().unwrap_or_default().to_string_lossy();
    format!("{name}.{extension}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the pages and notes of a folder of empty files.
    fn found(names: &[&str]) -> Result<PageFiles, StackError> {
        let folder = tempfile::tempdir()?;
        for name in names {
            fs::write(folder.path().join(name), b"")?;
        }
        PageFiles::of(folder.path())
    }

    fn names(found: &PageFiles) -> Vec<String> {
        let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
        found.files.iter().map(name).collect()
    }

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let order: [&[&str]; 4] = [
            &["p9.tif", "p9b.tif", "p10.tif", "p100.tif"],
            &["layer_99999.tif", "layer_100000.tif"],
            &["1.9.png", "1.10.png", "1.11.png"],
            &["z0.05.png", "z0.1.png", "z0.15.png", "z0.2.png", "z1.png", "z1.05.png", "z10.0.png"],
        ];
        for order in order {
            let mut shuffled = order.to_vec();
            shuffled.rotate_left(1);
            shuffled.reverse();
            assert_eq!(names(&found(&shuffled).unwrap()), order);
        }
    }

    #[test]
    fn numbers_that_do_not_run_on_are_doubts() {
        let run_on: [&[&str]; 14] = [
            &["1.png"],
            &["00001.png", "00002.png", "00003.png"],
            &["9.tif", "10.tif", "11.tif"],
            &["10.tif", "20.tif", "30.tif"],
            &["0.bmp", "2.bmp", "4.bmp"],
            &["7.png", "9.png"],
            &["a.png", "b.png", "c.png"],
            &["part2_001.png", "part2_002.png"],
            &["1_of_3.png", "2_of_3.png", "3_of_3.png"],
            &["z0.05.png", "z0.10.png", "z0.15.png", "z0.20.png"],
            &["z0.1.png", "z0.15.png", "z0.2.png", "z0.25.png"],
            // The index runs on, the heights need not.
            &["0001_0.05.png", "0002_0.15.png", "0003_0.20.png"],
            &["0.05_0001.png", "0.15_0002.png", "0.20_0003.png"],
            &["IMG_99999999999999999999.png", "IMG_99999999999999999998.png"],
        ];
        for names in run_on {
            assert_eq!(found(names).unwrap().doubts, [], "{names:?}");
        }
        let gaps: [(&[&str], &str); 9] = [
            (&["1.png", "2.png", "4.png"], "page 3.png is missing (4.png follows 2.png)"),
            (
                &["a_009.tif", "a_008.tif", "a_013.tif", "a_014.tif"],
                "pages a_010.tif to a_012.tif are missing (a_013.tif follows a_009.tif)",
            ),
            (
                &["10.png", "20.png", "30.png", "50.png"],
                "page 40.png is missing (50.png follows 30.png)",
            ),
            (
                &["10.png", "20.png", "30.png", "35.png"],
                "the page numbers do not continue (35.png follows 30.png)",
            ),
            (
                &["z0.05.png", "z0.10.png", "z0.20.png"],
                "page z0.15.png is missing (z0.20.png follows z0.10.png)",
            ),
            (
                &["1_0.05.png", "2_0.10.png", "4_0.20.png"],
                "page 3_0.10.png is missing (4_0.20.png follows 2_0.10.png)",
            ),
            (
                &["a1.png", "a3.png", "a4.png", "a6.png", "a7.png"],
                "page a2.png is missing (a3.png follows a1.png); page a5.png is missing (a6.png \
                 follows a4.png)",
            ),
            // Two stacks in one folder.
            (
                &["p1_l1.png", "p1_l2.png", "p1_l3.png", "p2_l1.png", "p2_l2.png"],
                "the page numbers do not continue (p2_l1.png follows p1_l3.png)",
            ),
            (&["0.png", "00003.png", "1.png"], "page 2.png is missing (00003.png follows 1.png)"),
        ];
        for (names, text) in gaps {
            let doubts = found(names).unwrap().doubts;
            assert_eq!(doubts.iter().map(ToString::to_string).collect::<Vec<_>>(), [text]);
            assert!(doubts[0].is_doubt());
        }
    }

    #[test]
    fn pictures_that_are_no_pages_are_left_out() {
        let found = found(&[
            "1.png",
            "2.png",
            "3.png",
            "thumb.png",
            "._2.png",
            ".DS_Store",
            "Thumbs.db",
            "cover.jpg",
        ]);
        let found = found.unwrap();
        assert_eq!(names(&found), ["1.png", "2.png", "3.png"]);
        assert_eq!(found.doubts, []);
        let texts: Vec<String> = found.left_out.iter().map(ToString::to_string).collect();
        assert_eq!(
            texts,
            [
                "._2.png, cover.jpg, thumb.png are left out: their names are not page names",
                ".DS_Store, Thumbs.db are left out: they are not pictures",
            ]
        );
        assert!(found.left_out[0].is_doubt() && !found.left_out[1].is_doubt());
    }

    #[test]
    fn pictures_of_another_size_and_form_of_name_are_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let picture = |name: &str, width: u32| {
            image::GrayImage::new(width, 8).save(folder.path().join(name)).unwrap();
        };
        for page in 1..=4 {
            picture(&format!("{page}.bmp"), 9);
        }
        picture("3d.bmp", 5);
        picture("thumbnail400x400.bmp", 4);
        picture("base_1.bmp", 9);
        let found = PageFiles::of(folder.path()).unwrap();
        assert_eq!(names(&found), ["1.bmp", "2.bmp", "3.bmp", "4.bmp", "base_1.bmp"]);
        let notes: Vec<String> =
            found.left_out.iter().chain(&found.doubts).map(ToString::to_string).collect();
        assert_eq!(notes.len(), 2, "{notes:?}");
        assert_eq!(
            notes[0],
            "3d.bmp, thumbnail400x400.bmp are left out: their names are not page names"
        );
        assert!(notes[1].contains("several forms (1.bmp, base_1.bmp)"), "{}", notes[1]);
    }

    #[test]
    fn two_pages_of_one_number_are_refused() {
        for [one, other] in [
            ["1.tif", "001.tif"],
            ["2.tif", "2.tiff"],
            ["2.TIF", "2.tif"],
            ["2.tif", "2 (1).tif"],
            ["2.tif", "2 - Copy.tif"],
        ] {
            let error = found(&["3.tif", "4.tif", "z0.3.tif", one, other]).unwrap_err();
            let StackError::SamePage { files } = error else { panic!("{error}") };
            assert!(files.iter().all(|file| [one, other].contains(&&**file)), "{files:?}");
        }
        let error = found(&["1.tif", "2.png"]).unwrap_err();
        assert!(matches!(error, StackError::MixedPages { .. }));
    }
}
