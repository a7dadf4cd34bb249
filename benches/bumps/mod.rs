//! A mesh for benches that are given none.

/// OBJ text of a closed sphere with bumps, about 4 `rings`² triangles.
pub fn bumps(rings: u32) -> String {
    use std::fmt::Write as _;
    let sectors = 2 * rings;
    let mut text = String::new();
    for ring in 0..=rings {
        for sector in 0..sectors {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * sector as f32 / sectors as f32;
            let r = 1.0 + 0.15 * (5.0 * theta).sin() * (4.0 * phi).cos() * theta.sin();
            let (x, z) = (r * theta.sin() * phi.cos(), r * theta.sin() * phi.sin());
            writeln!(text, "v {x} {} {z}", r * theta.cos()).unwrap();
        }
    }
    let at = |ring: u32, sector: u32| ring * sectors + sector % sectors + 1;
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b, c, d] = [at(ring, sector), at(ring, sector + 1), at(ring + 1, sector + 1), at(ring + 1, sector)];
            if ring > 0 {
                writeln!(text, "f {a} {b} {c}").unwrap();
            }
            if ring + 1 < rings {
                writeln!(text, "f {a} {c} {d}").unwrap();
            }
        }
    }
    text
}
