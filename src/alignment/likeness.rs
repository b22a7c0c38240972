//! How much each pixel has the colour that an object is said to have: by its chromaticity if it is coloured, else by all of CIELAB.
//!
//! What is transparent has no colour of its own, and a grey picture has none at all.

use super::picture::{BLACK, Picture, lab, linear};
use super::plane::Plane;
use crate::world::{Material, Object};

/// Chroma, CIELAB, above which a thing is known by its chromaticity. Chosen: with half of it a grey thing
/// that is said to be slightly warm is looked for by a colour that any lamp gives the whole table; with twice as much a
/// pale blue cup is looked for by its lightness, which changes with the light.
const COLOURED: f32 = 18.0;
/// Deviation of chromaticity (shares of red and blue in linear light) within one thing. Chosen: grey is at 0.33 and a
/// pure colour at 1, so that this is an eighth of what there is between them. With half of it a thing under a warm
/// lamp does not have its own colour, with twice as much a brown table looks half like an orange thing.
const CHROMATICITY: f32 = 0.09;
/// Deviations of lightness and of a, b of a thing without colour, CIELAB. Chosen: lightness may change by a shaded
/// face, a and b only by the lamp. With half of them a grey thing's own shaded side is another thing, with twice as
/// much every table is grey.
const GREY: [f32; 2] = [25.0, 8.0];

/// Returns how much each small pixel has the object's colour, `None` when that says nothing.
pub(super) fn likeness(picture: &Picture, object: &Object) -> Option<Plane> {
    if object.material == Material::Transparent || picture.is_grey {
        return None;
    }
    let [_, a, b] = lab(object.colour);
    if a.hypot(b) > COLOURED {
        // A coloured thing keeps its chromaticity in any light; its lightness it does not keep.
        let [r, g, bl] = object.colour.map(linear);
        let sum = r + g + bl + BLACK;
        let (cr, cb) = ((r + BLACK / 3.0) / sum, (bl + BLACK / 3.0) / sum);
        let mut plane = Plane::zeros(picture.small[0].width, picture.small[0].height);
        for (at, value) in plane.data.iter_mut().enumerate() {
            let dr = picture.chromaticity[0].data[at] - cr;
            let db = picture.chromaticity[1].data[at] - cb;
            *value = (-(dr * dr + db * db) / (2.0 * CHROMATICITY * CHROMATICITY)).exp();
        }
        return Some(plane);
    }
    let target = lab(object.colour);
    let mut plane = Plane::zeros(picture.small[0].width, picture.small[0].height);
    for (at, value) in plane.data.iter_mut().enumerate() {
        let d = [0, 1, 2].map(|c| picture.small[c].data[at] - target[c]);
        let far = (d[0] / GREY[0]).powi(2) + (d[1] / GREY[1]).powi(2) + (d[2] / GREY[1]).powi(2);
        *value = (-0.5 * far).exp();
    }
    Some(plane)
}
