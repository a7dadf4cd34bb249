//! A triangle mesh, what a closed one must satisfy, and its OBJ text.

use std::collections::HashMap;
use std::fmt::Write as _;

use marmor::math::DVec3;

/// Triangles over shared vertices, counter-clockwise seen from outside [mm].
#[derive(Clone, Default)]
pub struct Mesh {
    /// Vertices [mm].
    pub positions: Vec<DVec3>,
    /// Three indices into `positions` each.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals; empty for a mesh that shades with its triangles' own.
    pub normals: Vec<DVec3>,
    /// Three indices into `normals` each, in the order of `triangles`; empty without normals.
    pub normal_triangles: Vec<[u32; 3]>,
    /// Texture coordinates of each vertex; empty without any.
    pub uv: Vec<[f64; 2]>,
}

/// What a check of a mesh counted.
pub struct Summary {
    /// Triangles.
    pub triangles: usize,
    /// Enclosed volume [mm³]; positive if the mesh faces outward.
    pub volume: f64,
    /// Smallest angle of any triangle [degrees].
    pub smallest_angle: f64,
}

impl Mesh {
    /// Adds a vertex and returns its index.
    pub fn vertex(&mut self, p: DVec3) -> u32 {
        self.positions.push(p);
        self.positions.len() as u32 - 1
    }

    /// Adds a quadrilateral as two triangles, cut along a-c.
    pub fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Adds another mesh that has no normals yet, each vertex moved by `place`.
    pub fn add(&mut self, other: &Mesh, place: impl Fn(DVec3) -> DVec3) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|p| place(*p)));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    }

    /// The corners of a triangle [mm].
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    /// (b - a) x (c - a) of a triangle [mm²].
    pub fn scaled_normal(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Removes vertices that no triangle uses; the others keep their order.
    pub fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|i| used[*i as usize] = true);
        let mut count = 0;
        let new_index: Vec<u32> = used
            .iter()
            .map(|used| {
                count += u32::from(*used);
                count.wrapping_sub(1)
            })
            .collect();
        let mut keep = used.iter();
        self.positions.retain(|_| keep.next().is_some_and(|k| *k));
        self.triangles.iter_mut().flatten().for_each(|i| *i = new_index[*i as usize]);
    }

    /// Keeps the connected part with the most triangles: voids inside a solid and loose crumbs go.
    pub fn keep_largest_part(&mut self) {
        // Each vertex points towards a lower one of its part, the lowest to itself.
        let mut lower: Vec<u32> = (0..self.positions.len() as u32).collect();
        fn lowest(lower: &mut [u32], mut v: u32) -> u32 {
            while lower[v as usize] != v {
                lower[v as usize] = lower[lower[v as usize] as usize];
                v = lower[v as usize];
            }
            v
        }
        for [a, b, c] in &self.triangles {
            for other in [b, c] {
                let (x, y) = (lowest(&mut lower, *a), lowest(&mut lower, *other));
                lower[x.max(y) as usize] = x.min(y);
            }
        }
        let mut sizes = vec![0_usize; self.positions.len()];
        let parts: Vec<u32> = self.triangles.iter().map(|t| lowest(&mut lower, t[0])).collect();
        parts.iter().for_each(|part| sizes[*part as usize] += 1);
        let Some(largest) = parts.iter().copied().max_by_key(|part| (sizes[*part as usize], *part)) else { return };
        let mut part = parts.iter();
        self.triangles.retain(|_| part.next() == Some(&largest));
        self.drop_unused_vertices();
    }

    /// Gives each corner the mean, weighted by area, of the normals around its vertex that lie within
    /// `crease` [degrees] of its own triangle's: curved parts shade smooth, edges stay sharp.
    #[must_use]
    pub fn creased(mut self, crease: f64) -> Self {
        let scaled: Vec<DVec3> = self.triangles.iter().map(|t| self.scaled_normal(*t)).collect();
        let mut around = vec![Vec::new(); self.positions.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            for i in triangle {
                around[*i as usize].push(t);
            }
        }
        let limit = crease.to_radians().cos();
        let mut known: HashMap<[i64; 3], u32> = HashMap::new();
        for t in 0..self.triangles.len() {
            let own = scaled[t].normalize();
            let corners = self.triangles[t].map(|i| {
                let alike = around[i as usize].iter().filter(|o| scaled[**o].normalize().dot(own) > limit);
                let n = alike.map(|o| scaled[*o]).sum::<DVec3>().normalize();
                let key = (n * 1000.0).round().to_array().map(|v| v as i64);
                *known.entry(key).or_insert_with(|| {
                    self.normals.push(n);
                    self.normals.len() as u32 - 1
                })
            });
            self.normal_triangles.push(corners);
        }
        self
    }

    /// The mesh as its file will hold it, after the same rounding.
    fn rounded(&self) -> Self {
        let positions = self.positions.iter().map(|p| (p * 1000.0).round() / 1000.0).collect();
        Self { positions, ..self.clone() }
    }

    /// Checks the mesh as the file will hold it: every edge is shared by two triangles that run along it in
    /// opposite directions, the triangles around a vertex form one fan, none is without area, all faces point
    /// outward as a whole, and normals agree with their triangles.
    ///
    /// # Errors
    /// The first of these that does not hold.
    pub fn check_solid(&self) -> Result<Summary, String> {
        let mesh = self.rounded();
        let mut next = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                if next.insert((t[k], t[(k + 1) % 3]), t[(k + 2) % 3]).is_some() {
                    return Err(format!("two triangles run along the edge {} {} the same way", t[k], t[(k + 1) % 3]));
                }
            }
        }
        if let Some((a, b)) = next.keys().filter(|(a, b)| !next.contains_key(&(*b, *a))).min() {
            return Err(format!("open edge {a} {b} at {}", mesh.positions[*a as usize]));
        }
        let mut valence = vec![0; mesh.positions.len()];
        let mut spoke = vec![0; mesh.positions.len()];
        for t in &mesh.triangles {
            for k in 0..3 {
                valence[t[k] as usize] += 1;
                spoke[t[k] as usize] = t[(k + 1) % 3];
            }
        }
        for (v, count) in valence.iter().enumerate() {
            let (mut steps, mut at) = (0, spoke[v]);
            while steps < *count {
                at = next[&(v as u32, at)];
                steps += 1;
                if at == spoke[v] {
                    break;
                }
            }
            if steps == 0 || steps != *count {
                return Err(format!("the {count} triangles around vertex {v} are not one fan"));
            }
        }
        let mut volume = 0.0;
        let mut smallest_angle = f64::INFINITY;
        for (k, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(*t);
            let n = mesh.scaled_normal(*t);
            if n.length() < 1e-6 {
                return Err(format!("triangle {k} at {a} has no area"));
            }
            if let Some(corners) = mesh.normal_triangles.get(k)
                && corners.iter().any(|i| mesh.normals[*i as usize].dot(n) <= 0.0)
            {
                return Err(format!("a normal of triangle {k} at {a} points to its other side"));
            }
            volume += a.dot(b.cross(c)) / 6.0;
            smallest_angle = smallest_angle.min(smallest_of_triangle([a, b, c]));
        }
        if volume <= 0.0 {
            return Err(format!("faces point inward: the volume is {volume} mm³"));
        }
        Ok(Summary { triangles: mesh.triangles.len(), volume, smallest_angle: smallest_angle.to_degrees() })
    }

    /// OBJ text with three decimals: micrometres, and a thousandth of a unit normal.
    pub fn to_obj(&self, title: &str) -> String {
        let mut text = format!("# {title}\n# made by examples/make_scenes; unit: mm; y is up\n");
        let line = |text: &mut String, key: &str, v: DVec3| {
            let [x, y, z] = v.to_array().map(decimals);
            let _ = writeln!(text, "{key} {x} {y} {z}"); // writing to a String cannot fail
        };
        self.positions.iter().for_each(|p| line(&mut text, "v", *p));
        self.uv.iter().for_each(|[u, v]| {
            let _ = writeln!(text, "vt {u:.5} {v:.5}");
        });
        self.normals.iter().for_each(|n| line(&mut text, "vn", *n));
        for (k, t) in self.triangles.iter().enumerate() {
            let [a, b, c] = t.map(|i| i + 1);
            let _ = match self.normal_triangles.get(k) {
                Some(n) => writeln!(text, "f {a}//{} {b}//{} {c}//{}", n[0] + 1, n[1] + 1, n[2] + 1),
                None if !self.uv.is_empty() => writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}"),
                None => writeln!(text, "f {a} {b} {c}"),
            };
        }
        text
    }
}

/// Three decimals at most, without trailing zeros and without a negative zero.
fn decimals(v: f64) -> String {
    let text = format!("{v:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Smallest angle of a triangle [radians].
pub fn smallest_of_triangle(corners: [DVec3; 3]) -> f64 {
    (0..3).map(|k| angle_at(corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3])).fold(f64::INFINITY, f64::min)
}

/// Angle at `a` between the directions to `b` and `c` [radians].
pub fn angle_at(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    u.cross(v).length().atan2(u.dot(v))
}
