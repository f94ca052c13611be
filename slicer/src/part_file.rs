//! Reads files of parts in pieces, and checks whether they stayed unchanged.
//!
//! A part's file is read several times: for a survey, and slab by slab. Each reading copies bytes.
//! So if another program truncates the file, reading returns an error, where a memory-mapped file
//! would end the process. After the last reading, the file's metadata shows whether all readings
//! saw one version of the file.

use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use lamp_stack::digest_of_range;

use crate::binary_stl::{HEADER_BYTES, binary_facets};
use crate::error::FileChange;
use crate::file_blocks::{FileBlock, FileLooks};

/// The number of bytes read at once: few enough to stay in a processor's cache.
const READ_BYTES: usize = 1 << 15;

/// File systems record times in steps of at most two seconds (FAT).
const CLOCK_STEP: Duration = Duration::from_secs(2);

/// An open file of a part, and its state when it was opened.
#[derive(Debug)]
pub(crate) struct OpenPartFile {
    file: File,
    /// Its path and state; `None` for a temporary file, which nobody else can open.
    shared: Option<(PathBuf, FileState)>,
    /// The folder of the file, or of the file that it was unpacked from; `None` for a stream.
    folder: Option<PathBuf>,
    size: u64,
    digest: String,
    /// The data collected from its blocks if it is a binary STL.
    seen: Vec<FileBlock>,
}

impl OpenPartFile {
    /// Takes an open file, and reads it once for its digest.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub(crate) fn new(file: File, path: &Path) -> io::Result<Self> {
        let state = FileState::of(&file.metadata()?);
        let size = state.size;
        let shared = Some((path.to_owned(), state));
        let folder = path.parent().map(Path::to_owned);
        Self { file, shared, folder, size, digest: String::new(), seen: Vec::new() }.seen()
    }

    /// Keeps a stream in an unnamed temporary file.
    ///
    /// # Errors
    /// Returns an error if the stream fails, or the disk is full.
    pub(crate) fn of_stream(mut stream: impl Read) -> io::Result<Self> {
        let mut file = tempfile::tempfile()?;
        let size = io::copy(&mut stream, &mut file)?;
        let (shared, folder) = (None, None);
        Self { file, shared, folder, size, digest: String::new(), seen: Vec::new() }.seen()
    }

    /// Reads all bytes once, for the digest and for a survey's data.
    fn seen(mut self) -> io::Result<Self> {
        let Some(count) = binary_facets(self.size, &self.start(HEADER_BYTES)?) else {
            self.digest = self.digest_now()?;
            return Ok(self);
        };
        let looks = FileLooks::new(count);
        let read_at = |to: &mut [u8], at: u64| read_exact_at(&self.file, to, at);
        let digest = digest_of_range(self.size, |to, at| {
            read_at(to, at)?;
            looks.look(to, at, read_at)
        })?;
        Ok(Self { digest, seen: looks.blocks(), ..self })
    }

    /// Creates a part file from a temporary file with this one's content in another form. Its
    /// digest is this one's.
    pub(crate) fn in_other_form(&self, file: File, size: u64) -> Self {
        let (folder, digest) = (self.folder.clone(), self.digest.clone());
        Self { file, shared: None, folder, size, digest, seen: Vec::new() }
    }

    /// Returns the first bytes, at most `count`.
    pub(crate) fn start(&self, count: u64) -> io::Result<Vec<u8>> {
        let mut start = Vec::new();
        self.reader().take(count).read_to_end(&mut start)?;
        Ok(start)
    }

    /// Returns the folder of the file; `None` for a stream.
    pub(crate) fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Returns the size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Returns the digest of all bytes.
    pub(crate) fn digest(&self) -> &str {
        &self.digest
    }

    /// Returns the data collected from the file's blocks when it was opened; empty unless it is a
    /// binary STL.
    pub(crate) fn seen_blocks(&self) -> &[FileBlock] {
        &self.seen
    }

    /// Returns a reader of all bytes, from the first.
    pub(crate) fn reader(&self) -> FileReader<'_> {
        FileReader { file: &self.file, size: self.size, at: 0 }
    }

    /// Calls `each` with every record of `N` bytes in a range of the file.
    pub(crate) fn for_each_record<const N: usize>(
        &self,
        range: Range<u64>,
        each: impl FnMut(&[u8; N]),
    ) -> io::Result<()> {
        for_each_record(&self.file, range, each)
    }

    /// Returns the change of the file since it was opened, if there was one.
    ///
    /// The file's size, the time of the last write and the identity of its name decide, as far as
    /// clocks allow. The digest decides in two cases: only the time of the last change to the
    /// file's entry differs, or the file was so new when it was opened that a later write may have
    /// the same times.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub(crate) fn change(&self) -> io::Result<Option<FileChange>> {
        let Some((path, before)) = &self.shared else { return Ok(None) };
        let now = FileState::of(&self.file.metadata()?);
        if now.size != before.size {
            return Ok(Some(FileChange::Size { before: before.size, now: now.size }));
        }
        // A removed name leaves the file unchanged.
        let named = path.metadata().ok().map(|metadata| FileState::of(&metadata).identity);
        if named.is_some_and(|identity| identity != before.identity) {
            return Ok(Some(FileChange::Replaced));
        }
        let is_same = now.written == before.written && {
            let is_sure = now.changed == before.changed && !before.is_fresh;
            is_sure || self.digest_now()? == self.digest
        };
        Ok((!is_same).then_some(FileChange::Content))
    }

    fn digest_now(&self) -> io::Result<String> {
        digest_of_range(self.size, |to, at| read_exact_at(&self.file, to, at))
    }
}

/// The metadata that a system keeps about a file.
#[derive(Debug)]
struct FileState {
    size: u64,
    /// The time of the last write.
    written: Option<SystemTime>,
    /// The time of the last change of content, name, owner or times, which no program can set; zero
    /// on systems without it.
    changed: (i64, i64),
    /// Device and number, which no two files share; zero on systems without them.
    identity: (u64, u64),
    /// Whether it changed so recently that the next write may have the same times.
    is_fresh: bool,
}

impl FileState {
    fn of(metadata: &Metadata) -> Self {
        let written = metadata.modified().ok();
        // A time in the future comes from another machine.
        let age = |time: SystemTime| time.elapsed().unwrap_or_default();
        let (changed, identity) = entry(metadata);
        let entry_time = u64::try_from(changed.0)
            .map_or(SystemTime::UNIX_EPOCH, |s| SystemTime::UNIX_EPOCH + Duration::from_secs(s));
        let is_fresh = written.is_none_or(|time| age(time) <= CLOCK_STEP)
            // The entry's time is cut to whole seconds.
            || age(entry_time) <= CLOCK_STEP + Duration::from_secs(1);
        Self { size: metadata.len(), written, changed, identity, is_fresh }
    }
}

/// Returns the time of the last change of a file's entry, and the file's identity.
#[cfg(unix)]
fn entry(metadata: &Metadata) -> ((i64, i64), (u64, u64)) {
    use std::os::unix::fs::MetadataExt;
    ((metadata.ctime(), metadata.ctime_nsec()), (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn entry(_: &Metadata) -> ((i64, i64), (u64, u64)) {
    ((0, 0), (0, 0))
}

/// Reads a file from its start, regardless of other readers' positions.
#[derive(Debug)]
pub(crate) struct FileReader<'a> {
    file: &'a File,
    size: u64,
    at: u64,
}

impl Read for FileReader<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let read = read_at(self.file, to, self.at)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for FileReader<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.size.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

/// Calls `each` with every record of `N` bytes in a range of a file.
pub(crate) fn for_each_record<const N: usize>(
    file: &File,
    range: Range<u64>,
    mut each: impl FnMut(&[u8; N]),
) -> io::Result<()> {
    let mut buffer = [0; READ_BYTES];
    // Whole records, so that none is split between two reads.
    let at_once = (READ_BYTES / N * N) as u64;
    let mut at = range.start;
    while at < range.end {
        let length = at_once.min(range.end - at);
        let bytes = &mut buffer[..length as usize];
        read_exact_at(file, bytes, at)?;
        bytes.as_chunks().0.iter().for_each(&mut each);
        at += length;
    }
    Ok(())
}

fn read_exact_at(file: &File, mut to: &mut [u8], mut at: u64) -> io::Result<()> {
    while !to.is_empty() {
        // The standard library's `read_exact_at` exists only on Unix.
        match read_at(file, to, at) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(read) => {
                to = &mut to[read..];
                at += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(unix)]
fn read_at(file: &File, to: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, to, at)
}

#[cfg(windows)]
fn read_at(file: &File, to: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, to, at)
}
