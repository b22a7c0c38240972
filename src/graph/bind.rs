//! Which calls an `on failure of` means.

use super::Argument;
use crate::language::ast::Call;
use crate::language::text;

/// Returns whether a recovery `of` pattern means this call: every argument it names is the same.
pub(super) fn matches(pattern: &Call, name: &str, args: &[Argument]) -> bool {
    if pattern.name.text != name {
        return false;
    }
    let mut bare = 0;
    pattern.args.iter().all(|arg| {
        let found = if let Some(wanted) = &arg.name {
            args.iter().find(|a| a.name == wanted.text)
        } else {
            bare += 1;
            args.get(bare - 1)
        };
        found.is_some_and(|found| arg.values.iter().any(|v| text::expr(v) == found.text))
    })
}
