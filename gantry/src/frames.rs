//! The frames of a swath: the pictures on the mirrors, one row of the image after the other.

use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

use lamp_machine::ScanDirection;
use lamp_stack::Image;

use crate::mirrors::{MirrorArray, PHASES};
use crate::tilt::TiltedMirrors;
use crate::tilted_window::TiltedWindow;

/// The bits of a word.
const WORD: u32 = 64;

/// The bytes of tables that are kept. 255 levels of even mirrors take 25 MB for 768 rows.
const TABLE_BYTES: usize = 128 << 20;

/// A swath of a layer, as it is shown.
#[derive(Clone, Debug)]
pub struct SwathImage<'a> {
    /// The columns of the layer below the mirrors: as wide as the mirrors, unless they are tilted. A
    /// gray level is a share of white's dose.
    pub image: &'a Image,
    /// The swath's number, from the left.
    pub swath: u32,
    /// The column of the build that is the image's first.
    pub first_column: i64,
    /// The first and the last row that are shown.
    pub rows: [u32; 2],
    /// The direction of the scan.
    pub direction: ScanDirection,
    /// The columns that this swath shares in time with the one on its left, and on its right.
    pub shared: [u32; 2],
    /// The mirrors, if the display is tilted. They show what is white, and share no columns in time.
    pub tilt: Option<TiltedMirrors>,
}

/// The picture on the mirrors while the head moves on by one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The row of the image below mirror row 0. Mirror row j is over the row j above it, which has
    /// the index `position - j`; outside the image that may be negative, or at the height and beyond.
    /// If the display is tilted, the corner of its first mirror is over the row's lower edge.
    pub position: i64,
    /// The bits of the mirrors, 1 for bright: for each row along the scan, whole words from the left,
    /// the highest bit first.
    pub words: &'a [u64],
}

/// An iterator over the frames of a swath, in the order of the scan. It keeps the rows below the
/// mirrors, so its memory does not grow with the image.
///
/// ```
/// use lamp_gantry::{Frames, MirrorArray, SwathImage};
/// use lamp_machine::ScanDirection;
/// use lamp_stack::{Image, Mask};
///
/// // Two rows of mirrors pass over one white pixel: both show it, one after the other.
/// let image = Image::Mask(Mask::new(4, vec![0, 2], vec![1, 2]).unwrap());
/// let swath = SwathImage {
///     image: &image,
///     swath: 0,
///     first_column: 0,
///     rows: [0, 0],
///     direction: ScanDirection::Down,
///     shared: [0, 0],
///     tilt: None,
/// };
/// let mirrors = MirrorArray::even(4, 2);
/// let mut frames = Frames::new(swath, &mirrors);
/// assert_eq!(frames.len(), 2);
/// let bits = |frames: &mut Frames| frames.next().unwrap().words.iter().map(|w| w >> 60).collect::<Vec<_>>();
/// assert_eq!([bits(&mut frames), bits(&mut frames)], [vec![0b0100, 0], vec![0, 0b0100]]);
/// assert!(frames.next().is_none());
/// ```
pub struct Frames<'a> {
    swath: SwathImage<'a>,
    mirrors: &'a MirrorArray,
    /// The words of a row of mirrors.
    row_words: usize,
    /// The mirrors that white uses; empty if it uses all.
    white: Vec<u64>,
    window: Window,
    /// For each row of the window, the pixels that have less than white.
    partials: VecDeque<Vec<Partial>>,
    /// The number of them.
    partial_count: usize,
    tables: Tables,
    /// The pixels below tilted mirrors, in place of all of these.
    tilted: Option<TiltedWindow>,
    position: i64,
    left: u64,
    /// The frame, where it is not the window itself.
    frame: Vec<u64>,
}

/// Pixels of a word that use the same share of the rows.
struct Partial {
    word: usize,
    mask: u64,
    rows: Rc<[u64]>,
    /// The row of the image, in the phases of the table.
    phase: usize,
}

impl<'a> Frames<'a> {
    /// Returns the frames of a swath.
    ///
    /// # Panics
    /// Panics if the image is not as wide as mirrors that stand upright, or the rows are not within it.
    pub fn new(swath: SwathImage<'a>, mirrors: &'a MirrorArray) -> Self {
        let [across, along] = mirrors.size();
        let [first, last] = swath.rows;
        assert!(swath.image.width() == across || swath.tilt.is_some());
        assert!(first <= last && last < swath.image.height());
        let ends = match &swath.tilt {
            Some(tilt) => tilt.positions(swath.rows),
            None => [first.into(), i64::from(last) + i64::from(along) - 1],
        };
        let row_words = across.div_ceil(WORD) as usize;
        let white = match mirrors.is_even() {
            true => Vec::new(),
            false => words_of(&mirrors.white(), across),
        };
        let before_first = match swath.direction {
            ScanDirection::Down => ends[0] - 1,
            ScanDirection::Up => ends[1] + 1,
        };
        Self {
            tilted: swath
                .tilt
                .as_ref()
                .map(|tilt| TiltedWindow::new(tilt, mirrors.size(), swath.swath, swath.image)),
            row_words,
            white,
            window: Window::new(along as usize, row_words, swath.direction),
            partials: (0..along).map(|_| Vec::new()).collect(),
            partial_count: 0,
            tables: Tables::default(),
            position: before_first,
            left: (ends[1] - ends[0] + 1) as u64,
            frame: Vec::new(),
            swath,
            mirrors,
        }
    }

    /// Returns the number of frames to come. A swath of R rows has R + N - 1, with N rows of mirrors.
    pub fn len(&self) -> u64 {
        self.left
    }

    /// Returns the position of the next frame.
    pub fn next_position(&self) -> i64 {
        match self.swath.direction {
            ScanDirection::Down => self.position + 1,
            ScanDirection::Up => self.position - 1,
        }
    }

    /// Returns whether all frames have been shown.
    pub fn is_empty(&self) -> bool {
        self.left == 0
    }

    /// Returns the next frame. It is a view of the rows below the mirrors, so it lives until the next
    /// call.
    #[expect(clippy::should_implement_trait, reason = "a frame borrows from its iterator")]
    pub fn next(&mut self) -> Option<Frame<'_>> {
        self.left = self.left.checked_sub(1)?;
        self.position = self.next_position();
        let position = self.position;
        if let Some(tilted) = &mut self.tilted {
            let words = tilted.frame(position, self.swath.image, self.swath.rows);
            return Some(Frame { position, words });
        }
        // The row that comes below the mirrors, and the list of what leaves.
        let (row, mut partials) = match self.swath.direction {
            ScanDirection::Down => (position, self.partials.pop_back()),
            ScanDirection::Up => {
                (position + 1 - i64::from(self.mirrors.size()[1]), self.partials.pop_front())
            }
        };
        let mut list = partials.take().unwrap_or_default();
        self.partial_count -= list.len();
        list.clear();
        let words = self.window.advance();
        words.fill(0);
        let [first, last] = self.swath.rows.map(i64::from);
        if (first..=last).contains(&row) {
            draw(&self.swath, self.mirrors, row as u32, words, &mut list, &mut self.tables);
        }
        self.partial_count += list.len();
        match self.swath.direction {
            ScanDirection::Down => self.partials.push_front(list),
            ScanDirection::Up => self.partials.push_back(list),
        }
        let window = self.window.words();
        if self.white.is_empty() && self.partial_count == 0 {
            return Some(Frame { position, words: window });
        }
        self.frame.clear();
        if self.white.is_empty() {
            self.frame.extend_from_slice(window);
        } else {
            self.frame.extend(window.iter().zip(&self.white).map(|(row, white)| row & white));
        }
        for (row, list) in self.partials.iter().enumerate() {
            let words = &mut self.frame[row * self.row_words..][..self.row_words];
            for Partial { word, mask, rows, phase } in list {
                words[*word] |= rows[row * PHASES[1] as usize + phase] & mask;
            }
        }
        Some(Frame { position, words: &self.frame })
    }
}

/// Draws a row: white into its words, the rest into the list.
fn draw(
    swath: &SwathImage<'_>,
    mirrors: &MirrorArray,
    row: u32,
    words: &mut [u64],
    partials: &mut Vec<Partial>,
    tables: &mut Tables,
) {
    let across = mirrors.size()[0];
    let [left, right] = [swath.shared[0], across - swath.shared[1]];
    for (start, end, level) in swath.image.runs(row) {
        // The columns that other swaths expose, too, get their share of the rows.
        for (from, to) in
            [(start, end.min(left)), (start.max(left), end.min(right)), (start.max(right), end)]
        {
            let is_shared = to <= left || from >= right;
            let mut at = from;
            while at < to {
                let word = at / WORD;
                let stop = to.min((word + 1) * WORD);
                let mask = bits(at % WORD, stop - word * WORD);
                if level == 255 && !is_shared {
                    words[word as usize] |= mask;
                } else {
                    let rows = tables.rows(swath, mirrors, word, level);
                    let phase = (row % PHASES[1]) as usize;
                    partials.push(Partial { word: word as usize, mask, rows, phase });
                }
                at = stop;
            }
        }
    }
}

/// Returns the bits of a word from one column to another, the highest first.
pub(crate) fn bits(from: u32, to: u32) -> u64 {
    (u64::MAX >> from) & !u64::MAX.checked_shr(to).unwrap_or(0)
}

/// Packs rows of mirrors into words.
fn words_of(on: &[bool], across: u32) -> Vec<u64> {
    let row = |row: &[bool]| -> Vec<u64> {
        let word = |bits: &[bool]| {
            bits.iter().zip(0..).fold(0, |word, (&on, bit)| word | u64::from(on) << (63 - bit))
        };
        row.chunks(WORD as usize).map(word).collect()
    };
    on.chunks(across as usize).flat_map(row).collect()
}

/// For the levels of words that have been met, which mirrors show a pixel: a word for each row of
/// mirrors and each phase of the pixel's row.
#[derive(Default)]
struct Tables {
    of: HashMap<(u32, u8), Rc<[u64]>>,
    bytes: usize,
}

impl Tables {
    fn rows(
        &mut self,
        swath: &SwathImage<'_>,
        mirrors: &MirrorArray,
        word: u32,
        level: u8,
    ) -> Rc<[u64]> {
        let [across, along] = mirrors.size();
        let [left, right] = [swath.shared[0], across - swath.shared[1]];
        let (first, end) = (word * WORD, ((word + 1) * WORD).min(across));
        // All words of even mirrors have the same rows where no other swath helps: phases repeat
        // after a word.
        let is_alike = mirrors.is_even() && first >= left && end <= right;
        let key = (if is_alike { u32::MAX } else { word }, level);
        if let Some(rows) = self.of.get(&key) {
            return Rc::clone(rows);
        }
        let mut rows = vec![0_u64; (along * PHASES[1]) as usize];
        let white = mirrors.full_rows() * f64::from(level) / 255.0;
        for column in first..first + WORD {
            for phase in 0..PHASES[1] {
                let pixel = [swath.first_column as u32 + column, phase];
                let column = if is_alike {
                    0
                } else if column < across {
                    column
                } else {
                    break;
                };
                let share = match () {
                    // The rest of the dose: the swath on the left gave its share.
                    () if column < left => {
                        white - earlier_share(mirrors, swath, column, pixel, white)
                    }
                    () if column >= right => {
                        white * share_of_first(column - right, swath.shared[1])
                    }
                    () => white,
                };
                for row in mirrors.rows_of(column, pixel, share).0.iter() {
                    let bit = 1 << (63 - (pixel[0] - swath.first_column as u32 - first));
                    rows[usize::from(row) * PHASES[1] as usize + phase as usize] |= bit;
                }
            }
        }
        let rows: Rc<[u64]> = rows.into();
        // Rows below the mirrors keep theirs, so dropping all of them costs only time.
        self.bytes += rows.len() * size_of::<u64>();
        if self.bytes > TABLE_BYTES {
            self.of.clear();
            self.bytes = rows.len() * size_of::<u64>();
        }
        self.of.insert(key, Rc::clone(&rows));
        rows
    }
}

/// The share of the first of two swaths in a column that they share, counted from the first such
/// column: as a comb has it, on average.
fn share_of_first(column: u32, overlap: u32) -> f64 {
    1.0 - f64::from(column + 1) / f64::from(overlap + 1)
}

/// The rows that the swath on the left gives a shared pixel whose white dose is `white`.
fn earlier_share(
    mirrors: &MirrorArray,
    swath: &SwathImage<'_>,
    column: u32,
    pixel: [u32; 2],
    white: f64,
) -> f64 {
    let overlap = swath.shared[0];
    let share = white * share_of_first(column, overlap);
    mirrors.rows_of(mirrors.size()[0] - overlap + column, pixel, share).1
}

/// The rows below the mirrors, in a buffer in which they move by one row at a time.
struct Window {
    words: Vec<u64>,
    rows: usize,
    row_words: usize,
    /// The first row of the window in the buffer.
    at: usize,
    direction: ScanDirection,
}

impl Window {
    fn new(rows: usize, row_words: usize, direction: ScanDirection) -> Self {
        // Twice as many rows: the window is copied back once for as many rows as it has.
        let at = if direction == ScanDirection::Down { rows } else { 0 };
        Self { words: vec![0; 2 * rows * row_words], rows, row_words, at, direction }
    }

    /// Moves on by one row, and returns the row that comes: the first for a scan down, the last for
    /// a scan up.
    fn advance(&mut self) -> &mut [u64] {
        let (rows, width) = (self.rows, self.row_words);
        let row = match self.direction {
            ScanDirection::Down => {
                if self.at == 0 {
                    self.words.copy_within(..(rows - 1) * width, (rows + 1) * width);
                    self.at = rows + 1;
                }
                self.at -= 1;
                self.at
            }
            ScanDirection::Up => {
                if self.at == rows {
                    self.words.copy_within((rows + 1) * width.., 0);
                    // The last of the first half is the row that comes.
                    self.at = 0;
                    rows - 1
                } else {
                    self.at += 1;
                    self.at + rows - 1
                }
            }
        };
        &mut self.words[row * width..][..width]
    }

    fn words(&self) -> &[u64] {
        &self.words[self.at * self.row_words..][..self.rows * self.row_words]
    }
}
