//! Neighbour search: particles hashed by cell, so that strays far away cost nothing.

use nalgebra::Vector3;

use super::solve::map;

/// Most neighbours one particle may have; water at rest has about 30.
const MAX_NEIGHBOURS: usize = 80;

/// The neighbours of one particle.
#[derive(Debug)]
struct Neighbours {
    n: usize,
    ids: [u32; MAX_NEIGHBOURS],
}

/// Particles sorted by hashed cell, and each one's neighbours.
///
/// It is built anew in each step, so a copy of the water starts with an empty one.
#[derive(Debug, Default)]
pub(super) struct Grid {
    cells: Vec<[i32; 3]>,
    starts: Vec<u32>,
    sorted: Vec<u32>,
    /// Positions in the order of `sorted`: what is searched together lies together.
    places: Vec<Vector3<f32>>,
    lists: Vec<Neighbours>,
}

impl Clone for Grid {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Returns a cell's bucket: hashed by column, so that the cells above each other are neighbours.
fn bucket([x, y, z]: [i32; 3], buckets: usize) -> usize {
    // Teschner et al., "Optimized spatial hashing for collision detection", 2003.
    let column = (x as u32).wrapping_mul(73_856_093) ^ (y as u32).wrapping_mul(19_349_663);
    (column.wrapping_add(z as u32)) as usize & (buckets - 1)
}

impl Grid {
    /// Finds all pairs nearer than `h` m. Each list is in a fixed order whatever the number of threads.
    pub(super) fn build(&mut self, positions: &[Vector3<f32>], h: f32) {
        let n = positions.len();
        let buckets = (2 * n).next_power_of_two().max(64);
        let cell = |p: &Vector3<f32>| [p.x, p.y, p.z].map(|c| (c / h).floor() as i32);
        self.cells.clear();
        self.cells.extend(positions.iter().map(cell));
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        for c in &self.cells {
            self.starts[bucket(*c, buckets) + 1] += 1;
        }
        for b in 0..buckets {
            self.starts[b + 1] += self.starts[b];
        }
        let mut next = self.starts.clone();
        self.sorted.clear();
        self.sorted.resize(n, 0);
        self.places.clear();
        self.places.resize(n, Vector3::zeros());
        for (i, c) in self.cells.iter().enumerate() {
            let at = &mut next[bucket(*c, buckets)];
            self.sorted[*at as usize] = i as u32;
            self.places[*at as usize] = positions[i];
            *at += 1;
        }
        let (cells, starts, sorted, places) =
            (&self.cells, &self.starts, &self.sorted, &self.places);
        self.lists = map(n, |i| {
            let [cx, cy, cz] = cells[i];
            let mut list = Neighbours { n: 0, ids: [0; MAX_NEIGHBOURS] };
            let mut search = |x: i32, y: i32, from: u32, to: u32| {
                for at in from as usize..to as usize {
                    let near = (positions[i] - places[at]).norm_squared() < h * h;
                    if !near || list.n == MAX_NEIGHBOURS {
                        continue;
                    }
                    let j = sorted[at];
                    let [jx, jy, _] = cells[j as usize];
                    // Different columns may share a bucket: each finds its own.
                    if j as usize != i && jx == x && jy == y {
                        list.ids[list.n] = j;
                        list.n += 1;
                    }
                }
            };
            for x in cx - 1..=cx + 1 {
                for y in cy - 1..=cy + 1 {
                    let middle = bucket([x, y, cz], buckets);
                    if middle > 0 && middle + 1 < buckets {
                        search(x, y, starts[middle - 1], starts[middle + 2]);
                    } else {
                        for z in cz - 1..=cz + 1 {
                            let at = bucket([x, y, z], buckets);
                            search(x, y, starts[at], starts[at + 1]);
                        }
                    }
                }
            }
            list
        });
    }

    /// Returns the neighbours of particle `i`, itself left out.
    pub(super) fn of(&self, i: usize) -> &[u32] {
        let list = &self.lists[i];
        &list.ids[..list.n]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn every_near_pair_is_found_once_and_strays_do_no_harm() {
        let mut rng = rand::rngs::StdRng::seed_from_u64(7);
        let mut points: Vec<Vector3<f32>> =
            (0..400).map(|_| Vector3::from_fn(|_, _| rng.random_range(-0.03_f32..0.03))).collect();
        points.push(Vector3::new(1.0e4, -3.0e3, 2.0));
        let h = 0.01;
        let mut grid = Grid::default();
        grid.build(&points, h);
        for i in 0..points.len() {
            let mut found = grid.of(i).to_vec();
            found.sort_unstable();
            let near = |j: &usize| *j != i && (points[i] - points[*j]).norm_squared() < h * h;
            let expected: Vec<u32> = (0..points.len()).filter(near).map(|j| j as u32).collect();
            assert_eq!(found, expected);
        }
    }
}
