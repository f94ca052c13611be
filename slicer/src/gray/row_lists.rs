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

impl<T: Copy> RowLists<T> {
    /// Joins rows, the first ones first.
    pub(crate) fn joined<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> Self
    where
        T: 'a,
    {
        let rows = parts.clone().map(|part| part.len() as usize).sum();
        let items = parts.clone().map(|part| part.items.len()).sum();
        let mut all = Self::with_room(rows, items);
        for part in parts {
            let moved = all.items.len() as u32;
            all.starts.extend(part.starts[1..].iter().map(|start| start + moved));
            all.items.extend_from_slice(&part.items);
        }
        all
    }
}

impl<T> RowLists<T> {
    /// Starts lists that will have about so many items.
    pub(crate) fn with_room(rows: usize, items: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self { starts, items: Vec::with_capacity(items) }
    }

    /// Starts lists that will have about as many items as others.
    pub(crate) fn like(other: &Self) -> Self {
        Self::with_room(other.starts.len(), other.items.len() + other.items.len() / 8)
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

    /// Returns the items of all rows. What is added to them belongs to the row that
    /// [`end_row`](Self::end_row) ends.
    #[inline]
    pub(crate) fn items_mut(&mut self) -> &mut Vec<T> {
        &mut self.items
    }

    /// Ends a row.
    #[inline]
    pub(crate) fn end_row(&mut self) {
        self.starts.push(self.items.len() as u32);
    }

    /// Returns where each row's items start, and where those of the last end; and the items.
    pub(crate) fn into_arrays(self) -> (Vec<u32>, Vec<T>) {
        (self.starts, self.items)
    }
}
