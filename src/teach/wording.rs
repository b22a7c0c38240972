//! The words of stepping as they are told: one table for reading, help and "did you mean".

/// A word, what it takes and what it does, in the order of help.
pub const WORDS: &[(&str, &str, &str)] = &[
    ("next", "", "carry out one step; Enter does the same"),
    ("into", "", "pause at each step of a sub-task; of a step, at each line of its script"),
    ("over", "", "carry out a whole sub-task"),
    ("out", "", "carry out the rest of the sub-task or script you are in"),
    ("continue", "", "go on to the next breakpoint, or to the end"),
    ("back", "[STEP]", "look at the last step, the one before it, …; the arm does not move"),
    ("forward", "", "look at the step after it, up to the present"),
    ("why", "[FLUENT]", "why a fluent is what it is"),
    ("hint", "", "by how much, then which way, then what to try"),
    ("slow", "[PERCENT]", "the arm's speed, from 1 to 100 % of what is planned"),
    ("break", "[STEP]", "pause before a step (name, path, number) or a line (lift.rhai:2)"),
    ("clear", "[STEP]", "take a breakpoint away, or all of them"),
    ("quit", "", "end here; the arm holds its position"),
];
