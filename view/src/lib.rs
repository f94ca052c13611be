//! A local web viewer of stacks: tiles of any scale come straight from runs.
