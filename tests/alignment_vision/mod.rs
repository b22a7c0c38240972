//! Vision: pictures with known truth, painted here, and published photographs read in place.

mod marks;
mod paint;
mod see;
mod visp;
