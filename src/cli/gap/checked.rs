//! What `check` finds wrong with a model file that `gap` reads all the same.

use std::path::Path;

use crate::language::Source;
use crate::report::Failure;
use crate::workcell::check;

use super::super::cell::stdlib;
use super::super::inputs::read;
use super::super::shared::Shared;

/// So many mistakes are told; `check` tells the others.
const TOLD: usize = 3;

/// Says what `trueup check` calls wrong in a model file, if anything.
pub(super) fn mistakes(path: &Path, text: &str, cli: &Shared) -> Result<Option<String>, Failure> {
    let source = |path: &Path, text: &str| Source::new(path.display().to_string(), text);
    let scene = match &cli.cell.scene {
        Some(file) => Some(source(file, &read(file)?)),
        None => None,
    };
    // A scene's file without a scene is told where the scene is asked for.
    let found = check::check_all(&stdlib(cli)?, scene, vec![source(path, text)]);
    let found = found.unwrap_or_default();
    let wrong: Vec<_> = found.iter().map(|(wrong, _)| wrong).filter(|d| d.is_error()).collect();
    let count: usize = wrong.iter().map(|wrong| wrong.count).sum();
    if count == 0 {
        return Ok(None);
    }
    let told: Vec<&str> = wrong.iter().take(TOLD).map(|wrong| wrong.message.as_str()).collect();
    let many = if count == 1 { "a mistake".to_owned() } else { format!("{count} mistakes") };
    let more = if wrong.len() > TOLD { "; …" } else { "" };
    Ok(Some(format!(
        "`trueup check {}` finds {many} in the model file, which is used as it is: {}{more}",
        path.display(),
        told.join("; ")
    )))
}
