//! Why a file is no graph, and why a graph is no text.

/// What makes a file unreadable as a graph.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unread {
    /// Another format, or another version of this one.
    #[error("it is not a graph of `stc-aog`, version 1")]
    Format,
    /// A key that is needed.
    #[error("`{key}` is missing in {part}")]
    Missing {
        /// The key.
        key: String,
        /// The beginning of the part that lacks it.
        part: String,
    },
    /// A key that is no list.
    #[error("`{key}` is no list in {part}")]
    NoList {
        /// The key.
        key: String,
        /// The beginning of the part it is in.
        part: String,
    },
    /// A root that is not among the nodes.
    #[error("the root is no node")]
    Root,
    /// An edge to or from nowhere.
    #[error("an edge names `{id}`, which is no node")]
    NoNode {
        /// What it names.
        id: String,
    },
    /// An edge to a fluent nobody describes.
    #[error("an edge names `{id}`, which is no fluent")]
    NoFluent {
        /// What it names.
        id: String,
    },
    /// A node of an unknown kind.
    #[error("a node is `and`, `or` or `leaf`, not `{0}`")]
    Kind(String),
    /// An And of an unknown form.
    #[error("there is no form `{0}`")]
    Form(String),
    /// A fingerprint that is no hexadecimal number.
    #[error("`{0}` is no fingerprint")]
    Fingerprint(String),
    /// A relation that is not of time, cause or space.
    #[error("there is no relation `{0}`")]
    Relation(String),
    /// A relation in time that is none of Allen's.
    #[error("there is no relation in time `{0}`")]
    Allen(String),
    /// A role that no fluent has.
    #[error("there is no role `{0}`")]
    Role(String),
    /// An Or that decides by something unknown.
    #[error("nothing decides by `{0}`")]
    Decides(String),
    /// A signature that cannot be read.
    #[error("`{0}` does not say what something takes")]
    Signature(String),
    /// An expression that cannot be read.
    #[error("`{0}` is no condition or value")]
    Expr(String),
    /// A call that cannot be read.
    #[error("`{0}` is no call")]
    Call(String),
    /// A remedy that cannot be read.
    #[error("`{0}` is no remedy")]
    Remedy(String),
    /// A line of a drawing whose bracket is open.
    #[error("line {0}: `[` is not closed")]
    OpenBracket(usize),
    /// A line of a drawing that cannot be read.
    #[error("line {0}: not attributes")]
    Attributes(usize),
}

/// What a graph has and no text can say.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unsaid {
    /// The text that would say it is refused, with this message.
    #[error("{0}")]
    Refused(String),
    /// Something that is called stands in the graph in several ways.
    #[error("`{name}` stands in it in ways that no parameter of it tells apart")]
    SeveralWays {
        /// What is called.
        name: String,
    },
    /// A node is not what its place needs.
    #[error("`{node}` {why}")]
    Odd {
        /// Its path.
        node: String,
        /// What it is or lacks.
        why: Oddity,
    },
    /// The text's graph lacks something.
    #[error("{what} cannot be said")]
    Lost {
        /// A node or a relation.
        what: String,
    },
    /// The text's graph has something in another way.
    #[error("{what} would be {would_be}, not {is}")]
    Other {
        /// A node or a relation.
        what: String,
        /// Its fields as the text says them.
        would_be: String,
        /// Its fields as they are.
        is: String,
    },
    /// The text's graph has something more.
    #[error("a text would add {what}")]
    Added {
        /// A node or a relation.
        what: String,
    },
    /// The text's graph has another prior.
    #[error("the prior of `{branch}` would be {would_be}, not {is}")]
    Prior {
        /// Whose.
        branch: String,
        /// As the text says it.
        would_be: f64,
        /// As it is.
        is: f64,
    },
}

/// What a node is or lacks, so that no step says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Oddity {
    /// A task was wanted.
    #[error("is no task")]
    NoTask,
    /// A recovery without its form.
    #[error("says nothing of what is done after a failure")]
    NoRemedy,
    /// A condition has two branches.
    #[error("is decided by a condition and has not two branches")]
    NotTwoBranches,
    /// A kind of node that is no step by itself.
    #[error("stands where no step of its kind can")]
    Misplaced,
    /// A block was wanted.
    #[error("is no block of steps")]
    NoBlock,
    /// An Or of fewer than two branches.
    #[error("has nothing to choose from")]
    NoChoice,
    /// A loop without rounds.
    #[error("repeats nothing")]
    NoRounds,
    /// An argument without values.
    #[error("has no values")]
    NoValues,
    /// A choice of an argument that the call does not have.
    #[error("chooses the value of what its call does not take")]
    NoArgument,
    /// A call was wanted.
    #[error("is no call")]
    NoCall,
}
