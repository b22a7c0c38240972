//! The printed dots of a scene, to be cut out: a PDF file in true size, A4.
//!
//! Each dot stands in a dashed square with its place beside it; a line of 100 mm tells whether the printer kept the
//! size. Only the dot is to be cut out: the square's paper would be a thing on the table.

use pdf_writer::{Content, Finish as _, Name, Pdf, Rect, Ref, Str};

use crate::world::Mark;

/// Points of a PDF page per millimetre.
const POINT: f32 = 72.0 / 25.4;
/// A page, mm: A4.
const PAGE: [f32; 2] = [210.0, 297.0];
/// What printers leave white, mm.
const BORDER: f32 = 15.0;
/// What is kept for a dot's words below it, mm.
const WORDS: f32 = 12.0;
/// What is kept between squares, mm.
const APART: f32 = 5.0;
/// The height of the head with the line of 100 mm, mm.
const HEAD: f32 = 25.0;
/// How far the handles of four cubic curves are that look like a circle of radius 1.
const CIRCLE: f32 = 0.552_284_8;
/// The name of the font on a page.
const FONT: Name<'static> = Name(b"F");

/// Returns a PDF file of the dots of a scene.
///
/// # Errors
///
/// The radius, m, of a dot that no page holds.
pub fn marks_sheet(scene: &str, marks: &[Mark]) -> Result<Vec<u8>, f64> {
    let radius = marks.iter().map(|mark| mark.radius).fold(0.0, f64::max);
    let side = (2.0 * radius * 1e3) as f32 + 2.0 * APART;
    let (across, down) = (PAGE[0] - 2.0 * BORDER, PAGE[1] - 2.0 * BORDER - HEAD);
    let cell = [side.max(45.0) + APART, side + WORDS + APART];
    let (columns, rows) = ((across / cell[0]) as usize, (down / cell[1]) as usize);
    if columns == 0 || rows == 0 {
        return Err(radius);
    }
    let (catalog, tree, font) = (Ref::new(1), Ref::new(2), Ref::new(3));
    let numbered: Vec<(Ref, Ref, &[Mark])> = (4..)
        .step_by(2)
        .zip(marks.chunks(columns * rows))
        .map(|(id, dots)| (Ref::new(id), Ref::new(id + 1), dots))
        .collect();
    let n_pages = numbered.len();
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(tree);
    let count = i32::try_from(n_pages).unwrap_or(i32::MAX);
    pdf.pages(tree).kids(numbered.iter().map(|(page, ..)| *page)).count(count);
    pdf.type1_font(font).base_font(Name(b"Helvetica"));
    for (n, (page_id, content_id, dots)) in numbered.into_iter().enumerate() {
        let mut page = pdf.page(page_id);
        page.media_box(Rect::new(0.0, 0.0, PAGE[0] * POINT, PAGE[1] * POINT));
        page.parent(tree);
        page.contents(content_id);
        page.resources().fonts().pair(FONT, font);
        page.finish();
        let mut content = Content::new();
        // From here on lengths are in millimetres.
        content.transform([POINT, 0.0, 0.0, POINT, 0.0, 0.0]);
        head(&mut content, scene, n + 1, n_pages);
        for (k, mark) in dots.iter().enumerate() {
            let x = BORDER + (k % columns) as f32 * cell[0];
            let y = PAGE[1] - BORDER - HEAD - (k / columns + 1) as f32 * cell[1];
            dot(&mut content, n * columns * rows + k + 1, mark, [x, y + WORDS], side);
        }
        pdf.stream(content_id, &content.finish());
    }
    Ok(pdf.finish())
}

fn words(content: &mut Content, at: [f32; 2], size: f32, text: &str) {
    // The font knows no more than this.
    let text: String = text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    content.begin_text().set_font(FONT, size).next_line(at[0], at[1]);
    content.show(Str(text.as_bytes())).end_text();
}

/// What to do, and the line by which the printed size is checked.
fn head(content: &mut Content, scene: &str, page: usize, of: usize) {
    let top = PAGE[1] - BORDER;
    words(
        content,
        [BORDER, top - 5.0],
        5.0,
        &format!("Dots of scene {scene}, page {page} of {of}"),
    );
    words(
        content,
        [BORDER, top - 10.5],
        3.2,
        "Print at 100 %. Cut out the black discs only and glue each with its cross at its place on the table.",
    );
    content.set_line_width(0.3);
    let y = top - 17.0;
    content.move_to(BORDER, y).line_to(BORDER + 100.0, y);
    for x in [BORDER, BORDER + 100.0] {
        content.move_to(x, y - 1.5).line_to(x, y + 1.5);
    }
    content.stroke();
    words(content, [BORDER + 103.0, y - 1.0], 3.2, "this line is 100 mm long");
}

/// A dot in its square, whose lower left corner is `at`, mm.
fn dot(content: &mut Content, number: usize, mark: &Mark, at: [f32; 2], side: f32) {
    let r = (mark.radius * 1e3) as f32;
    let [x, y] = [at[0] + side / 2.0, at[1] + side / 2.0];
    content.set_line_width(0.2).set_dash_pattern([1.5, 1.5], 0.0).set_stroke_gray(0.6);
    content.rect(at[0], at[1], side, side).stroke();
    content.set_dash_pattern([], 0.0).set_fill_gray(0.0);
    let c = CIRCLE * r;
    content.move_to(x + r, y);
    content.cubic_to(x + r, y + c, x + c, y + r, x, y + r);
    content.cubic_to(x - c, y + r, x - r, y + c, x - r, y);
    content.cubic_to(x - r, y - c, x - c, y - r, x, y - r);
    content.cubic_to(x + c, y - r, x + r, y - c, x + r, y);
    content.close_path().fill_nonzero();
    // Too thin for a camera that sees the whole table.
    content.set_line_width(0.2).set_stroke_gray(1.0);
    content.move_to(x - 3.0, y).line_to(x + 3.0, y).move_to(x, y - 3.0).line_to(x, y + 3.0);
    content.stroke().set_stroke_gray(0.0);
    let place = format!("x {:.1} cm, y {:.1} cm", 100.0 * mark.x, 100.0 * mark.y);
    words(content, [at[0], at[1] - 4.0], 3.5, &format!("{number}:  {place}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(n: usize, radius: f64) -> Vec<Mark> {
        (0..n).map(|k| Mark { x: 0.1 * k as f64, y: -0.36, radius }).collect()
    }

    #[test]
    fn every_dot_is_printed_with_its_place() {
        let pdf = marks_sheet("kitchen", &marks(30, 0.012)).unwrap();
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-") && text.trim_end().ends_with("%%EOF"));
        for k in 0..30 {
            let place = format!("({}:  x {:.1} cm, y -36.0 cm)", k + 1, 10.0 * f64::from(k));
            assert!(text.contains(&place), "{place}");
        }
        assert!(text.contains("page 1 of 3") && text.contains("page 3 of 3"));
    }

    #[test]
    fn a_dot_larger_than_a_page_is_refused() {
        assert_eq!(marks_sheet("hall", &marks(1, 0.2)), Err(0.2));
    }
}
