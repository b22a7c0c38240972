//! What a page shows and where it keeps answers.

use std::path::PathBuf;

/// Says where a fluent is defined, by its name.
pub type Place = Box<dyn Fn(&str) -> Option<String> + Send + Sync>;

/// What a page shows and where it keeps answers.
pub struct Options {
    /// Where the run folders are.
    pub root: PathBuf,
    /// The file answers are added to.
    pub answers: PathBuf,
    /// The port; 0 takes any that is free.
    pub port: u16,
    /// The order of quiz questions comes from this.
    pub seed: u64,
    /// Says where a fluent is defined.
    pub place: Place,
}
