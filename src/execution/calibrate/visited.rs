//! What became of the points at which an arm was to show its marker, for who tells it.

/// What became of the points at which the arm was to show its marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Visited {
    /// Where the marker was seen.
    pub seen: usize,
    /// Where it was looked for: the points that the arm came to.
    pub reached: usize,
    /// The points at which the camera does not see it, by where camera and arm are thought to be.
    pub outside: usize,
    /// The others whose pose is out of the arm's reach.
    pub out_of_reach: usize,
    /// The others where something is in the way, or the limits refuse the way there.
    pub in_the_way: usize,
    /// The points that it was to come to: all of these.
    pub points: usize,
    /// How many it has to be seen at.
    pub needed: usize,
}
