//! The streams that images are coded in: like bytes stand together, so that zstd finds what they
//! have in common.

/// The coded bytes of one or several images, by kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Streams {
    /// How many rows are coded, and how many are like their reference, in turns.
    pub(super) rows: Vec<u8>,
    /// The tokens of coded rows.
    pub(super) tokens: Vec<u8>,
    /// The numbers that belong to tokens.
    pub(super) numbers: Vec<u8>,
    /// The residuals of gray levels, one a change.
    pub(super) levels: Vec<u8>,
    /// Strips in T.6 that are kept, and pixels.
    pub(super) strips: Vec<u8>,
}

/// The number of streams.
pub(super) const STREAMS: usize = 5;

impl Streams {
    /// Returns the streams in the order of a file.
    pub(super) fn all(&self) -> [&Vec<u8>; STREAMS] {
        [&self.rows, &self.tokens, &self.numbers, &self.levels, &self.strips]
    }

    /// Returns the number of bytes of all streams.
    pub(super) fn len(&self) -> usize {
        self.all().map(Vec::len).iter().sum()
    }

    /// Appends the streams of the next image.
    pub(super) fn append(&mut self, next: &Self) {
        let Self { rows, tokens, numbers, levels, strips } = self;
        for (to, from) in [rows, tokens, numbers, levels, strips].into_iter().zip(next.all()) {
            to.extend_from_slice(from);
        }
    }

    /// Returns readers of the streams.
    pub(super) fn cursor(&self) -> Cursor<'_> {
        Cursor {
            rows: &self.rows,
            tokens: &self.tokens,
            numbers: &self.numbers,
            levels: &self.levels,
            strips: &self.strips,
        }
    }
}

impl From<[Vec<u8>; STREAMS]> for Streams {
    fn from([rows, tokens, numbers, levels, strips]: [Vec<u8>; STREAMS]) -> Self {
        Self { rows, tokens, numbers, levels, strips }
    }
}

/// The unread rest of each stream.
pub(super) struct Cursor<'a> {
    pub(super) rows: &'a [u8],
    pub(super) tokens: &'a [u8],
    pub(super) numbers: &'a [u8],
    pub(super) levels: &'a [u8],
    pub(super) strips: &'a [u8],
}

impl Cursor<'_> {
    /// Returns whether all streams are read to their ends.
    pub(super) fn is_at_end(&self) -> bool {
        [self.rows, self.tokens, self.numbers, self.levels, self.strips]
            .iter()
            .all(|stream| stream.is_empty())
    }
}
