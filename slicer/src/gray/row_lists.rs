//! Lists of the items of each row, in one array.

/// The items of each row, from the left.
#[derive(Debug)]
pub(crate) struct RowLists<T> {
    /// The start of each row's items, and the end of the last row's.
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
    /// Starts lists with room for about this many items.
    pub(crate) fn with_room(rows: usize, items: usize) -> Self {
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        Self { starts, items: Vec::with_capacity(items) }
    }

    /// Starts lists with room for about as many items as another has.
    pub(crate) fn like(other: &Self) -> Self {
        // Neighboring layers are alike. With an eighth more, most lists need not grow.
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

    /// Returns the items of all rows. Items added to them belong to the row that
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

    /// Returns the start of each row's items and the end of the last row's; and the items.
    pub(crate) fn into_arrays(self) -> (Vec<u32>, Vec<T>) {
        (self.starts, self.items)
    }
}
