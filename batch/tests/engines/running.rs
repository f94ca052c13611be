//! Schedulers that run for tests.

/// A scheduler that runs for a test.
pub(crate) trait Running {
    /// Its parts that may be killed, by their names.
    fn parts(&self) -> &'static [&'static str];

    /// Kills a part with signal 9, and starts it again.
    fn kill(&mut self, part: &'static str);

    /// Does what a person has to do after a part was killed.
    fn mend(&self) {}

    /// Returns its report of its jobs and machines.
    fn state(&self) -> String {
        String::new()
    }
}
