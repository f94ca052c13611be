//! Work for answers: limited in amount, dropped when given up, and ahead for the next layers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError, RwLock};

use tokio::sync::Semaphore;

use crate::error::ViewError;
use crate::viewer::{GivenUp, ImageKind, Viewer};
use crate::work_folder::{Order, WorkFolder};

/// Does the work for answers.
pub(super) struct Workers {
    shown: Shown,
    folder: Option<Arc<WorkFolder>>,
    /// As many permits as threads.
    free: Arc<Semaphore>,
    wish: Arc<Wish>,
}

/// The viewer whose stacks are shown.
#[derive(Clone)]
struct Shown(Arc<RwLock<Arc<Viewer>>>);

impl Shown {
    fn viewer(&self) -> Arc<Viewer> {
        // It is replaced whole, so it is valid even after a panic.
        Arc::clone(&self.0.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn set(&self, viewer: Arc<Viewer>) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = viewer;
    }
}

impl Workers {
    pub(super) fn new(viewer: Arc<Viewer>, folder: Option<WorkFolder>, threads: usize) -> Self {
        let (wish, shown) = (Arc::new(Wish::default()), Shown(Arc::new(RwLock::new(viewer))));
        let (ahead, wanted) = (shown.clone(), Arc::clone(&wish));
        // It ends with the process.
        std::thread::spawn(move || wanted.work(&ahead));
        let free = Arc::new(Semaphore::new(threads.max(1)));
        Self { shown, folder: folder.map(Arc::new), free, wish }
    }

    pub(super) fn viewer(&self) -> Arc<Viewer> {
        self.shown.viewer()
    }

    /// Returns the folder whose files become builds, if there is one.
    pub(super) fn folder(&self) -> Result<&Arc<WorkFolder>, ViewError> {
        self.folder.as_ref().ok_or(ViewError::NoSuch("page"))
    }

    pub(super) fn has_folder(&self) -> bool {
        self.folder.is_some()
    }

    /// Begins the work of an order. The stack that it makes is shown once it is there.
    pub(super) fn begin(&self, order: Order) -> Result<(), ViewError> {
        let shown = self.shown.clone();
        self.folder()?.begin(order, &self.viewer(), move |viewer| shown.set(viewer))
    }

    /// Works on a thread of its own once one is free. If the answer is given up, so is the work:
    /// before it starts, or at its next step.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Viewer, &GivenUp) -> Result<T, ViewError> + Send + 'static,
    ) -> Result<T, ViewError> {
        // A waiting answer takes no thread, and ends as soon as it is dropped.
        let permit = Arc::clone(&self.free).acquire_owned().await;
        let dropped = WhenDropped(GivenUp::default());
        let (viewer, given_up) = (self.viewer(), dropped.0.clone());
        let done = tokio::task::spawn_blocking(move || {
            let result = work(&viewer, &given_up);
            // The thread holds the permit: if its answer is given up, it still works until its next
            // step.
            drop(permit);
            result
        });
        let failed =
            |_| ViewError::Unreadable("an error of the program; please report it".to_owned());
        done.await.unwrap_or_else(|error| Err(failed(error)))
    }

    /// Records that a layer is looked at: the layers next to it are decoded ahead.
    pub(super) fn expect_near(&self, stack: usize, layer: usize) {
        self.wish.set(stack, layer);
    }
}

/// Gives up the work when nobody waits for it any more.
struct WhenDropped(GivenUp);

impl Drop for WhenDropped {
    fn drop(&mut self) {
        self.0.set();
    }
}

/// The layer that was looked at last, until the layers next to it are decoded.
#[derive(Default)]
struct Wish {
    state: Mutex<Seen>,
    changed: Condvar,
}

#[derive(Default)]
struct Seen {
    /// The stack, the layer, and whether the one looked at before was above.
    last: Option<(usize, usize, bool)>,
    is_new: bool,
}

impl Wish {
    fn set(&self, stack: usize, layer: usize) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let down = match state.last {
            // The same layer again has no new direction.
            Some((same, before, down)) if same == stack && before == layer => down,
            Some((same, before, _)) => same == stack && before > layer,
            None => false,
        };
        *state = Seen { last: Some((stack, layer, down)), is_new: true };
        self.changed.notify_one();
    }

    /// Decodes the layers next to the layer that was looked at last, first in the direction of
    /// travel.
    fn work(&self, shown: &Shown) {
        loop {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            while !state.is_new {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            state.is_new = false;
            let Some((stack, layer, down)) = state.last else { continue };
            drop(state);
            let viewer = shown.viewer();
            let (above, below) = (layer.checked_add(1), layer.checked_sub(1));
            let near = if down { [below, above] } else { [above, below] };
            for layer in near.into_iter().flatten() {
                let is_old = || self.state.lock().unwrap_or_else(PoisonError::into_inner).is_new;
                if is_old() {
                    break;
                }
                // A viewer of that layer will see the error.
                let decode = || viewer.image(stack, layer, ImageKind::Layer, &GivenUp::default());
                // This thread serves all layers: one that panics must not end it.
                let _ = catch_unwind(AssertUnwindSafe(decode));
            }
        }
    }
}
