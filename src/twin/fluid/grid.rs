//! Neighbour search: particles hashed by cell, so that strays far away cost nothing.

use nalgebra::Vector3;

/// All pairs of near particles, each once.
///
/// They are found anew in each step, so a copy of the water starts without any.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    cells: Vec<[i32; 3]>,
    starts: Vec<u32>,
    next: Vec<u32>,
    /// Particles in the order of their buckets.
    sorted: Vec<u32>,
    /// Positions in the order of `sorted`: what is searched together lies together.
    places: Vec<Vector3<f32>>,
    /// Partners of particle `i`: `partners[firsts[i]..firsts[i + 1]]`.
    firsts: Vec<u32>,
    partners: Vec<u32>,
}

impl Clone for Pairs {
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

impl Pairs {
    /// Finds all pairs nearer than `h` m.
    pub(super) fn find(&mut self, positions: &[Vector3<f32>], h: f32) {
        let buckets = self.sort(positions, h);
        self.firsts.clear();
        self.partners.clear();
        let (cells, sorted, places, starts) =
            (&self.cells, &self.sorted, &self.places, &self.starts);
        for (i, p) in positions.iter().enumerate() {
            self.firsts.push(self.partners.len() as u32);
            let [cx, cy, cz] = cells[i];
            // Half of the cells around; the other half finds the pair from its other end.
            for [x, y] in [[cx, cy], [cx + 1, cy - 1], [cx + 1, cy], [cx + 1, cy + 1], [cx, cy + 1]]
            {
                let own = x == cx && y == cy;
                let mut search = |from: u32, to: u32| {
                    let range = from as usize..to as usize;
                    for (place, &j) in places[range.clone()].iter().zip(&sorted[range]) {
                        if (p - place).norm_squared() >= h * h {
                            continue;
                        }
                        // Different columns may share a bucket: each finds its own.
                        let [jx, jy, jz] = cells[j as usize];
                        let after = !own || jz > cz || (jz == cz && j as usize > i);
                        if jx == x && jy == y && after {
                            self.partners.push(j);
                        }
                    }
                };
                let (low, middle) = (if own { cz } else { cz - 1 }, bucket([x, y, cz], buckets));
                if middle > 0 && middle + 1 < buckets {
                    search(starts[if own { middle } else { middle - 1 }], starts[middle + 2]);
                } else {
                    for z in low..=cz + 1 {
                        let at = bucket([x, y, z], buckets);
                        search(starts[at], starts[at + 1]);
                    }
                }
            }
        }
        self.firsts.push(self.partners.len() as u32);
    }

    /// Sorts the particles by bucket and returns how many buckets there are.
    fn sort(&mut self, positions: &[Vector3<f32>], h: f32) -> usize {
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
        self.next.clone_from(&self.starts);
        self.sorted.clear();
        self.sorted.resize(n, 0);
        self.places.clear();
        self.places.resize(n, Vector3::zeros());
        for (i, c) in self.cells.iter().enumerate() {
            let at = &mut self.next[bucket(*c, buckets)];
            self.sorted[*at as usize] = i as u32;
            self.places[*at as usize] = positions[i];
            *at += 1;
        }
        buckets
    }

    /// Returns how many pairs there are.
    pub(super) fn len(&self) -> usize {
        self.partners.len()
    }

    /// Returns the partners of particle `i` that no earlier question has named a partner of, and the number
    /// of the first of these pairs.
    pub(super) fn of(&self, i: usize) -> (usize, &[u32]) {
        let (from, to) = (self.firsts[i] as usize, self.firsts[i + 1] as usize);
        (from, &self.partners[from..to])
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
        let mut pairs = Pairs::default();
        pairs.find(&points, h);
        let mut found = Vec::new();
        for i in 0..points.len() {
            let (first, partners) = pairs.of(i);
            assert_eq!(first, found.len());
            found.extend(partners.iter().map(|&j| (i.min(j as usize), i.max(j as usize))));
        }
        found.sort_unstable();
        let n = points.len();
        let all = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        let near = |&(i, j): &(usize, usize)| (points[i] - points[j]).norm_squared() < h * h;
        assert_eq!(found, all.filter(near).collect::<Vec<_>>());
    }
}
