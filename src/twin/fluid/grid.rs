//! Neighbour search: particles hashed by cell, so that strays far away cost nothing.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Most neighbours one particle may have; water at rest has about 30.
const MAX_NEIGHBOURS: usize = 80;

/// Particles sorted by hashed cell, and each one's neighbours.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    cells: Vec<[i32; 3]>,
    starts: Vec<u32>,
    sorted: Vec<u32>,
    counts: Vec<u32>,
    lists: Vec<u32>,
}

fn hash(cell: [i32; 3], buckets: usize) -> usize {
    // Teschner et al., "Optimized spatial hashing for collision detection", 2003.
    let [x, y, z] = cell.map(|c| c as u32);
    let mixed =
        x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    mixed as usize & (buckets - 1)
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
            self.starts[hash(*c, buckets) + 1] += 1;
        }
        for b in 0..buckets {
            self.starts[b + 1] += self.starts[b];
        }
        let mut next = self.starts.clone();
        self.sorted.clear();
        self.sorted.resize(n, 0);
        for (i, c) in self.cells.iter().enumerate() {
            let bucket = hash(*c, buckets);
            self.sorted[next[bucket] as usize] = i as u32;
            next[bucket] += 1;
        }
        self.counts.clear();
        self.counts.resize(n, 0);
        self.lists.resize(n * MAX_NEIGHBOURS, 0);
        let (cells, starts, sorted) = (&self.cells, &self.starts, &self.sorted);
        self.lists
            .par_chunks_mut(MAX_NEIGHBOURS)
            .zip(self.counts.par_iter_mut())
            .enumerate()
            .with_min_len(256)
            .for_each(|(i, (list, count))| {
                let [cx, cy, cz] = cells[i];
                for dx in -1..=1 {
                    for dy in -1..=1 {
                        for dz in -1..=1 {
                            let near = [cx + dx, cy + dy, cz + dz];
                            let bucket = hash(near, buckets);
                            let range = starts[bucket] as usize..starts[bucket + 1] as usize;
                            for &j in &sorted[range] {
                                let j_at = j as usize;
                                let apart = (positions[i] - positions[j_at]).norm_squared();
                                // Different cells may share a bucket: each counts its own.
                                if apart < h * h
                                    && j_at != i
                                    && cells[j_at] == near
                                    && (*count as usize) < MAX_NEIGHBOURS
                                {
                                    list[*count as usize] = j;
                                    *count += 1;
                                }
                            }
                        }
                    }
                }
            });
    }

    /// Returns the neighbours of particle `i`, itself left out.
    pub(super) fn of(&self, i: usize) -> &[u32] {
        &self.lists[i * MAX_NEIGHBOURS..i * MAX_NEIGHBOURS + self.counts[i] as usize]
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
