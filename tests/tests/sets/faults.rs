//! Forms of a stack, and what is wrong with them.

use std::fs;
use std::path::Path;

use lamp_tests::Scratch;

/// A form of a stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    File,
    Classic,
    Folder,
    Pngs,
    Packed,
    Strips,
    Fields,
    Pipe,
}

/// A fault of a set of pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    FirstMissing,
    MiddleMissing,
    LastMissing,
    Twice,
    Swapped,
    OfAnother,
    Cut,
    Empty,
    Changed,
    Unreadable,
}

use Fault::{
    Changed, Cut, Empty, FirstMissing, LastMissing, MiddleMissing, OfAnother, Swapped, Twice,
    Unreadable,
};

/// The pages of the good stack, and the strips and rows of fields of a build of it.
const PAGES: usize = 6;
const STRIPS: usize = 4;
const ROWS: usize = 4;

impl Form {
    pub(crate) const ALL: [Self; 8] = [
        Self::File,
        Self::Classic,
        Self::Folder,
        Self::Pngs,
        Self::Packed,
        Self::Strips,
        Self::Fields,
        Self::Pipe,
    ];

    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Classic => "classic",
            Self::Folder => "folder",
            Self::Pngs => "PNGs",
            Self::Packed => "packed",
            Self::Strips => "strips",
            Self::Fields => "fields",
            Self::Pipe => "pipe",
        }
    }

    /// Returns the name of the stack.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::File | Self::Classic | Self::Pipe => "stack.tif",
            Self::Folder | Self::Pngs | Self::Strips | Self::Fields => "stack",
            Self::Packed => "stack.lamp",
        }
    }

    /// Returns what can be wrong with it.
    pub(crate) fn faults(self) -> &'static [Fault] {
        match self {
            Self::Folder | Self::Pngs | Self::Strips | Self::Fields => &[
                FirstMissing,
                MiddleMissing,
                LastMissing,
                Twice,
                Swapped,
                OfAnother,
                Cut,
                Empty,
                Changed,
                Unreadable,
            ],
            Self::File | Self::Classic | Self::Pipe => {
                &[FirstMissing, MiddleMissing, LastMissing, Twice, Swapped, Cut, Empty, Changed]
            }
            Self::Packed => &[Cut, Empty, Changed],
        }
    }

    /// Writes the stack, whole or with a fault, over what is there.
    pub(crate) fn write(self, folder: &Scratch, fault: Option<Fault>) {
        let path = folder.path(self.name());
        let _ = fs::remove_file(&path);
        let _ = fs::remove_dir_all(&path);
        // A form is written once, and copied for each command and fault.
        let whole = format!("{}-{}", self.label(), self.name());
        if !folder.path(&whole).exists() {
            folder.run(&format!("lamp {}", self.line("good.tif", &whole))).succeeds_quietly();
        }
        copy(&folder.path(&whole), &path);
        match (self, fault) {
            (_, None) => {}
            (Self::Folder | Self::Pngs | Self::Strips | Self::Fields, Some(fault)) => {
                self.break_folder(folder, fault);
            }
            (_, Some(fault)) => {
                let bytes = broken_file(folder.bytes(self.name()), fault);
                folder.write(self.name(), &bytes);
            }
        }
    }

    /// Returns the command that writes a stack in this form.
    fn line(self, from: &str, to: &str) -> String {
        match self {
            Self::File | Self::Pipe => format!("convert {from} -q -o {to}"),
            Self::Classic => format!("convert {from} -q --classic -o {to}"),
            Self::Folder => format!("convert {from} -q -o {to}/"),
            Self::Pngs => format!("convert {from} -q --png -o {to}/"),
            Self::Packed => format!("pack {from} -q -o {to}"),
            Self::Strips => format!(
                "tile {from} --area 40x40mm --mesh none --strips {to} --mirrors 20 -q -o x.tif"
            ),
            // A column of fields, so that their names count.
            Self::Fields => {
                format!("tile {from} --area 40x40mm --mesh none --fields 80x20 -q -o {to}/")
            }
        }
    }

    fn break_folder(self, folder: &Scratch, fault: Fault) {
        let (start, end, digits, count) = match self {
            Self::Strips => ("strip", ".tif", 3, STRIPS),
            Self::Fields => ("field", "_000.tif", 3, ROWS),
            Self::Pngs => ("layer", ".png", 5, PAGES),
            _ => ("layer", ".tif", 5, PAGES),
        };
        let name = |number: usize| format!("{start}_{number:0digits$}{end}");
        let page = |number: usize| folder.path("stack").join(name(number));
        let remove = |number: usize| fs::remove_file(page(number)).unwrap();
        let (middle, last) = (count / 2, count - 1);
        match fault {
            FirstMissing => remove(0),
            MiddleMissing => remove(middle),
            LastMissing => remove(last),
            Twice => drop(fs::copy(page(middle), page(count)).unwrap()),
            Swapped => {
                let aside = folder.path("stack/aside");
                fs::rename(page(middle - 1), &aside).unwrap();
                fs::rename(page(middle), page(middle - 1)).unwrap();
                fs::rename(aside, page(middle)).unwrap();
            }
            OfAnother => {
                folder.run(&format!("lamp {}", self.line("other.tif", "other"))).succeeds_quietly();
                fs::copy(folder.path("other").join(name(middle)), page(middle)).unwrap();
                fs::remove_dir_all(folder.path("other")).unwrap();
            }
            Unreadable => {
                remove(middle);
                fs::create_dir(page(middle)).unwrap();
            }
            Cut | Empty | Changed => {
                let bytes = broken_bytes(fs::read(page(middle)).unwrap(), fault);
                fs::write(page(middle), bytes).unwrap();
            }
        }
    }
}

/// Copies a file, or a folder of files.
fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        fs::copy(from, to).unwrap();
        return;
    }
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

fn broken_bytes(mut bytes: Vec<u8>, fault: Fault) -> Vec<u8> {
    let middle = bytes.len() / 2;
    match fault {
        Cut => bytes.truncate(middle),
        Empty => bytes.clear(),
        _ => bytes[middle] ^= 0x10,
    }
    bytes
}

fn broken_file(mut bytes: Vec<u8>, fault: Fault) -> Vec<u8> {
    let is_tiff = matches!(bytes[..2], [b'I', b'I']);
    if matches!(fault, Cut | Empty) || !is_tiff {
        return broken_bytes(bytes, fault);
    }
    // Each page begins where a link says so: the one in the header, or the one of the page before.
    let (links, pages) = chain_of(&bytes);
    if fault == Changed {
        // Behind its directory, which `info` takes at its word, a page has its text and its code.
        bytes[links[PAGES / 2].midpoint(pages[PAGES / 2])] ^= 0x10;
        return bytes;
    }
    let last = PAGES - 1;
    let order: Vec<usize> = match fault {
        FirstMissing => (1..PAGES).collect(),
        MiddleMissing => (0..PAGES).filter(|&page| page != 3).collect(),
        LastMissing => (0..last).collect(),
        Swapped => vec![0, 1, 3, 2, 4, 5],
        Twice => {
            let copy = copied_page(&mut bytes, pages[2], links[3]);
            let link = links[PAGES];
            put(&mut bytes, link, copy);
            return bytes;
        }
        _ => unreachable!("files have no such fault"),
    };
    let mut link = links[0];
    for page in order {
        put(&mut bytes, link, pages[page]);
        link = links[page + 1];
    }
    put(&mut bytes, link, 0);
    bytes
}

fn is_big(bytes: &[u8]) -> bool {
    bytes[2] == 43
}

/// Returns where the links of a TIFF are, in the header and in each page, and where its pages are.
fn chain_of(bytes: &[u8]) -> (Vec<usize>, Vec<usize>) {
    let big = is_big(bytes);
    let (mut links, mut pages) = (vec![if big { 8 } else { 4 }], Vec::new());
    loop {
        let page = get(bytes, *links.last().unwrap());
        if page == 0 {
            return (links, pages);
        }
        let entries = if big {
            8 + 20 * u64::from_le_bytes(bytes[page..page + 8].try_into().unwrap()) as usize
        } else {
            2 + 12 * usize::from(u16::from_le_bytes(bytes[page..page + 2].try_into().unwrap()))
        };
        pages.push(page);
        links.push(page + entries);
    }
}

/// Adds a copy of a page's directory, the last one of the chain. Returns where it is.
fn copied_page(bytes: &mut Vec<u8>, page: usize, link: usize) -> usize {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    let at = bytes.len();
    let directory = bytes[page..link].to_vec();
    bytes.extend(directory);
    let end = if is_big(bytes) { 8 } else { 4 };
    bytes.extend(vec![0; end]);
    at
}

fn get(bytes: &[u8], at: usize) -> usize {
    match is_big(bytes) {
        true => u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize,
        false => u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize,
    }
}

fn put(bytes: &mut [u8], at: usize, value: usize) {
    match is_big(bytes) {
        true => bytes[at..at + 8].copy_from_slice(&(value as u64).to_le_bytes()),
        false => bytes[at..at + 4].copy_from_slice(&(value as u32).to_le_bytes()),
    }
}
