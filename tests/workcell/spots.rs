//! Where things stand, as sentences are told it.

use trueup::lab::{LabSettings, Spot};
use trueup::workcell::WorkCell;

use super::options;

#[test]
fn things_stand_left_and_ahead_of_the_base_where_the_camera_sees_them() {
    let mut lab = LabSettings::default();
    let placed = [("jar", 0.60, 0.10), ("cup", 0.58, -0.22)];
    for (name, x_m, y_m) in placed {
        lab.placement.fixed.insert(name.into(), Spot { x_m, y_m, yaw_rad: 0.3 });
    }
    let mut cell = WorkCell::open(options(lab, 1)).unwrap();
    let spots = cell.spots().unwrap();
    for (name, x, y) in placed {
        let (_, spot) = spots.iter().find(|(known, _)| known == name).unwrap();
        // The kitchen's arm stands at the origin and looks along x.
        let seen = [spot.ahead - x, spot.left - y, spot.at[0] - x, spot.at[1] - y];
        assert!(seen.iter().all(|off| off.abs() < 3e-3), "{name}: {seen:?}");
        assert!(spot.facing.abs() < 1e-12 && spot.on.is_none());
    }
}
