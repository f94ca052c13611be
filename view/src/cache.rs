//! Keeps images that were asked for, up to an amount of memory.

use std::collections::HashMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use lamp_stack::Image;

use crate::error::ViewError;

/// The key of a layer's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct ImageKey<K> {
    pub(crate) stack: usize,
    pub(crate) layer: usize,
    pub(crate) kind: K,
}

/// Images by key. An image that several threads request at once is made once. If memory runs out,
/// the least recently requested image goes first.
pub(crate) struct Cache<K> {
    slots: Mutex<Slots<K>>,
    made: Condvar,
    most_bytes: usize,
}

struct Slots<K> {
    of: HashMap<ImageKey<K>, Slot>,
    /// Bytes of the images, and the most bytes that images in work may take.
    bytes: usize,
    requests: u64,
}

struct Slot {
    bytes: usize,
    /// `None` while it is made.
    image: Option<Arc<Image>>,
    last_request: u64,
}

impl<K: Copy + Eq + std::hash::Hash> Cache<K> {
    pub(crate) fn new(most_bytes: usize) -> Self {
        let slots = Slots { of: HashMap::new(), bytes: 0, requests: 0 };
        Self { slots: Mutex::new(slots), made: Condvar::new(), most_bytes }
    }

    /// Returns an image, made now if it is not kept. Until it is made, it may take `most_bytes`.
    pub(crate) fn get(
        &self,
        key: ImageKey<K>,
        most_bytes: usize,
        make: impl FnOnce() -> Result<Image, ViewError>,
    ) -> Result<Arc<Image>, ViewError> {
        let mut slots = self.lock();
        slots.requests += 1;
        let now = slots.requests;
        loop {
            match slots.of.get_mut(&key) {
                Some(Slot { image: Some(image), last_request, .. }) => {
                    *last_request = now;
                    return Ok(Arc::clone(image));
                }
                Some(_) => {
                    slots = self.made.wait(slots).unwrap_or_else(PoisonError::into_inner);
                }
                None => break,
            }
        }
        // Counted before the work: images made at once must not exceed the memory together.
        slots.put(key, Slot { bytes: most_bytes, image: None, last_request: now });
        slots.free(self.most_bytes, key);
        drop(slots);
        let mut work = ImageWork { cache: self, key, image: None };
        let image = Arc::new(make()?);
        work.image = Some(Arc::clone(&image));
        Ok(image)
    }

    fn lock(&self) -> MutexGuard<'_, Slots<K>> {
        // Each change is whole before another thread sees it.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Copy + Eq + std::hash::Hash> Slots<K> {
    fn put(&mut self, key: ImageKey<K>, slot: Slot) {
        self.bytes += slot.bytes;
        let before = self.of.insert(key, slot);
        self.bytes -= before.map_or(0, |before| before.bytes);
    }

    fn remove(&mut self, key: ImageKey<K>) {
        self.bytes -= self.of.remove(&key).map_or(0, |slot| slot.bytes);
    }

    /// Drops images until the rest takes at most so many bytes, except `kept` and images in work.
    fn free(&mut self, most_bytes: usize, kept: ImageKey<K>) {
        while self.bytes > most_bytes {
            let made = self.of.iter().filter(|(key, slot)| **key != kept && slot.image.is_some());
            let Some((&oldest, _)) = made.min_by_key(|(_, slot)| slot.last_request) else { return };
            self.remove(oldest);
        }
    }
}

/// An image in work. Its waiters learn of its end, whatever that is.
struct ImageWork<'a, K: Copy + Eq + std::hash::Hash> {
    cache: &'a Cache<K>,
    key: ImageKey<K>,
    image: Option<Arc<Image>>,
}

impl<K: Copy + Eq + std::hash::Hash> Drop for ImageWork<'_, K> {
    fn drop(&mut self) {
        let mut slots = self.cache.lock();
        match self.image.take() {
            Some(image) => {
                let last_request = slots.requests;
                let bytes = image_bytes(&image);
                slots.put(self.key, Slot { bytes, image: Some(image), last_request });
                slots.free(self.cache.most_bytes, self.key);
            }
            None => slots.remove(self.key),
        }
        drop(slots);
        self.cache.made.notify_all();
    }
}

/// The memory of an image.
pub(crate) fn image_bytes(image: &Image) -> usize {
    let change = match image {
        Image::Mask(_) => 4,
        Image::Gray(_) => 8,
    };
    4 * (image.height() as usize + 1) + change * image.change_count()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use lamp_stack::Mask;

    use super::*;

    fn key(layer: usize) -> ImageKey<()> {
        ImageKey { stack: 0, layer, kind: () }
    }

    fn black(rows: u32) -> Result<Image, ViewError> {
        Ok(Image::Mask(Mask::black(8, rows)))
    }

    #[test]
    fn what_was_not_asked_for_the_longest_goes_first() {
        let one = image_bytes(&black(99).unwrap());
        let cache = Cache::new(2 * one);
        let made = AtomicUsize::new(0);
        let get = |layer| {
            let make = || {
                made.fetch_add(1, Ordering::Relaxed);
                black(99)
            };
            cache.get(key(layer), one, make).unwrap();
            made.load(Ordering::Relaxed)
        };
        assert_eq!([get(0), get(1), get(0), get(2)], [1, 2, 2, 3]);
        assert_eq!(get(0), 3, "it was asked for later than layer 1");
        assert_eq!(get(1), 4);
        assert!(cache.lock().bytes <= 2 * one);
    }

    #[test]
    fn an_image_larger_than_the_memory_is_made_but_alone() {
        let cache = Cache::new(10);
        for layer in 0..3 {
            assert_eq!(cache.get(key(layer), 400, || black(99)).unwrap().height(), 99);
            assert_eq!(cache.lock().of.len(), 1);
        }
    }

    #[test]
    fn threads_wait_for_one_that_makes_it() {
        let cache = Cache::new(1 << 20);
        let made = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    let make = || {
                        std::thread::sleep(std::time::Duration::from_millis(20));
                        made.fetch_add(1, Ordering::Relaxed);
                        black(9)
                    };
                    cache.get(key(0), 0, make).unwrap();
                });
            }
        });
        assert_eq!(made.into_inner(), 1);
    }

    #[test]
    fn what_fails_is_tried_again() {
        let cache = Cache::new(1 << 20);
        let failed = cache.get(key(0), 50, || Err(ViewError::GivenUp));
        assert_eq!(failed, Err(ViewError::GivenUp));
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            cache.get(key(0), 50, || panic!("on purpose"))
        }));
        assert!(panicked.is_err());
        assert_eq!(cache.lock().bytes, 0);
        assert!(cache.get(key(0), 50, || black(9)).is_ok());
    }
}
