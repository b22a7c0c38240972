//! `trueup marks --pdf FILE`: the dots of a scene, to be printed and glued to the table.

use std::path::PathBuf;

use clap::Args;

use crate::files::write;
use crate::report::exit::Exit;
use crate::report::marks_sheet::marks_sheet;
use crate::report::{Failure, Style};

use super::inputs::{scene, spare};
use super::shared::Shared;

/// Write the dots of a scene as a page to print, in true size.
#[derive(Debug, Args)]
pub(super) struct MarksArgs {
    /// The page.
    #[arg(long, value_name = "FILE", default_value = "marks.pdf")]
    pdf: PathBuf,
}

/// `trueup marks [--scene FILE] --pdf FILE`.
pub(super) fn marks(args: &MarksArgs, cli: &Shared, style: Style) -> Result<Exit, Failure> {
    spare(&args.pdf, &["pdf"])?;
    let scene = scene(cli.cell.scene.as_deref(), style)?;
    if scene.marks.is_empty() {
        return Err(Failure::input("marks::none", format!("scene `{}` has no dots", scene.name))
            .help(
                "`marks dots(radius 12 mm) { (0.25 m, -0.36 m) .. }` in the scene declares them",
            ));
    }
    let pdf = marks_sheet(&scene.name, &scene.marks).map_err(|radius| {
        Failure::input(
            "marks::size",
            format!("a dot of {:.0} mm radius fits no page", radius * 1e3),
        )
        .help("dots of 12 mm are seen well from a metre and a half")
    })?;
    write::replace(&args.pdf, pdf).map_err(|error| Failure::unwritten(&args.pdf, &error))?;
    let (dots, file) = (scene.marks.len(), args.pdf.display().to_string());
    if style.json {
        style.document(&serde_json::json!({"file": file, "dots": dots}));
    } else {
        style.say(format!("{dots} dots of `{}` in {file}; print it at 100 %", scene.name));
    }
    Ok(Exit::Yes)
}
