//! The three regressions: planted truth, degenerate input, published numbers.

mod support;
mod image_map;
mod map_trust;
mod intrinsics;
mod camera_fit;
mod boards;
mod chessboard;
mod drawn_board;
mod chessboard_drawn;
mod fisheye;
mod hand_eye;
mod hand_eye_boards;
mod offset;
mod files;
