//! Reads and writes bits, the lowest of a byte first.

/// The most bits that can be written at a time.
pub(super) const MOST_PUT: u8 = 56;

/// Bits that become bytes.
pub(super) struct BitWriter {
    /// The full bytes, `len` of them, and room.
    bytes: Vec<u8>,
    len: usize,
    /// The bits of the byte that is not full yet, fewer than eight.
    held: u64,
    count: u8,
}

impl BitWriter {
    /// Starts behind some bytes, with room for about so many.
    pub(super) fn after(first: &[u8], room: usize) -> Self {
        let mut bytes = Vec::with_capacity(first.len() + room);
        bytes.extend_from_slice(first);
        bytes.resize(bytes.capacity(), 0);
        Self { len: first.len(), bytes, held: 0, count: 0 }
    }

    /// Appends the lowest `count` bits of `bits`, at most [`MOST_PUT`]; higher bits are zero.
    #[inline]
    pub(super) fn put(&mut self, bits: u64, count: u8) {
        // No more than 63 bits: fewer than eight were held.
        self.held |= bits.wrapping_shl(self.count.into());
        let count = self.count.wrapping_add(count);
        // Eight bytes at once are faster than exactly as many as there are.
        let end = self.len.wrapping_add(8);
        if end > self.bytes.len() {
            self.make_room();
        }
        self.bytes[self.len..end].copy_from_slice(&self.held.to_le_bytes());
        self.len = self.len.wrapping_add(usize::from(count / 8));
        self.held = self.held.wrapping_shr((count & !7).into());
        self.count = count % 8;
    }

    #[cold]
    fn make_room(&mut self) {
        // Doubling alone would make no room of none.
        self.bytes.resize(2 * self.bytes.len() + 4096, 0);
    }

    /// Fills the last byte with zeros and returns all.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.bytes.truncate(self.len);
        if self.count > 0 {
            self.bytes.push(self.held as u8);
        }
        self.bytes
    }
}

/// Bits of bytes. Behind the last byte they are zero.
pub(super) struct BitReader<'a> {
    rest: &'a [u8],
    held: u64,
    count: u8,
}

impl<'a> BitReader<'a> {
    pub(super) fn new(rest: &'a [u8]) -> Self {
        Self { rest, held: 0, count: 0 }
    }

    /// Returns the next 32 bits at least, without taking them.
    #[inline]
    pub(super) fn peek(&mut self) -> u64 {
        // With fewer than 32 bits held, 32 more fit.
        if self.count < 32 {
            if let Some((word, rest)) = self.rest.split_first_chunk::<4>() {
                self.held |= u64::from(u32::from_le_bytes(*word)) << self.count;
                self.count += 32;
                self.rest = rest;
            } else if let Some((&byte, rest)) = self.rest.split_first() {
                self.held |= u64::from(byte) << self.count;
                self.count += 8;
                self.rest = rest;
                return self.peek();
            }
        }
        self.held
    }

    /// Takes up to 32 bits that were peeked at, or returns `None` if there are fewer.
    #[inline]
    pub(super) fn skip(&mut self, count: u8) -> Option<()> {
        self.count = self.count.checked_sub(count)?;
        self.held >>= count;
        Some(())
    }

    /// Takes four whole bytes, the most significant first, after the byte that is begun.
    pub(super) fn last_word(&mut self) -> Option<u32> {
        self.skip(self.count % 8)?;
        self.take(32).map(u32::swap_bytes)
    }

    /// Takes up to 32 bits.
    #[inline]
    pub(super) fn take(&mut self, count: u8) -> Option<u32> {
        let bits = self.peek() & ((1 << count) - 1);
        self.skip(count)?;
        Some(bits as u32)
    }
}
