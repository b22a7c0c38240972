//! Vision: pictures with known truth, painted here, and published photographs read in place.

mod believed;
mod choice;
mod drawer;
mod lab_photos;
mod laboratory;
mod marks;
mod paint;
mod see;
mod stopped;
mod visp;
