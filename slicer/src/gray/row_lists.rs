//! Lists of what each row has, in one array.

/// What each of some rows has, from the left.
#[derive(Debug)]
pub(crate) struct RowLists<T> {
    /// Where each row's items start, and where those of the last end.
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for RowLists<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T> RowLists<T> {
    /// Starts lists that will have about as many items as others.
    pub(crate) fn like(other: &Self) -> Self {
        let mut starts = Vec::with_capacity(other.starts.len());
        starts.push(0);
        Self { starts, items: Vec::with_capacity(other.items.len() + other.items.len() / 8) }
    }

    /// Returns the number of rows.
    pub(crate) fn len(&self) -> u32 {
        (self.starts.len() - 1) as u32
    }

    /// Returns the items of a row.
    #[inline]
    pub(crate) fn row(&self, row: u32) -> &[T] {
        let row = row as usize;
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Adds a row: the items that `make` appends.
    pub(crate) fn push_row(&mut self, make: impl FnOnce(&mut Vec<T>)) {
        make(&mut self.items);
        self.starts.push(self.items.len() as u32);
    }
}
