//! Prepares a STEP file for slicing: reads, tessellates and validates it, and retries with healing.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crate::body_report::{BodyFault, BodyReport};
use crate::error::BrepError;
use crate::kernel::{KernelModel, Tessellation};
use crate::nest::turn_shells;
use crate::orient::turn_over;
use crate::validate::check;
use crate::vector::sub;

/// Reads a file's bytes and joins edges within a distance in millimeters; 0 leaves the
/// model unchanged.
pub type ReadFn = fn(bytes: &[u8], heal_mm: f64) -> Result<OpenedModel, BrepError>;

/// A file read by a kernel.
pub struct OpenedModel {
    /// The model.
    pub kernel: Arc<dyn KernelModel>,
    /// Whether healing changed anything.
    pub is_changed: bool,
}

/// A prepared model. It may be sliced if its reports have no faults.
pub struct Prepared {
    /// The model.
    pub kernel: Arc<dyn KernelModel>,
    /// Its facets; their findings include all repairs.
    pub mesh: Arc<Tessellation>,
    /// The report of [`check`](crate::check) on each body.
    pub reports: Vec<BodyReport>,
    /// The rejected attempts, in order.
    pub tries: Vec<PreparationAttempt>,
    /// The distance within which edges were joined, in millimeters; 0 without healing.
    pub heal_mm: f64,
    /// The greatest distance of facets from their surfaces, in millimeters.
    pub chord_mm: f64,
}

/// An attempt that failed, or was worse than another.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparationAttempt {
    /// As in [`Prepared`].
    pub heal_mm: f64,
    /// As in [`Prepared`].
    pub chord_mm: f64,
    /// The reason.
    pub why: String,
}

/// The uncertainty assumed for files that state none, in millimeters.
const USUAL_MM: f64 = 1e-3;
/// Healing tolerances, as multiples of the file's own.
// The file's own first. A tighter one joins less by mistake, a looser one closes more.
const HEALS: [f64; 3] = [1.0, 0.1, 10.0];
/// Healing tolerances, as multiples of the chord.
const LOOSEST: [f64; 2] = [0.1, 1.0];
/// The upper limit of healing, in millimeters, and as a part of the model's longest side,
/// unless the chord is longer.
const MOST_MM: f64 = 0.1;
const MOST_PART: f64 = 1e-3;
/// The chord for bodies that stay open, as a multiple of the requested chord: they are sliced only
/// if gaps are accepted.
const OPEN_CHORD: f64 = 4.0;
/// The least of such chords, as a part of the model's longest side.
const OPEN_PART: f64 = 1e-4;

/// Reads a file's bytes, tessellates its bodies and checks them.
///
/// A file with faults is healed with its own tolerance, then with a tighter and with looser ones,
/// at most 0.1 mm or a thousandth of the model, or the chord if that is more. Models with edges
/// that bound only one face get no facets. Faces and shells that are inside out are turned over and
/// reported as findings. Returns the first attempt without faults. If every attempt has faults,
/// returns the attempt with the fewest; it must not be sliced. If all have edges of only one face,
/// the attempt with the fewest such edges gets facets with a chord 4 times as long. Panics of the
/// kernel are caught. There is no time limit.
///
/// # Errors
/// Returns an error if the file cannot be read, or no attempt gives facets.
pub fn prepare(bytes: &[u8], read: ReadFn, chord_mm: f64) -> Result<Prepared, BrepError> {
    if !(chord_mm > 0.0 && chord_mm.is_finite()) {
        return Err(BrepError::Chord { chord_mm });
    }
    let opened = caught("reading the file", || read(bytes, 0.0))?;
    let own_mm = opened.kernel.uncertainty_mm().unwrap_or(USUAL_MM);
    let mut search = Attempts::new(bytes, read, chord_mm);
    search.begin(opened.kernel);
    search.measure();
    let most_mm = f64::max(chord_mm, MOST_MM.min(MOST_PART * search.longest_mm));
    let heals = HEALS.map(|by| by * own_mm).into_iter().chain(LOOSEST.map(|by| by * chord_mm));
    for heal_mm in heals.chain([most_mm]).filter(|heal_mm| *heal_mm <= most_mm) {
        search.healed(heal_mm)?;
    }
    search.settle_open();
    let (best, prepared) = search.best?;
    search.tries.remove(best);
    Ok(Prepared { tries: search.tries, ..prepared })
}

/// The attempts made.
struct Attempts<'a> {
    bytes: &'a [u8],
    read: ReadFn,
    /// The requested chord.
    chord_mm: f64,
    /// All attempts, in order.
    tries: Vec<PreparationAttempt>,
    /// The best attempt and its index, or the first attempt's error if no attempt gave facets.
    best: Result<(usize, Prepared), BrepError>,
    /// Of the models without facets because edges bound only one face, the model with the fewest
    /// such edges: its index among the attempts, the number of edges, and the model.
    open: Option<(usize, usize, Arc<dyn KernelModel>)>,
    /// The longest side of the box of the model's vertices, in millimeters.
    longest_mm: f64,
}

impl<'a> Attempts<'a> {
    fn new(bytes: &'a [u8], read: ReadFn, chord_mm: f64) -> Self {
        // Not known yet: `begin` or `settle_open` sets it.
        let none = Err(BrepError::Chord { chord_mm });
        Self { bytes, read, chord_mm, tries: Vec::new(), best: none, open: None, longest_mm: 0.0 }
    }

    /// Tries the file as it is.
    fn begin(&mut self, kernel: Arc<dyn KernelModel>) {
        self.longest_mm = kernel.longest_mm();
        if self.is_open(&kernel, 0.0) {
            return;
        }
        let first = facets(kernel, 0.0, self.chord_mm);
        self.tries.push(PreparationAttempt::of(&first, 0.0, self.chord_mm));
        self.best = first.map(|made| (0, made));
    }

    /// Uses the size of the facets if the kernel does not know the size of the model.
    fn measure(&mut self) {
        if let (0.0, Ok((_, best))) = (self.longest_mm, &self.best) {
            let boxes = best.reports.iter().map(|report| report.box_mm);
            let sides = boxes.flat_map(|[low, high]| sub(high, low));
            self.longest_mm = sides.filter(|side| side.is_finite()).fold(0.0, f64::max);
        }
    }

    /// Returns whether edges bound only one face, so that facets would be useless, and keeps the
    /// model with the fewest such edges.
    fn is_open(&mut self, kernel: &Arc<dyn KernelModel>, heal_mm: f64) -> bool {
        let edges = kernel.free_edges();
        if edges == 0 {
            return false;
        }
        let why = format!("{edges} edges bound one face alone");
        if self.open.as_ref().is_none_or(|(_, least, _)| edges < *least) {
            self.open = Some((self.tries.len(), edges, kernel.clone()));
        }
        self.tries.push(PreparationAttempt { heal_mm, chord_mm: self.chord_mm, why });
        true
    }

    /// If no other model has facets, makes facets of the model with the fewest free edges, to show
    /// where it is open.
    fn settle_open(&mut self) {
        if self.best.is_err()
            && let Some((index, _, kernel)) = self.open.take()
        {
            let heal_mm = self.tries[index].heal_mm;
            let mut chord_mm = f64::max(OPEN_CHORD * self.chord_mm, OPEN_PART * self.longest_mm);
            let mut made = facets(kernel.clone(), heal_mm, chord_mm);
            // These facets only show where gaps are, so any chord that works is good enough.
            while matches!(made, Err(BrepError::Fine { .. })) {
                chord_mm *= OPEN_CHORD;
                made = facets(kernel.clone(), heal_mm, chord_mm);
            }
            self.tries[index] = PreparationAttempt::of(&made, heal_mm, chord_mm);
            self.best = made.map(|made| (index, made));
        }
    }

    fn is_done(&self) -> bool {
        self.best.as_ref().is_ok_and(|(_, best)| best.is_good())
    }

    fn open(&self, heal_mm: f64) -> Result<OpenedModel, BrepError> {
        caught("reading the file", || (self.read)(self.bytes, heal_mm))
    }

    fn healed(&mut self, heal_mm: f64) -> Result<(), BrepError> {
        if !self.is_done() {
            let opened = self.open(heal_mm)?;
            if opened.is_changed && !self.is_open(&opened.kernel, heal_mm) {
                self.take(opened.kernel, heal_mm);
            }
        }
        Ok(())
    }

    /// Tessellates a model, and keeps it if it has fewer faults than the best attempt.
    fn take(&mut self, kernel: Arc<dyn KernelModel>, heal_mm: f64) {
        let made = facets(kernel, heal_mm, self.chord_mm);
        self.tries.push(PreparationAttempt::of(&made, heal_mm, self.chord_mm));
        let Ok(made) = made else { return };
        let is_better = match &self.best {
            Ok((_, best)) => wrong(&made.reports) < wrong(&best.reports),
            Err(_) => true,
        };
        if is_better {
            self.best = Ok((self.tries.len() - 1, made));
        }
    }
}

/// Tessellates a model and checks it.
fn facets(
    kernel: Arc<dyn KernelModel>,
    heal_mm: f64,
    chord_mm: f64,
) -> Result<Prepared, BrepError> {
    let (mesh, reports) = caught("making facets", || {
        let mut mesh = kernel.tessellate(chord_mm)?;
        let mut reports = check(kernel.as_ref(), &mesh);
        let turned = turn_over(kernel.as_ref(), &mut mesh, &reports);
        // `turn_shells` comes first, as `||` would skip it.
        if turn_shells(kernel.as_ref(), &mut mesh, &reports) || turned.is_changed {
            reports = check(kernel.as_ref(), &mesh);
        }
        for (face, body) in turned.undecided {
            reports[body].faults.push(BodyFault::Side { entity: kernel.face(face).entity });
        }
        Ok((Arc::new(mesh), reports))
    })?;
    Ok(Prepared { kernel, mesh, reports, tries: Vec::new(), heal_mm, chord_mm })
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Prepared").field("reports", &self.reports).finish_non_exhaustive()
    }
}

impl Prepared {
    /// Returns whether all bodies may be sliced.
    pub fn is_good(&self) -> bool {
        wrong(&self.reports) == [0; 3]
    }
}

impl PreparationAttempt {
    fn of(made: &Result<Prepared, BrepError>, heal_mm: f64, chord_mm: f64) -> Self {
        let why = match made {
            Ok(made) => faults(&made.reports),
            Err(error) => error.to_string(),
        };
        Self { heal_mm, chord_mm, why }
    }
}

/// Returns the bodies' faults in one line.
fn faults(reports: &[BodyReport]) -> String {
    let of_body = |(body, report): (usize, &BodyReport)| {
        report.faults.iter().map(move |fault| format!("body {body}: {fault}")).collect::<Vec<_>>()
    };
    (1..).zip(reports).flat_map(of_body).collect::<Vec<_>>().join("; ")
}

/// Counts bodies with faults, then open edges, then faults, as a key: greater is worse.
fn wrong(reports: &[BodyReport]) -> [usize; 3] {
    // Healing that closes some edges, but not all, is progress.
    let open = |fault: &BodyFault| match fault {
        BodyFault::Open { edges, .. } => *edges,
        _ => 0,
    };
    let faults = || reports.iter().flat_map(|report| &report.faults);
    let bodies = reports.iter().filter(|report| !report.faults.is_empty()).count();
    [bodies, faults().map(open).sum(), faults().count()]
}

/// Runs work and turns a panic into an error.
fn caught<T>(
    doing: &'static str,
    work: impl FnOnce() -> Result<T, BrepError>,
) -> Result<T, BrepError> {
    // Data that the work changed is dropped after a panic.
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(BrepError::Panicked { doing, what: message(panic.as_ref()) }))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_sentence() {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let row = 7;
        let error = caught::<()>("making facets", || panic!("row {row}")).unwrap_err();
        let text = caught::<()>("making facets", || panic!("no rows")).unwrap_err().to_string();
        std::panic::set_hook(hook);
        assert_eq!(error.to_string(), "making facets failed within the program: row 7");
        assert_eq!(text, "making facets failed within the program: no rows");
        assert_eq!(caught("making facets", || Ok(3)).unwrap(), 3);
    }
}
