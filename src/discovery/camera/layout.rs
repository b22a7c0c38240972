//! From files of points to one table: which are held out, whose pose is known or guessed, which points move.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use super::lens::Lens;
use super::points::Points;
use super::views::{Data, Sight, Track, View};
use super::{error, wording};
use crate::alignment::camera_fit::{Refine, Sighting, refine_camera};
use crate::discovery::recording::Error;
use crate::discovery::robot::spline::Spline;
use crate::discovery::selection::Set;
use crate::world::{Camera, Pixel, Point};

/// Fewest points that say anything.
pub(super) const LEAST: usize = 8;

/// Fewest points of a picture from which its pose is fitted.
pub(super) const LEAST_IN_VIEW: usize = 4;

/// Says which rows of a file are held out.
fn held_out(file: &Points, fraction: f64) -> Vec<bool> {
    let rows = file.rows.len();
    if file.views.len() >= 4 {
        let held = ((file.views.len() as f64 * fraction).round() as usize).max(1);
        let first = file.views.len() - held.min(file.views.len() - 1);
        return file.rows.iter().map(|row| row.view >= first).collect();
    }
    let times: Option<Vec<f64>> = file.rows.iter().map(|row| row.time).collect();
    if let Some(times) = times {
        let mut sorted = times.clone();
        sorted.sort_by(f64::total_cmp);
        let cut = sorted[((rows as f64 * (1.0 - fraction)) as usize).min(rows - 1)];
        if sorted[0] < cut {
            return times.iter().map(|time| *time >= cut).collect();
        }
    }
    // Evenly spread: the last rows of a grid are one edge of the picture, and no fair judge of the rest.
    let whole = |row: usize| (row as f64 * fraction).floor();
    (0..rows).map(|row| whole(row + 1) > whole(row)).collect()
}

/// Puts the points of all files into one table, with their poses, their motion and their sets.
pub(super) fn laid_out(
    files: &[Points],
    nominal: Option<&Camera>,
    holdout: f64,
    notes: &mut Vec<String>,
) -> Result<Data, Error> {
    let Some(first) = files.first() else {
        return Err(error::no_points());
    };
    let from_file = files.iter().find_map(|file| file.known.lens);
    let lens = from_file
        .or(nominal.map(|camera| Lens::from(camera.intrinsics)))
        .ok_or_else(|| error::no_camera(&first.name))?;
    if from_file.is_some() && nominal.is_some() {
        notes.push(wording::CAMERA_OF_FILE.into());
    }
    // A camera of the scene has a pose; one of a file has it only if the file says so.
    let shared = files.iter().find_map(|file| file.known.world_from_camera).or_else(|| {
        from_file.is_none().then(|| nominal.map(|c| *c.world_from_camera.isometry())).flatten()
    });
    let posed = files.iter().all(|file| file.poses.is_some() || shared.is_some());
    if !posed && files.iter().any(|file| file.poses.is_some()) {
        return Err(error::some_posed(&first.name));
    }
    let mut data = Data {
        lens,
        sights: Vec::new(),
        views: Vec::new(),
        posed,
        vertical: None,
        tracks: Vec::new(),
        timed: files.iter().all(|file| file.rows.iter().all(|row| row.time.is_some())),
        sigma: 1.0,
        sigma_given: false,
        extent: 0.5,
    };
    for (at, file) in files.iter().enumerate() {
        let held = if files.len() > 1 {
            vec![at + 1 == files.len(); file.rows.len()]
        } else {
            held_out(file, holdout)
        };
        add(&mut data, at, file, shared, &held, notes)?;
    }
    if data.sights.len() < LEAST {
        return Err(error::too_few(data.sights.len(), LEAST, &first.name));
    }
    if posed {
        let up = |view: &View| view.camera_from_world.rotation * Vector3::z();
        let one = data.views.windows(2).all(|pair| {
            let apart = pair[0].camera_from_world.inverse() * pair[1].camera_from_world;
            apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-9
        });
        data.vertical = one.then(|| data.views.first().map(up)).flatten();
    } else {
        guess_poses(&mut data, files)?;
        notes.push(wording::POSES_FITTED.into());
    }
    data.extent = extent(&data, files)?;
    data.set_aside(LEAST_IN_VIEW);
    Ok(data)
}

/// Adds the points of one file.
fn add(
    data: &mut Data,
    at: usize,
    file: &Points,
    shared: Option<Isometry3<f64>>,
    held: &[bool],
    notes: &mut Vec<String>,
) -> Result<(), Error> {
    let first_view = data.views.len();
    for (i, name) in file.views.iter().enumerate() {
        let world_from_camera = match (&file.poses, shared) {
            (Some(poses), _) => poses[i],
            (None, Some(pose)) => pose,
            (None, None) => Isometry3::identity(),
        };
        let camera_from_world = world_from_camera.inverse();
        data.views.push(View { name: name.clone(), camera_from_world });
    }
    let moving = if data.posed { tracks(file, notes)? } else { Vec::new() };
    let mut of_row: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
    for (rows, track) in moving {
        let index = data.tracks.len();
        of_row.extend(rows.iter().enumerate().map(|(sample, row)| (*row, (index, sample))));
        data.tracks.push(track);
    }
    for (i, row) in file.rows.iter().enumerate() {
        let (track, sample) = of_row.get(&i).map_or((None, 0), |(track, s)| (Some(*track), *s));
        data.sights.push(Sight {
            file: at,
            line: row.line,
            view: first_view + row.view,
            point: row.point,
            pixel: row.pixel,
            time: row.time.unwrap_or(0.0),
            track,
            sample,
            set: if held[i] { Set::Heldout } else { Set::Train },
            wrong: false,
        });
    }
    Ok(())
}

/// Finds the points of a file that move: the rows of each in order of time, and its motion.
fn tracks(file: &Points, notes: &mut Vec<String>) -> Result<Vec<(Vec<usize>, Track)>, Error> {
    /// Less than this is no motion, m.
    const STILL: f64 = 1e-6;
    let times: Option<Vec<f64>> = file.rows.iter().map(|row| row.time).collect();
    let Some(times) = times else { return Ok(Vec::new()) };
    let mut named: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    if file.rows.iter().all(|row| row.label.is_some()) {
        for (i, row) in file.rows.iter().enumerate() {
            named.entry(row.label.clone().unwrap_or_default()).or_default().push(i);
        }
    } else {
        // Without names: the first row of a time is the first point, and so on.
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
        let mut number = 0;
        for (k, i) in order.iter().enumerate() {
            let again = k > 0 && times[order[k - 1]].total_cmp(&times[*i]).is_eq();
            number = if again { number + 1 } else { 0 };
            named.entry(format!("{number:06}")).or_default().push(*i);
        }
        let longest = named.values().map(Vec::len).max().unwrap_or(0);
        if named.values().any(|rows| rows.len() != longest) {
            notes.push(wording::motion_unknown(&file.name));
            return Ok(Vec::new());
        }
    }
    let mut found = Vec::new();
    for (name, mut rows) in named {
        rows.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
        let t: Vec<f64> = rows.iter().map(|row| times[*row]).collect();
        if let Some(k) = (1..t.len()).find(|k| t[*k] <= t[k - 1]) {
            let line = file.rows[rows[k]].line;
            return Err(error::two_places(&name, t[k], &file.name, line));
        }
        let axis = |axis: usize| -> Vec<f64> {
            rows.iter().map(|row| file.rows[*row].point[axis]).collect()
        };
        let first = file.rows[rows[0]].point;
        let moves = rows.iter().any(|row| (file.rows[*row].point - first).norm() > STILL);
        if t.len() < 4 || !moves {
            continue;
        }
        let axes = [0, 1, 2].map(|i| Spline::through(&t, &axis(i)));
        found.push((rows, Track { axes }));
    }
    Ok(found)
}

/// Guesses the pose of every picture from its points alone.
fn guess_poses(data: &mut Data, files: &[Points]) -> Result<(), Error> {
    for at in 0..data.views.len() {
        let sights: Vec<&Sight> = data.sights.iter().filter(|s| s.view == at).collect();
        let Some(first) = sights.first() else { continue };
        let place = format!("{}, view {}", files[first.file].name, data.views[at].name);
        let sighted: Vec<Sighting> = sights
            .iter()
            .map(|s| Sighting {
                point: Point::new(s.point.x, s.point.y, s.point.z),
                pixel: Pixel::new(s.pixel.x, s.pixel.y),
                sigma: 1.0,
            })
            .collect();
        let counts = [Set::Train, Set::Heldout]
            .map(|set| sights.iter().filter(|sight| sight.set == set).count());
        if counts.iter().any(|count| (1..LEAST_IN_VIEW).contains(count)) {
            let least = counts.iter().filter(|count| **count > 0).min().copied().unwrap_or(0);
            return Err(error::pose_needs_more(least, &place));
        }
        let centre = sights.iter().map(|s| s.point).sum::<Vector3<f64>>() / sights.len() as f64;
        let spread = sights.iter().map(|s| (s.point - centre).norm()).fold(1e-3, f64::max);
        let eye = centre + Vector3::new(0.1, 0.1, 4.0) * spread;
        let guess = Camera {
            world_from_camera: Camera::looking(data.lens.intrinsics(), eye, centre)
                .world_from_camera,
            intrinsics: data.lens.intrinsics(),
        };
        let fit = refine_camera(&guess, &sighted, &Refine::pose_only())
            .map_err(|why| error::pose_not_found(&why, &place))?;
        data.views[at].camera_from_world = *fit.camera.world_from_camera.inverse().isometry();
    }
    Ok(())
}

/// Returns the largest normalised coordinate.
fn extent(data: &Data, files: &[Points]) -> Result<f64, Error> {
    let mut most: f64 = 1e-3;
    for sight in &data.sights {
        let c = data.views[sight.view].camera_from_world.transform_point(&sight.point.into());
        if c.z <= 1e-6 {
            return Err(error::behind(&files[sight.file].name, sight.line));
        }
        most = most.max((c.x / c.z).abs()).max((c.y / c.z).abs());
    }
    Ok(most)
}
