//! The meaning of a file name's ending, and the endings that an output may have.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use lamp_stack::{STACK_ENDINGS, StackFormat};

use crate::exit::Exit;
use crate::streams::extension;

/// The output of a command, to a file or a folder. A name may have no ending, one that says
/// nothing, or one of these.
pub(crate) struct Writes {
    /// The sentence for a name with the ending of another format.
    sentence: &'static str,
    endings: &'static [&'static str],
}

/// A stack, as a TIFF or packed.
pub(crate) static STACK: LazyLock<Writes> = LazyLock::new(|| {
    let of_formats = StackFormat::all().filter_map(|format| format.endings().first());
    let of_stacks = of_formats.filter(|ending| STACK_ENDINGS.contains(ending));
    let dotted: Vec<_> = of_stacks.map(|ending| format!(".{ending}")).collect();
    let (last, others) = dotted.split_last().expect("stacks have formats");
    let sentence = format!(
        "a stack is a TIFF, a packed stack or a printer's file: end its name in {} or {last}, or \
         give --format",
        others.join(", ")
    );
    Writes { sentence: sentence.leak(), endings: &STACK_ENDINGS }
});

/// A packed stack.
pub(crate) const PACKED_STACK: Writes =
    Writes { sentence: "end the name of a packed stack in .lamp", endings: &["lamp"] };

/// A picture.
pub(crate) const PNG: Writes =
    Writes { sentence: "the picture is a PNG: end its name in .png", endings: &["png"] };

/// The frames of a swath, or a picture of them.
pub(crate) const FRAMES: Writes = Writes {
    sentence: "frames are written to a file without a known ending, or as a PNG to look at",
    endings: &["png", "apng"],
};

/// A mesh.
pub(crate) const STL: Writes =
    Writes { sentence: "meshes are written as STL: name a .stl file", endings: &["stl"] };

/// A part of another form.
pub(crate) const PART: Writes = Writes {
    sentence: "a part is written as STL or STEP: end its name in .stl or .step",
    endings: &["stl", "step", "stp"],
};

/// A sample part.
pub(crate) const SAMPLE: Writes = Writes {
    sentence: "a sample is an STL or a STEP file: end its name in .stl or .step",
    endings: &["stl", "step", "stp"],
};

const JSON: Writes =
    Writes { sentence: "it is written as JSON: end its name in .json", endings: &["json"] };

const TABLE: Writes =
    Writes { sentence: "a table is CSV: end its name in .csv", endings: &["csv", "txt"] };

const MEASURED: Writes = Writes {
    sentence: "measurements are a table or a file of places: end its name in .csv or .toml",
    endings: &["csv", "txt", "toml"],
};

const TOML: Writes =
    Writes { sentence: "it is written as TOML: end its name in .toml", endings: &["toml"] };

/// A report that browsers show.
pub(crate) const HTML: Writes =
    Writes { sentence: "a report is a web page: end its name in .html", endings: &["html", "htm"] };

/// A folder.
pub(crate) const FOLDER: Writes =
    Writes { sentence: "a folder is written: end its name in /", endings: &[] };

/// Endings of models.
const MODELS: &[&str] = &[
    "stl", "step", "stp", "obj", "3mf", "ply", "off", "amf", "gltf", "glb", "wrl", "vrml", "x3d",
    "dae", "fbx", "3ds", "3dm", "blend", "usd", "usda", "usdz", "dxf", "dwg", "igs", "iges", "sat",
    "sab", "x_t", "x_b", "jt", "brep", "brp", "fcstd", "f3d", "sldprt", "sldasm", "ipt", "iam",
    "catpart", "prt", "scad", "skp", "vtk", "msh", "gds", "gbr", "ger", "gtl", "gbl", "gts", "gbs",
    "gto", "gbo", "gtp", "gbp", "gko", "gm1",
];

/// Endings that name a format, and what it is. All others say nothing.
const FORMATS: [(&[&str], &str); 13] = [
    (&["tif", "tiff", "btf", "tf8"], "a TIFF"),
    (&["lamp"], "a packed stack"),
    (&["png", "apng"], "a PNG"),
    (&["svg", "svgz"], "an SVG"),
    (
        &[
            "bmp", "gif", "jpg", "jpeg", "jp2", "jxl", "webp", "avif", "heic", "pbm", "pgm", "ppm",
            "pnm", "pam", "pcx", "tga", "psd", "exr", "ico", "eps", "ps",
        ],
        "another picture",
    ),
    (&["pdf", "doc", "docx", "odt", "ppt", "pptx", "rtf", "md", "tex"], "a document"),
    (&["html", "htm", "xhtml"], "a web page"),
    (MODELS, "a model"),
    (
        &[
            "sl1", "sl1s", "goo", "ctb", "cbddlp", "photon", "photons", "phz", "pws", "pw0", "pwx",
            "pwmx", "pwmo", "pwms", "pwmb", "pwma", "pm3", "pm3n", "pm5", "dlp", "cws", "cxdlp",
            "cxdlpv4", "fdg", "lgs", "lgs30", "mdlp", "osla", "prz", "qdt", "rgb", "slc", "cli",
            "svgx", "uvj", "zcode", "zcodex", "nanodlp", "gcode", "bgcode", "gco", "nc", "ufp",
            "x3g",
        ],
        "a job of a printer",
    ),
    (&["zip", "gz", "tgz", "tar", "xz", "bz2", "zst", "7z", "rar", "lz4"], "a packed file"),
    (&["json", "jsonl", "xml", "yaml", "yml", "toml", "ini"], "structured text"),
    (&["csv", "tsv", "xls", "xlsx", "ods", "txt"], "a table or text"),
    (&["mp4", "avi", "mov", "mkv", "webm", "npy", "npz", "h5", "nrrd", "mat", "exe"], "other data"),
];

/// Returns whether a name ends in a format of models.
pub(crate) fn is_model_name(path: &Path) -> bool {
    MODELS.contains(&&*extension(path))
}

/// Returns whether a name has an ending, but one that names no format.
pub(crate) fn has_unknown_ending(path: &Path) -> bool {
    let ending = extension(path);
    !ending.is_empty() && !FORMATS.iter().any(|(endings, _)| endings.contains(&&*ending))
}

/// Refuses to write to a name with the ending of another format.
///
/// # Errors
/// Returns wrong usage: a sentence that names the ending and what is written.
pub(crate) fn check_ending(path: &Path, writes: &Writes) -> Result<(), Exit> {
    let ending = extension(path);
    let format = FORMATS.iter().find(|(endings, _)| endings.contains(&&*ending));
    match format {
        // An ending that names no format is no slip: `build.v2` is a name.
        Some((_, format)) if !writes.endings.contains(&&*ending) => {
            let (path, sentence) = (path.display(), writes.sentence);
            Err(Exit::usage(format!("{path}: {sentence} (.{ending} names {format})")))
        }
        _ => Ok(()),
    }
}

/// Refuses to write a format to a name with the ending of another.
///
/// # Errors
/// As [`check_ending`].
pub(crate) fn check_format(path: &Path, format: StackFormat) -> Result<(), Exit> {
    let ending = extension(path);
    let is_zip = matches!(format, StackFormat::Printer(printer) if printer.is_zip());
    let of_other = |(endings, _): &&(&[&str], &str)| endings.contains(&&*ending);
    match FORMATS.iter().find(of_other) {
        Some((_, other))
            if !(format.endings().contains(&&*ending) || is_zip && ending == "zip") =>
        {
            // Stacks have names of their own.
            let other = StackFormat::of_name(path)
                .map(|other| other.to_string())
                .unwrap_or((*other).to_owned());
            let (path, name) = (path.display(), format.name());
            Err(Exit::usage(format!(
                "{path}: .{ending} names {other}, but --format {name} writes {format}: leave out \
                 --format, or give the file another ending"
            )))
        }
        _ => Ok(()),
    }
}

/// Refuses the name of a stack for a file beside one.
///
/// # Errors
/// As [`check_ending`].
pub(crate) fn check_no_stack(path: &Path) -> Result<(), Exit> {
    let ending = extension(path);
    if !STACK.endings.contains(&&*ending) {
        return Ok(());
    }
    let path = path.display();
    Err(Exit::usage(format!("{path}: no stack is written there: leave out .{ending}")))
}

/// Parses the name of a JSON file, or `-` for standard output.
pub(crate) fn parse_report(text: &str) -> Result<PathBuf, String> {
    if text == "-" { Ok(text.into()) } else { parse_json(text) }
}

/// Parses the name of a JSON file. Standard output is for the stack.
pub(crate) fn parse_json(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => Err("standard output is for the stack: name a file, such as report.json".to_owned()),
        "" => Err("name a file, such as report.json".to_owned()),
        name => parse(name, &JSON),
    }
}

/// Parses the name of a CSV file.
pub(crate) fn parse_table(text: &str) -> Result<PathBuf, String> {
    parse(text, &TABLE)
}

/// Parses the name of a file of measurements: a CSV table, or places in TOML.
pub(crate) fn parse_measured(text: &str) -> Result<PathBuf, String> {
    parse(text, &MEASURED)
}

/// Parses the name of a TOML file.
pub(crate) fn parse_toml(text: &str) -> Result<PathBuf, String> {
    parse(text, &TOML)
}

fn parse(text: &str, writes: &Writes) -> Result<PathBuf, String> {
    let path = Path::new(text);
    // Endings of stacks are refused once it is known whether that stack is written or read.
    if STACK.endings.contains(&&*extension(path)) {
        return Ok(path.to_owned());
    }
    match check_ending(path, writes) {
        Ok(()) => Ok(path.to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Returns true if a name ends as a STEP file does.
pub(crate) fn is_step_name(path: &Path) -> bool {
    let is_step = |end: &OsStr| ["step", "stp"].iter().any(|name| end.eq_ignore_ascii_case(name));
    path.extension().is_some_and(is_step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ending_is_in_two_formats() {
        let mut all: Vec<&str> =
            FORMATS.iter().flat_map(|(endings, _)| *endings).copied().collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count);
        let known = |writes: &Writes| writes.endings.iter().all(|end| all.contains(end));
        let kinds = [&*STACK, &PACKED_STACK, &PNG, &STL, &SAMPLE, &JSON, &TABLE, &TOML, &HTML];
        assert!(kinds.into_iter().all(known));
        assert!(
            StackFormat::all().flat_map(StackFormat::endings).all(|ending| all.contains(ending))
        );
    }

    #[test]
    fn the_sentence_of_stacks_names_each_format() {
        let (_, list) = STACK.sentence.split_once(" in ").unwrap();
        let (list, _) = list.split_once(", or give").unwrap();
        let named = list.replace(" or ", ", ");
        let named =
            named.split(", ").map(|ending| StackFormat::of_name(Path::new(&format!("x{ending}"))));
        let named: Vec<_> = named.map(|format| format.unwrap().name()).collect();
        let written = StackFormat::all().filter(|format| {
            !matches!(format, StackFormat::Contours(_)) && !format.endings().is_empty()
        });
        assert_eq!(named, written.map(StackFormat::name).collect::<Vec<_>>());
    }

    #[test]
    fn endings_that_say_nothing_are_no_matter() {
        for name in ["-", "x", "x.part", "blade.v2", "x.out", "x.7", ".hidden", "a.b/x", "x.TIF"] {
            assert!(check_ending(Path::new(name), &STACK).is_ok(), "{name}");
        }
        for name in ["x.cbddlp", "x.PNG", "a.tif.gz", "x.obj", "x.json"] {
            let message = check_ending(Path::new(name), &STACK).unwrap_err().to_string();
            assert!(message.starts_with(&format!("{name}: a stack is a TIFF")), "{message}");
        }
    }
}
