//! Pictures in other primaries, converted to those of Rec. 709.

use glam::{DMat3, DVec3};

use crate::math::Rgb;

/// The chromaticities (x, y) of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries(pub [[f64; 2]; 4]);

const REC709: Primaries = Primaries([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]]);

/// The tristimulus values themselves, white where they are equal.
pub(super) const XYZ: Primaries = Primaries([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]]);

/// Those that have a name.
const NAMED: [(&str, Primaries); 7] = [
    ("ACES AP0", Primaries([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]])),
    ("ACEScg (AP1)", Primaries([[0.713, 0.293], [0.165, 0.83], [0.128, 0.044], [0.32168, 0.33767]])),
    ("Rec. 2020", Primaries([[0.708, 0.292], [0.17, 0.797], [0.131, 0.046], [0.3127, 0.329]])),
    ("Display P3", Primaries([[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], [0.3127, 0.329]])),
    ("DCI-P3", Primaries([[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], [0.314, 0.351]])),
    ("Adobe RGB", Primaries([[0.64, 0.33], [0.21, 0.71], [0.15, 0.06], [0.3127, 0.329]])),
    ("XYZ", XYZ),
];

/// Writers round chromaticities to four digits, and white to three or four.
const SAME: f64 = 6e-4;

/// Cone responses of Bradford [Lam 1985] from XYZ, by columns.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// X, Y and Z of a chromaticity, which add up to 1.
fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x, y, 1.0 - x - y)
}

impl Primaries {
    fn same_as(&self, other: &Self) -> bool {
        self.0.iter().flatten().zip(other.0.iter().flatten()).all(|(a, b)| (a - b).abs() <= SAME)
    }

    /// XYZ of white at Y = 1.
    fn white(&self) -> DVec3 {
        xyz(self.0[3]) / self.0[3][1]
    }

    /// Takes linear RGB in these primaries to XYZ; (1, 1, 1) becomes white.
    fn to_xyz(self) -> DMat3 {
        let columns = DMat3::from_cols(xyz(self.0[0]), xyz(self.0[1]), xyz(self.0[2]));
        columns * DMat3::from_diagonal(columns.inverse() * self.white())
    }

    /// The conversion to Rec. 709, and what to call these primaries; none where they are those of Rec. 709. White becomes
    /// white: what the eye that had adapted to one takes for white, it takes the other for, by Bradford's scaling of cones.
    /// Colours that Rec. 709 does not have come out with a channel below 0.
    ///
    /// # Errors
    /// A text where these are no primaries: three on a line, or a white outside of them.
    pub(super) fn to_rec709(self) -> Result<Option<(Conversion, String)>, String> {
        let text = format!("red {:?}, green {:?}, blue {:?}, white {:?}", self.0[0], self.0[1], self.0[2], self.0[3]);
        let columns = DMat3::from_cols(xyz(self.0[0]), xyz(self.0[1]), xyz(self.0[2]));
        let amounts = columns.inverse() * self.white();
        if !(columns.determinant().abs() > 1e-4 && amounts.is_finite() && amounts.min_element() > 0.0) {
            return Err(format!("its chromaticities ({text}) are no primaries: mend the attribute, or remove it"));
        }
        if self.same_as(&REC709) {
            return Ok(None);
        }
        let adapted = (BRADFORD * REC709.white()) / (BRADFORD * self.white());
        let adapt = BRADFORD.inverse() * DMat3::from_diagonal(adapted) * BRADFORD;
        let matrix = REC709.to_xyz().inverse() * adapt * self.to_xyz();
        let name = NAMED.iter().find(|(_, known)| self.same_as(known)).map_or(text, |(name, _)| (*name).to_string());
        Ok(Some((Conversion(matrix), name)))
    }
}

/// A linear map of colours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion(DMat3);

impl Conversion {
    /// The same, and everything times `by`.
    pub(super) fn scaled(self, by: f64) -> Self {
        Self(self.0 * by)
    }

    pub(super) fn apply(&self, rgb: Rgb) -> Rgb {
        Rgb((self.0 * DVec3::from(rgb.0.map(f64::from))).as_vec3().to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(name: &str) -> DMat3 {
        let (_, primaries) = NAMED.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}"));
        let (conversion, said) = primaries.to_rec709().unwrap().unwrap();
        assert_eq!(said, name);
        conversion.0
    }

    /// Rows as published: ACES AP1 and AP0 to Rec. 709 by Bradford (the Academy's CTL), Rec. 2020 by Recommendation BT.2087.
    #[test]
    fn matrices_are_those_that_are_published() {
        let known = [
            (
                "ACEScg (AP1)",
                [[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]],
            ),
            ("ACES AP0", [[2.52169, -1.13413, -0.38756], [-0.27648, 1.37272, -0.09624], [-0.01538, -0.15298, 1.16835]]),
            ("Rec. 2020", [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]),
        ];
        for (name, rows) in known {
            let found = matrix(name);
            for (r, row) in rows.iter().enumerate() {
                for (c, value) in row.iter().enumerate() {
                    assert!((found.col(c)[r] - value).abs() < 2e-4, "{name} {r} {c}: {} for {value}", found.col(c)[r]);
                }
            }
        }
    }

    #[test]
    fn white_stays_white_and_rec_709_is_left_alone() {
        for (name, _) in NAMED {
            let white = matrix(name) * DVec3::ONE;
            assert!((white - DVec3::ONE).abs().max_element() < 1e-9, "{name}: {white}");
        }
        assert!(REC709.to_rec709().unwrap().is_none());
        let rounded = Primaries([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.3291]]);
        assert!(rounded.to_rec709().unwrap().is_none());
        let on_a_line = Primaries([[0.6, 0.3], [0.4, 0.4], [0.2, 0.5], [0.3, 0.3]]);
        let outside = Primaries([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.1, 0.8]]);
        for wrong in [on_a_line, outside, Primaries([[0.0; 2]; 4]), Primaries([[f64::NAN; 2]; 4])] {
            assert!(wrong.to_rec709().unwrap_err().contains("no primaries"), "{wrong:?}");
        }
    }
}
