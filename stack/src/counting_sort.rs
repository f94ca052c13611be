//! Items grouped by small whole keys, by a counting sort.

use std::ops::Range;

/// Items grouped by key. Within a group they keep the order in which they came.
///
/// ```
/// use lamp_stack::Grouped;
///
/// let words = ["runs", "of", "a", "row", "are", "few"];
/// let by_length = Grouped::new(5, || words.iter().map(|&word| (word.len(), word)));
/// assert_eq!(by_length.group(3), ["row", "are", "few"]);
/// assert_eq!(by_length.range(1..3), 0..2);
/// assert!(by_length.group(0).is_empty());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Grouped<T> {
    /// Where each group begins, and where the last one ends.
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Grouped<T> {
    /// Groups items by keys below `keys`. Asks for the items twice, to count
    /// and to place them; both times they must be the same.
    ///
    /// # Panics
    /// Panics if a key is not below `keys`, or there are 2^32 items.
    #[inline]
    pub fn new<I: Iterator<Item = (usize, T)>>(keys: usize, items: impl Fn() -> I) -> Self {
        let mut counts = KeyCounts::new(keys);
        items().for_each(|(key, _)| counts.add(key));
        let mut groups = counts.into_groups();
        items().for_each(|(key, item)| {
            groups.put(key, item).expect("as many items as before");
        });
        groups.finish()
    }
}

impl<T> Grouped<T> {
    /// Returns the items with a key.
    #[inline]
    pub fn group(&self, key: usize) -> &[T] {
        &self.items[self.range(key..key + 1)]
    }

    /// Returns the items with a key, to be changed.
    #[inline]
    pub fn group_mut(&mut self, key: usize) -> &mut [T] {
        let range = self.range(key..key + 1);
        &mut self.items[range]
    }

    /// Returns where the groups of some keys lie among all [`items`](Self::items).
    #[inline]
    pub fn range(&self, keys: Range<usize>) -> Range<usize> {
        self.starts[keys.start] as usize..self.starts[keys.end] as usize
    }

    /// Returns all items, by rising keys.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Returns all items, by rising keys.
    pub fn into_items(self) -> Vec<T> {
        self.items
    }
}

/// The first pass of a counting sort: how often each key occurs. For items that
/// come from somewhere that may fail; otherwise [`Grouped::new`] does it all.
#[derive(Clone, Debug)]
pub struct KeyCounts {
    /// The counts of key k are at k + 2, so that summing and placing need no other list.
    counts: Vec<u32>,
    /// For each key, the change by ranges of keys from the count of the key before. Empty if there
    /// are no ranges.
    steps: Vec<i32>,
}

impl KeyCounts {
    /// Starts with a count of zero for each key below `keys`.
    pub fn new(keys: usize) -> Self {
        Self { counts: vec![0; keys + 2], steps: Vec::new() }
    }

    /// Counts an item.
    #[inline]
    pub fn add(&mut self, key: usize) {
        self.counts[key + 2] += 1;
    }

    /// Counts an item of each of some keys.
    #[inline]
    pub fn add_each(&mut self, keys: Range<usize>) {
        if self.steps.is_empty() {
            self.steps.resize(self.counts.len(), 0);
        }
        // Only the ends of the range change, so a long range costs no more than a short one.
        self.steps[keys.start] += 1;
        self.steps[keys.end] -= 1;
    }

    /// Makes room for the counted items.
    pub fn into_groups<T: Copy + Default>(self) -> UnfinishedGroups<T> {
        let mut starts = self.counts;
        let mut of_ranges = 0;
        for (count, step) in starts[2..].iter_mut().zip(&self.steps) {
            // A range takes back at its end what it added, so the sum is never negative.
            of_ranges += step;
            *count += of_ranges as u32;
        }
        for key in 2..starts.len() {
            starts[key] += starts[key - 1];
        }
        let items = vec![T::default(); starts[starts.len() - 1] as usize];
        UnfinishedGroups(Grouped { starts, items })
    }
}

/// The second pass of a counting sort: groups with room for the items that were
/// counted.
#[derive(Clone, Debug)]
pub struct UnfinishedGroups<T>(Grouped<T>);

impl<T> UnfinishedGroups<T> {
    /// Puts an item into its group, and returns its place among all items; none if more
    /// items come than were counted.
    #[inline]
    pub fn put(&mut self, key: usize, item: T) -> Option<u32> {
        let Grouped { starts, items } = &mut self.0;
        // Counts stood at k + 2, so the place of the next item of key k is at k + 1.
        let place = starts[key + 1];
        *items.get_mut(place as usize)? = item;
        starts[key + 1] += 1;
        Some(place)
    }

    /// Puts an item into the group of each of some keys; none if more items come than were
    /// counted.
    #[inline]
    pub fn put_each(&mut self, keys: Range<usize>, mut item: impl FnMut(usize) -> T) -> Option<()> {
        let Grouped { starts, items } = &mut self.0;
        for (key, place) in keys.clone().zip(&mut starts[keys.start + 1..keys.end + 1]) {
            *items.get_mut(*place as usize)? = item(key);
            *place += 1;
        }
        Some(())
    }

    /// Returns the groups, once as many items were put in as were counted.
    pub fn finish(self) -> Grouped<T> {
        let mut groups = self.0;
        // Each start has moved to its group's end, where the next one starts.
        groups.starts.pop();
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_keys_count_as_each_of_them() {
        let mut counts = KeyCounts::new(6);
        let ranges = [1..4, 0..6, 3..5, 2..2, 5..6];
        ranges.iter().for_each(|range| counts.add_each(range.clone()));
        counts.add(4);
        let mut groups = counts.into_groups();
        for (item, range) in (0u8..).zip(ranges) {
            assert!(groups.put_each(range, |_| item).is_some());
        }
        groups.put(4, 9);
        assert!(groups.put(5, 9).is_none(), "all places are taken");
        let groups = groups.finish();
        let expected: [&[u8]; 6] = [&[1], &[0, 1], &[0, 1], &[0, 1, 2], &[1, 2, 9], &[1, 4]];
        assert_eq!([0, 1, 2, 3, 4, 5].map(|key| groups.group(key)), expected);
    }
}
