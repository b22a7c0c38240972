//! Bytes of a text ↔ the editor's lines and columns, which count from 0 and in UTF-16.

use lsp_types::{Position, Range};

use crate::language::ast::Span;

/// Returns the byte of a position; past the end of a line is its end, past the text the text's end.
pub(super) fn offset(text: &str, position: Position) -> usize {
    let mut start = 0;
    for _ in 0..position.line {
        match text[start..].find('\n') {
            Some(newline) => start += newline + 1,
            None => return text.len(),
        }
    }
    let line = text[start..].split('\n').next().unwrap_or_default();
    let mut units = 0;
    for (at, c) in line.char_indices() {
        if units >= position.character {
            return start + at;
        }
        units += c.len_utf16() as u32;
    }
    start + line.len()
}

/// Returns the position of a byte.
pub(super) fn position(text: &str, byte: usize) -> Position {
    let mut end = byte.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = &text[..end];
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.matches('\n').count() as u32;
    Position { line, character: before[start..].encode_utf16().count() as u32 }
}

/// Returns the range of a span.
pub(super) fn range(text: &str, span: Span) -> Range {
    Range { start: position(text, span.from), end: position(text, span.to) }
}

/// Returns the range of a whole text.
pub(super) fn whole(text: &str) -> Range {
    range(text, Span { from: 0, to: text.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_has_a_position_that_leads_back() {
        let text = "a °\n𝄞b\r\n\nend";
        for (byte, _) in text.char_indices().chain([(text.len(), ' ')]) {
            assert_eq!(offset(text, position(text, byte)), byte, "{byte}");
        }
        // The clef takes two columns in UTF-16.
        let b = text.find('b').expect("it is there");
        assert_eq!(position(text, b), Position { line: 1, character: 2 });
        assert_eq!(offset(text, Position { line: 9, character: 0 }), text.len());
        assert_eq!(offset(text, Position { line: 0, character: 99 }), 4);
    }
}
