//! Settings of a room as a group of options.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use clap::{ArgMatches, Args, Command, FromArgMatches};

/// Settings `S` that are read as the options `A`.
pub(crate) struct Parsed<A, S> {
    settings: S,
    options: PhantomData<fn() -> A>,
}

impl<A, S> Parsed<A, S> {
    pub(crate) fn new(settings: S) -> Self {
        Self { settings, options: PhantomData }
    }
}

impl<A, S: Clone> Clone for Parsed<A, S> {
    fn clone(&self) -> Self {
        Self::new(self.settings.clone())
    }
}

impl<A, S> Deref for Parsed<A, S> {
    type Target = S;

    fn deref(&self) -> &S {
        &self.settings
    }
}

impl<A, S> DerefMut for Parsed<A, S> {
    fn deref_mut(&mut self) -> &mut S {
        &mut self.settings
    }
}

impl<A: Args, S: From<A>> FromArgMatches for Parsed<A, S> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self::new(A::from_arg_matches(matches)?.into()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<A: Args, S: From<A>> Args for Parsed<A, S> {
    fn augment_args(command: Command) -> Command {
        A::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        A::augment_args_for_update(command)
    }
}
