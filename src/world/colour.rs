//! Words for colours, and the colours that words mean. Colours are sRGB, of 8 bits a channel.

use nalgebra::Vector2;

/// Colour words that `looks` may hold, with sRGB.
pub const COLOURS: &[(&str, [u8; 3])] = &[
    ("red", [192, 40, 40]),
    ("green", [40, 150, 70]),
    ("blue", [32, 80, 192]),
    ("yellow", [220, 190, 40]),
    ("orange", [225, 120, 30]),
    ("white", [235, 235, 235]),
    ("black", [35, 35, 35]),
    ("brown", [120, 80, 50]),
    ("grey", [128, 128, 128]),
];

/// Returns a word for a colour: of those that `looks` knows the nearest in hue, or in lightness where there is hardly
/// any. A thing in the shade keeps its hue.
pub fn colour_word(colour: [u8; 3]) -> &'static str {
    let (hue, strength) = hue(colour);
    let is_grey = strength < HARDLY;
    let far = |of: &[u8; 3]| -> f64 {
        let (other, other_strength) = self::hue(*of);
        if is_grey || other_strength < HARDLY {
            // The one is a colour and the other none.
            let apart = if is_grey == (other_strength < HARDLY) { 0.0 } else { 1e3 };
            return apart + (f64::from(of[1]) - f64::from(colour[1])).abs();
        }
        let light = |of: [u8; 3]| of.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        (other - hue).norm() + LIGHT * (light(*of) - light(colour)).abs()
    };
    let nearest = COLOURS.iter().min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)));
    nearest.map_or("", |(word, _)| word)
}

/// A colour with less than this between its strongest and its weakest channel, as a share of the strongest, is a grey.
/// Chosen: wood and cardboard have a half, painted things more, what is white by day has a tenth by lamplight.
const HARDLY: f64 = 0.25;
/// What a unit of lightness (of 255) weighs beside the distance of two hues (of 2 at most): brown is a dark orange.
const LIGHT: f64 = 0.001;

/// Returns the direction of a colour's hue, of length 1, and how strong it is: the spread of its channels over the largest.
fn hue([r, g, b]: [u8; 3]) -> (Vector2<f64>, f64) {
    let [r, g, b] = [r, g, b].map(f64::from);
    // Red, green and blue are a third of a turn apart.
    let hue = Vector2::new(r - 0.5 * (g + b), 3_f64.sqrt() / 2.0 * (g - b));
    let (least, most) = (r.min(g).min(b), r.max(g).max(b));
    let strength = if most > 0.0 { (most - least) / most } else { 0.0 };
    (hue.try_normalize(1e-9).unwrap_or_default(), strength)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_have_words() {
        assert_eq!(colour_word([180, 30, 40]), "red");
        assert_eq!(colour_word([30, 60, 150]), "blue");
        assert_eq!(colour_word([20, 20, 25]), "black");
        // In the shade: a blue can, a grey tray, a red cube.
        assert_eq!(colour_word([0x20, 0x31, 0x6d]), "blue");
        assert_eq!(colour_word([0x64, 0x65, 0x65]), "grey");
        assert_eq!(colour_word([0x6f, 0x2e, 0x28]), "red");
        assert_eq!(colour_word([110, 75, 45]), "brown");
    }
}
