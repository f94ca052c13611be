//! Describes the contents of a ZIP archive that is not a 3MF package.

use std::io::BufReader;

use lamp_stack::FileFormat;
use zip::ZipArchive;

use crate::error::SliceError;
use crate::part_file::OpenPartFile;
use crate::three_mf::ThreeMfError;

/// Names in archives of programs, in lowercase, and the programs' formats.
const NAMES: &[(&str, FileFormat)] = &[
    (".amf", FileFormat::Model("a packed AMF file")),
    (".brp", FileFormat::Model("a FreeCAD document")),
    (".brep", FileFormat::Model("a FreeCAD document")),
    ("word/document.xml", FileFormat::Document("an Office document")),
    ("xl/workbook.xml", FileFormat::Document("an Office document")),
    ("ppt/presentation.xml", FileFormat::Document("an Office document")),
    ("meta-inf/manifest.mf", FileFormat::Document("a program")),
];

/// Ends of the names of parts.
const PARTS: [&str; 5] = [".stl", ".step", ".stp", ".obj", ".3mf"];

/// Returns the reason why a package cannot be read as 3MF. For a package without a model, the
/// reason names its actual format.
pub(crate) fn not_three_mf(file: &OpenPartFile, error: ThreeMfError) -> SliceError {
    let ThreeMfError::NoModel(_) = error else { return Box::new(error).into() };
    let Ok(archive) = ZipArchive::new(BufReader::new(file.reader())) else {
        return Box::new(error).into();
    };
    let names = archive.file_names().filter_map(Result::ok);
    let names: Vec<String> = names.map(|name| name.to_ascii_lowercase()).collect();
    // Folders have entries of their own.
    let names: Vec<&String> = names.iter().filter(|name| !name.ends_with('/')).collect();
    let find = |end: &str| names.iter().find(|name| name.ends_with(end));
    if let Some((_, format)) = NAMES.iter().find(|(end, _)| find(end).is_some()) {
        return SliceError::OtherFormat(*format);
    }
    // A 3MF package that lacks its model, or a different fault.
    if find(".model").or(find("_rels/.rels")).is_some() {
        return Box::new(error).into();
    }
    match PARTS.iter().find_map(|end| find(end)).or(names.first()) {
        Some(name) => SliceError::OtherArchive { files: names.len(), name: (*name).clone() },
        None => SliceError::OtherFormat(FileFormat::Archive("an empty ZIP archive")),
    }
}
