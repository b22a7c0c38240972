//! What can be wrong with a recording, its sidecar or its map, and what would help. Where it was met is said by whoever
//! meets it (`Flaw::at`).

use crate::units::{self, Dimension};

/// What is wrong with a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct Error {
    /// What.
    pub what: String,
    /// Where: file, line, column.
    pub place: String,
    /// What would help.
    pub help: String,
    /// What it is to a program.
    flaw: Option<Box<Flaw>>,
}

impl Error {
    /// An error of whoever reads more out of a recording than its columns.
    pub(crate) fn new(
        what: impl Into<String>,
        place: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self { what: what.into(), place: place.into(), help: help.into(), flaw: None }
    }

    /// Returns what is wrong with the file; `None` if the file is in order and what is asked of it is not.
    pub fn flaw(&self) -> Option<&Flaw> {
        self.flaw.as_deref()
    }
}

/// What is wrong with a recording's file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Flaw {
    /// It holds so many runs where one is asked for.
    #[error("the file holds {0} runs, each with a clock that starts again")]
    SeveralRuns(usize),
    /// Its clock starts again the first number of times; runs as many as the second are read.
    #[error("its clock starts again {0} times, and at most {1} runs are read")]
    TooManyRuns(usize, usize),
    /// It holds more values than are read.
    #[error("it holds {values} values, and at most {} million are read", .most / 1_000_000)]
    TooMuch {
        /// How many it holds.
        values: usize,
        /// How many are read.
        most: usize,
    },
    /// So many rows are too few to cut in two.
    #[error("{0} rows cannot be split into data to fit and data to hold out")]
    NotSplit(usize),
    /// A column that is asked for is missing.
    #[error("there is no column `{name}`")]
    NoColumn {
        /// Which.
        name: String,
        /// Those that there are, as far as they are told.
        known: Vec<String>,
        /// What it measures.
        dimension: Dimension,
    },
    /// A column measures something else.
    #[error("column `{name}` is in {}, but it must be {}", .is.si(), .expected.words())]
    ColumnUnit {
        /// Which.
        name: String,
        /// What it measures.
        is: Dimension,
        /// What it must measure.
        expected: Dimension,
    },
    /// Cells of a column are no finite numbers.
    #[error("{} is not a finite number{}{}", cell(.text), nor_are(.lines, *.n), nor_of(.others))]
    NotFinite {
        /// The first of them, as written.
        text: String,
        /// Lines of the others, as far as they are known.
        lines: Vec<usize>,
        /// How many others there are.
        n: usize,
        /// Other columns of numbers that have such cells.
        others: Vec<String>,
    },
    /// A value of a column is larger than any sensor shows.
    #[error("`{value:e}`{} at t = {t} s is more than any sensor shows", .is.map_or(String::new(), |unit| format!(" {}", unit.si())))]
    NoReading {
        /// The value, SI.
        value: f64,
        /// What it measures, where the column says.
        is: Option<Dimension>,
        /// When, s.
        t: f64,
    },
    /// The text is no CSV.
    #[error("not a table: {why}")]
    NoTable {
        /// What the file should be: `a recording is`.
        is: String,
        /// What the reader of CSV says.
        why: String,
    },
    /// The text is empty.
    #[error("the file is empty")]
    Empty {
        /// What the file should be: `a recording is`.
        is: String,
        /// How it could begin.
        header: String,
    },
    /// It has the first number of columns; as many as the second are read.
    #[error("it has {0} columns, and at most {1} are read")]
    TooManyColumns(usize, usize),
    /// A row has the first number of cells, the header the second.
    #[error("the row has {0} cells, the header {1}")]
    Ragged(usize, usize),
    /// Where cells are parted by spaces a row has the first number of them, the header the second.
    #[error("cells are parted by spaces; the row has {0}, the header {1}")]
    PartedBySpaces(usize, usize),
    /// A second header line has this cell, which is no unit that its column could have.
    #[error("a second header line, of which `{0}` is not a unit for its column")]
    SecondHeader(String),
    /// The map renames what is not there.
    #[error("`--map` renames `{theirs}`, which is not a column")]
    NotRenamed {
        /// The name that no column bears.
        theirs: String,
        /// The headers that there are.
        headers: Vec<String>,
    },
    /// A header cannot be read.
    #[error(transparent)]
    Header(units::Error),
    /// Two columns bear this name.
    #[error("two columns are called `{0}`")]
    SameName(String),
    /// No column is the time; the first that there is bears this name.
    #[error("there is no time column `t[s]`")]
    NoClock(String),
    /// The time is in a unit of something else.
    #[error("`t` is in {}, which is not a time", .is.si())]
    ClockUnit {
        /// What the unit measures.
        is: Dimension,
    },
    /// A cell of the time is no number.
    #[error("`{0}` is not a time")]
    NotATime(String),
    /// A time, s, is further from the clock's origin than the latest that is read, s.
    #[error("{0:e} s is no time that a clock shows; at most {1:e} s are read")]
    NoClockShows(f64, f64),
    /// There are too few rows.
    #[error("{}; nothing can be said from fewer than {least}", there_are(*.n))]
    TooFewRows {
        /// How many there are.
        n: usize,
        /// How many there must be.
        least: usize,
    },
    /// Only so many rows are no repetition of the one before.
    #[error("only {0} rows differ")]
    TooFewDiffer(usize),
    /// The time of a row, the second, is before that of the row before, the first, s.
    #[error("time goes back from {0} s to {1} s")]
    GoesBack(f64, f64),
    /// Two rows that differ are both of this time, s.
    #[error("two different rows are of the same time, {0} s")]
    SameTime(f64),
    /// The usual step of time, s, is finer than any clock's.
    #[error("its rows are {0:e} s apart, which no clock tells")]
    TooFine(f64),
    /// It is a bag, and something is wrong with that.
    #[error(transparent)]
    Bag(BagFlaw),
    /// The map of names is at fault.
    #[error(transparent)]
    Map(MapFlaw),
    /// The sidecar is at fault.
    #[error(transparent)]
    Sidecar(SidecarFlaw),
}

/// What is wrong with a ROS 2 bag.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BagFlaw {
    /// The file cannot be read.
    #[error("not an MCAP file that can be read: {0}")]
    Broken(BrokenBag),
    /// A message cannot be read.
    #[error("message {sequence} is not a joint state: {why}")]
    Message {
        /// Its number.
        sequence: u32,
        /// Why not.
        why: BrokenMessage,
    },
    /// It holds no joint states.
    #[error("no `{wanted}` in the bag")]
    NoJointStates {
        /// The kind of message that is read.
        wanted: &'static str,
        /// The topics that there are, with their kinds of message.
        topics: Vec<String>,
    },
    /// Nothing in it was measured.
    #[error("the bag holds commands, but no joint state that was measured")]
    OnlyCommands,
    /// Only so many joint states are of a time at which all topics speak.
    #[error("only {0} joint states lie where all topics have begun")]
    TooFewStates(usize),
    /// The map renames what is not there.
    #[error("`--map` renames `{theirs}`, which no joint state holds")]
    NotRenamed {
        /// The name that nothing bears.
        theirs: String,
        /// The names that there are.
        headers: Vec<String>,
    },
}

/// Why an MCAP file cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BrokenBag {
    /// It holds more than so many records.
    #[error("it holds more than {0} records")]
    TooManyRecords(usize),
    /// A chunk ends inside its header.
    #[error("a chunk is shorter than its header")]
    ShortChunk,
    /// Its chunks unpack to more than is read.
    #[error("its chunks unpack to {total} bytes or more, and at most {} GiB are read", *.most >> 30)]
    Unpacks {
        /// Bytes of the chunks so far.
        total: u64,
        /// Bytes that are read.
        most: u64,
    },
    /// A record ends nowhere.
    #[error("a record goes on beyond the end of its chunk")]
    BeyondChunk,
    /// The reader of MCAP says this.
    #[error("{0}")]
    Unread(String),
}

/// Why a message is no joint state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BrokenMessage {
    /// So many bytes are no message.
    #[error("{0} bytes are too few")]
    Short(usize),
    /// It begins with the mark of another encoding.
    #[error("its encoding {0:?} is not plain CDR")]
    Encoding(Vec<u8>),
    /// The reader of CDR says this.
    #[error("{0}")]
    Unread(String),
}

/// What is wrong with a map of names.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MapFlaw {
    /// This part has no `=`.
    #[error("`{0}` does not say what a column is called")]
    Unnamed(String),
    /// The new name or its unit cannot be read.
    #[error(transparent)]
    Header(units::Error),
    /// This part renames what was renamed, or to what was given.
    #[error("`{0}` names a column for the second time")]
    Twice(String),
}

/// What is wrong with a sidecar.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SidecarFlaw {
    /// It is not JSON, or a value is of the wrong type.
    #[error("not a recording's sidecar: {0}")]
    NoSidecar(String),
    /// The value of a key is below 0.
    #[error("`{0}` is {1}; it must not be negative")]
    Negative(&'static str, f64),
    /// A value in the list of a key of the controller is below 0.
    #[error("`controller.{0}` holds {1}; it must not be negative")]
    NegativeGain(&'static str, f64),
    /// The value of a key is not above 0.
    #[error("`{0}` is {1}; it must be above 0")]
    NotPositive(&'static str, f64),
    /// The controller has more gains of one kind.
    #[error("`controller` has unequal numbers of kp and kd")]
    UnequalGains,
    /// A zero of an encoder is more than a half turn, rad.
    #[error("`{0}` holds {1}, which is no angle in rad below a half turn")]
    NotAngle(&'static str, f64),
    /// Gravity is infinite.
    #[error("`gravity_m_s2` is not a number")]
    Gravity,
    /// Something about what was carried is infinite.
    #[error("`carried` holds something that is not a number")]
    CarriedNumbers,
    /// This thing was left before it was taken, or its contents are not in order.
    #[error("the times of `carried` ({0}) go back")]
    CarriedTimes(String),
    /// What was carried has this mass, kg.
    #[error("`carried.mass_kg` is {0}")]
    CarriedMass(f64),
}

impl Flaw {
    /// Returns it as an error, met at `place`.
    pub(super) fn at(self, place: impl Into<String>) -> Error {
        let (what, help) = (self.to_string(), self.help());
        Error { what, place: place.into(), help, flaw: Some(Box::new(self)) }
    }

    /// Returns what would help.
    pub fn help(&self) -> String {
        let help = match self {
            Self::SeveralRuns(_) => "give each run a file of its own",
            Self::TooManyRuns(..) => "is `t` the time? give the runs in several files",
            Self::TooMuch { .. } => "leave out columns that are not needed, or give a part of it",
            Self::NotSplit(_) => "record for longer, or give a second recording",
            Self::NoColumn { name, known, dimension } => {
                let (known, unit) = (known.join(", "), dimension.si());
                return format!(
                    "the file has {known}; `--map 'THEIRS={name}[{unit}]'` renames one"
                );
            }
            Self::ColumnUnit { name, expected, .. } => {
                return format!("write `{name}[{}]`, or correct it with `--map`", expected.si());
            }
            Self::NotFinite { .. } => {
                "put a `#` before such lines to leave them out, or fill them from their neighbours \
                 if you know that is right"
            }
            Self::NoReading { .. } => {
                "check such values and the unit of the column; a `#` before a line leaves it out"
            }
            Self::NoTable { is, .. } => {
                return format!("{is} a CSV file with one header line");
            }
            Self::Empty { is, header } => {
                return format!("{is} a CSV file that begins with a line such as `{header}`");
            }
            Self::TooManyColumns(..) => {
                "leave out the columns that are not needed; are rows and columns exchanged?"
            }
            Self::Ragged(..) => {
                "every row must have a cell per column; was the file cut off while being written?"
            }
            Self::PartedBySpaces(..) => {
                "every row must have a cell per column, none of them blank and none with a space in it; \
                 or part cells by commas"
            }
            Self::SecondHeader(cell) => {
                let meant = units::suggest_unit(cell);
                let meant = meant.map_or(String::new(), |unit| format!("write `{unit}`, or "));
                return format!("{meant}delete the line and write units in the first: `t[ms]`");
            }
            Self::NotRenamed { headers, .. } => {
                return format!("the columns are {}", headers.join(", "));
            }
            Self::Header(error) => return of_header(error),
            Self::SameName(_) => "rename one of them, in the file or with `--map`",
            Self::NoClock(first) => {
                return format!("if time is another column, say so: `--map '{first}=t[s]'`");
            }
            Self::ClockUnit { .. } => "write `t[s]`, `t[ms]`, `t[us]` or `t[ns]`",
            Self::NotATime(text) => super::wording::a_time(text),
            Self::NoClockShows(..) => {
                "leave the row out, or say in the header what unit `t` is in: `t[ms]`, `t[us]`, `t[ns]`"
            }
            Self::TooFewRows { .. } => "record for longer: a gap needs motion to show",
            Self::TooFewDiffer(_) => "record while the machine moves",
            Self::GoesBack(..) => {
                "sort the rows by time; a clock that starts again for another run goes back to where it began"
            }
            Self::SameTime(_) => "give each row its own time; is the time rounded too coarsely?",
            Self::TooFine(_) => "say in the header what unit `t` is in: `t[ms]`, `t[s]`",
            Self::Bag(flaw) => return flaw.help(),
            Self::Map(_) => "write it as `THEIRS=OURS` or `THEIRS=OURS[unit]`",
            Self::Sidecar(_) => {
                "every key may be left out; see docs/gap-arm.md, section Recordings for their form"
            }
        };
        help.to_owned()
    }
}

impl BagFlaw {
    fn help(&self) -> String {
        let help = match self {
            Self::Broken(_) => {
                "`ros2 bag record -s mcap` writes one; was it cut off while being written?"
            }
            Self::Message { .. } => "was it written by another version of the message?",
            Self::NoJointStates { topics, .. } => {
                let holds =
                    if topics.is_empty() { "nothing".to_owned() } else { topics.join(", ") };
                return format!("record `/joint_states`; the bag holds {holds}");
            }
            Self::OnlyCommands => "record the topic `/joint_states` too",
            Self::TooFewStates(_) => "record for longer, and all topics at once",
            Self::NotRenamed { headers, .. } => {
                return format!("the bag has {}", headers.join(", "));
            }
        };
        help.to_owned()
    }
}

/// Says how a header that cannot be read is written; the unit that was meant, where it is known.
fn of_header(error: &units::Error) -> String {
    let meant = match error {
        units::Error::UnknownUnit { text } => units::suggest_unit(text),
        units::Error::BadColumn { .. } => None,
    };
    let write = meant.map_or("`name[unit]`".to_owned(), |unit| format!("`[{unit}]`"));
    format!("write {write}, or rename it with `--map 'THEIRS=OURS[unit]'`")
}

/// How many lines are written out where several are wrong.
const TOLD: usize = 5;

/// Says which cells of a column are wrong beside the first: `n`, some of them in `lines`.
fn nor_are(lines: &[usize], n: usize) -> String {
    if n == 0 {
        return String::new();
    }
    let lines: Vec<String> = lines.iter().take(TOLD).map(usize::to_string).collect();
    let rest = if n > TOLD { format!(" and {} more", n - TOLD) } else { String::new() };
    format!(", nor are {n} other cells of the column (lines {}{rest})", lines.join(", "))
}

/// Names a cell by what is written in it.
fn cell(text: &str) -> String {
    if text.is_empty() { "an empty cell".to_owned() } else { format!("`{text}`") }
}

/// How many columns are named where several are at fault.
const TOLD_COLUMNS: usize = 12;

/// Says which other columns have such cells.
fn nor_of(columns: &[String]) -> String {
    if columns.is_empty() {
        return String::new();
    }
    let rest = columns.len().saturating_sub(TOLD_COLUMNS);
    let rest = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    let named: Vec<String> = columns.iter().take(TOLD_COLUMNS).map(|c| format!("`{c}`")).collect();
    format!("; other columns have such cells, too: {}{rest}", named.join(", "))
}

/// Says how many rows there are, if they are few.
fn there_are(n: usize) -> String {
    match n {
        0 => "there are no rows".to_owned(),
        1 => "there is one row".to_owned(),
        n => format!("there are {n} rows"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_cells_that_are_no_numbers_the_first_few_are_told() {
        let flaw = |lines: &[usize], n: usize| Flaw::NotFinite {
            text: "nan".into(),
            lines: lines.to_vec(),
            n,
            others: Vec::new(),
        };
        assert_eq!(flaw(&[], 0).to_string(), "`nan` is not a finite number");
        assert_eq!(
            flaw(&[3, 4, 5, 6, 7, 8], 9).to_string(),
            "`nan` is not a finite number, nor are 9 other cells of the column (lines 3, 4, 5, 6, 7 and 4 more)"
        );
        let (text, others) = (String::new(), vec!["q_4".to_owned(), "tau_2".to_owned()]);
        assert_eq!(
            Flaw::NotFinite { text, lines: Vec::new(), n: 0, others }.to_string(),
            "an empty cell is not a finite number; other columns have such cells, too: `q_4`, `tau_2`"
        );
    }

    #[test]
    fn a_flaw_is_kept_beside_its_words() {
        let error = Flaw::Bag(BagFlaw::Broken(BrokenBag::Unpacks { total: 1, most: 2 << 30 }));
        let error = error.at("run.mcap");
        assert!(error.what.ends_with("unpack to 1 bytes or more, and at most 2 GiB are read"));
        assert!(matches!(error.flaw(), Some(Flaw::Bag(BagFlaw::Broken(_)))));
        assert!(Error::new("no", "run.mcap", "").flaw().is_none());
    }
}
