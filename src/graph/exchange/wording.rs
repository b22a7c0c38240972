//! What the files say for people: the first line of a grammar, and notes above a text.

/// The first line of a grammar of a task's actions.
pub(super) fn grammar_of(task: &str) -> String {
    format!("# actions of {task}, each in quotes\n")
}

/// What a text cannot say of the values of an argument: how often each was chosen.
pub(super) fn uneven_shares(node: &str, parameter: &str, shares: &[String]) -> String {
    let shares = shares.join(", ");
    format!(
        "{node}: the values of `{parameter}` were chosen as {shares}; a text gives them even shares"
    )
}
