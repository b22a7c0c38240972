//! What a reading says in words: why nobody knows a value, and what does not fit in a call.
//!
//! Only sentences; when each is said is decided in [`super::builtin`] and [`super::eval`].

/// Nothing tells whether the gripper touches the table.
pub(super) const TABLE_NOT_FELT: &str = "contact with the table was not measured";
/// Two things may touch or not.
pub(super) const CLOSE: &str = "they are close; contact was not measured";
/// Nothing has a place yet.
pub(super) const NO_PHOTO: &str = "no photo yet; type `:look`";
/// Reach is for planning to say, and nothing was planned.
pub(super) const NO_WAY_PLANNED: &str = "no path to it has been planned yet";
/// One side of `==` has no value.
pub(super) const ONE_SIDE: &str = "one side is not known";
/// A comparison without a margin and without a reason.
pub(super) const NO_VALUE: &str = "it has no value";
/// What a condition has to be.
pub(super) const A_TRUTH: &str = "something true or false";
/// What a point is made of.
pub(super) const A_KNOWN_LENGTH: &str = "a length that is known";
/// Where something may stand.
pub(super) const A_REGION: &str = "a place with room in it, not a point";
/// What of resting on something is how far it is above that.
pub(super) const ITS_HEIGHT: &str = "the gap below it";
/// What of resting on something is how far inside its edge it stands.
pub(super) const ITS_EDGE: &str = "how far inside the edge of what bears it";
/// What of resting somewhere is the place.
pub(super) const ITS_PLACE: &str = "how far inside that place";
/// Who looks.
pub(super) const A_VIEW: &str = "`robot` or `camera`";
/// What `within` stands after.
pub(super) const A_COMPARISON: &str = "a comparison before `within`";

/// Why the volume in a vessel is unknown.
pub(super) fn water(object: &str) -> String {
    format!("the water in `{object}` has not been measured")
}

/// Why the volume on the table is unknown.
pub(super) fn spilt() -> String {
    "spilt water has not been measured".to_owned()
}

/// Why the speed of an object is unknown.
pub(super) fn speed(object: &str) -> String {
    format!("the speed of `{object}` has not been measured")
}

/// Why what was done to an object with a tool is unknown.
pub(super) fn work(object: &str) -> String {
    format!("what a tool did to `{object}` has not been measured")
}

/// Why what depends on a place is unknown.
pub(super) fn place(object: &str) -> String {
    format!("the position of `{object}` has not been measured")
}

/// Why a limit is neither kept nor broken.
pub(super) fn no_value_of(term: &str) -> String {
    format!("{term} has no value")
}

/// Why there is no quotient.
pub(super) fn zero_divisor(term: &str) -> String {
    format!("{term} is zero, and nothing can be divided by it")
}

/// Why a quotient is unknown.
pub(super) fn no_number(term: &str) -> String {
    format!("{term} is no number")
}

/// Why a margin decides nothing: it and its standard deviation, with their units.
pub(super) fn within_noise(margin: &str, sigma: &str) -> String {
    format!("the margin of {margin} is within twice ± {sigma}")
}

/// How many arguments a function takes.
pub(super) fn wrong_count(function: &str, takes: usize, given: usize) -> String {
    format!("`{function}` takes {takes} argument(s), not {given}")
}

/// A parameter of a fluent was given alternatives.
pub(super) fn more_than_one(parameter: &str, fluent: &str) -> String {
    format!("`{parameter}` of `{fluent}` has more than one value")
}

/// A function was given alternatives.
pub(super) fn no_alternatives(function: &str) -> String {
    format!("`{function}` takes one value here, not alternatives")
}
