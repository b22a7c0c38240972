//! A network in an ONNX file, run here on the processor.
//!
//! What is understood: one input `[1, 3, H, W]` of floats, the picture with red, green and blue from 0 to 1; if the network is told
//! where to look, one more of four numbers (a box: left, top, right, bottom) or of two (a point), in pixels of the picture as it is
//! given in; one output `[1, 1, H, W]` of floats: logits, or probabilities if all of it is from 0 to 1. Names are the file's own, and sizes
//! that it fixes are kept to: the picture is stretched to them and the mask back. A network that is not told where to look is
//! run once, and [`super::pieces`] of its mask answer. Everything else is refused with what was expected.
//!
//! The runtime is `rten`.

use std::path::{Path, PathBuf};

use image::imageops::{self, FilterType};
use image::{GrayImage, Luma, RgbImage};
use rten::{DataType, Dimension, Model, NodeId, Value, ValueOrView, ValueType};

use super::pieces::{self, at_place};
use super::{Error, Mask, Unfit, Where};
use crate::files;

/// Bytes of a file that are read: protobuf, in which these files are written, has no longer messages.
const LARGEST: u64 = 2 << 30;

/// A network that makes masks.
pub struct Network {
    path: PathBuf,
    model: Model,
    picture: NodeId,
    /// The picture's width and height, where the file fixes them.
    size: (Option<usize>, Option<usize>),
    place: Option<Place>,
    output: NodeId,
}

/// The input that is told where to look.
struct Place {
    id: NodeId,
    name: String,
    shape: Vec<usize>,
    is_box: bool,
}

/// What the network says of each pixel of the picture: how probable it is the thing, 0 to 1.
struct Map {
    width: u32,
    height: u32,
    data: Vec<f32>,
}

impl Network {
    /// Reads a network and looks at what goes in and comes out.
    ///
    /// # Errors
    ///
    /// [`Error::Network`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::read(path).map_err(|unfit| Error::Network { path: path.to_path_buf(), unfit })
    }

    fn read(path: &Path) -> Result<Self, Unfit> {
        let bytes =
            files::read::bytes(path, LARGEST).map_err(|why| Unfit::File(why.to_string()))?;
        let model = Model::load(bytes).map_err(|why| Unfit::Load(why.to_string()))?;
        let inputs = model.input_ids().to_vec();
        let told = |ids: &[NodeId]| {
            let each: Vec<String> = ids.iter().map(|id| described(&model, *id)).collect();
            if each.is_empty() { "none".to_owned() } else { each.join(", ") }
        };
        let pictures: Vec<NodeId> =
            inputs.iter().copied().filter(|id| is_picture(&model, *id)).collect();
        let [picture] = pictures[..] else { return Err(Unfit::Inputs(told(&inputs))) };
        let others: Vec<NodeId> = inputs.iter().copied().filter(|id| *id != picture).collect();
        let place = match others[..] {
            [] => None,
            [id] => Some(place(&model, id).ok_or_else(|| Unfit::Prompt(told(&others)))?),
            _ => return Err(Unfit::Prompt(told(&others))),
        };
        let outputs = model.output_ids().to_vec();
        let [output] = outputs[..] else { return Err(Unfit::Outputs(told(&outputs))) };
        // What the file does not say of its output is looked at when it comes.
        if shape(&model, output).is_some_and(|shape| !is_map(&shape)) {
            return Err(Unfit::Outputs(told(&outputs)));
        }
        let fixed = shape(&model, picture).unwrap_or_default();
        let size = (fixed.get(3).copied().flatten(), fixed.get(2).copied().flatten());
        Ok(Self { path: path.to_path_buf(), model, picture, size, place, output })
    }

    /// Asks for masks.
    ///
    /// # Errors
    ///
    /// [`Error::Network`].
    pub(super) fn ask(&self, picture: &RgbImage, places: &[Where]) -> Result<Vec<Mask>, Error> {
        self.answered(picture, places)
            .map_err(|unfit| Error::Network { path: self.path.clone(), unfit })
    }

    fn answered(&self, picture: &RgbImage, places: &[Where]) -> Result<Vec<Mask>, Unfit> {
        let Some(place) = &self.place else {
            let (mask, map) = self.run(picture, None)?;
            let scored = |of, mask| Mask { of, score: map.score(&mask), mask };
            if places.is_empty() {
                return Ok(pieces::all(&mask).into_iter().map(|one| scored(None, one)).collect());
            }
            let each = places.iter().enumerate();
            return Ok(each
                .filter_map(|(k, at)| Some(scored(Some(k), at_place(&mask, at)?)))
                .collect());
        };
        if places.is_empty() {
            return Err(if place.is_box {
                Unfit::NeedsBox(place.name.clone())
            } else {
                Unfit::NeedsPoint(place.name.clone())
            });
        }
        let mut masks = Vec::with_capacity(places.len());
        for (k, at) in places.iter().enumerate() {
            let at = match (at, place.is_box) {
                (Where::Box(bounds), true) => bounds.to_vec(),
                // The middle of a box is on the thing, as a rule.
                (Where::Box([x0, y0, x1, y1]), false) => vec![0.5 * (x0 + x1), 0.5 * (y0 + y1)],
                (Where::Point(at), false) => at.to_vec(),
                (Where::Point(_), true) => return Err(Unfit::NeedsBox(place.name.clone())),
            };
            let (mask, map) = self.run(picture, Some((place, &at)))?;
            let is_something = mask.pixels().any(|pixel| pixel.0[0] > 0);
            if is_something {
                masks.push(Mask { of: Some(k), score: map.score(&mask), mask });
            }
        }
        Ok(masks)
    }

    /// Runs the network; `at` is a place in pixels of the picture.
    fn run(
        &self,
        picture: &RgbImage,
        at: Option<(&Place, &[f64])>,
    ) -> Result<(GrayImage, Map), Unfit> {
        let (w, h) = picture.dimensions();
        let (width, height) =
            (self.size.0.unwrap_or(w as usize), self.size.1.unwrap_or(h as usize));
        let failed = |why: &dyn ToString| Unfit::Run { width, height, why: why.to_string() };
        let mut inputs: Vec<(NodeId, ValueOrView<'_>)> = Vec::new();
        let data = planes(picture, width as u32, height as u32);
        let value = Value::from_shape([1, 3, height, width], data).map_err(|why| failed(&why))?;
        inputs.push((self.picture, value.into()));
        if let Some((place, at)) = at {
            // Middles of pixels of one grid are not middles of the other's.
            let scale = [width as f64 / f64::from(w), height as f64 / f64::from(h)];
            let data: Vec<f32> = at
                .iter()
                .enumerate()
                .map(|(k, value)| ((value + 0.5) * scale[k % 2] - 0.5) as f32)
                .collect();
            let value = Value::from_shape(&place.shape[..], data).map_err(|why| failed(&why))?;
            inputs.push((place.id, value.into()));
        }
        let came = self.model.run(inputs, &[self.output], None).map_err(|why| failed(&why))?;
        let value = came.into_iter().next().ok_or_else(|| Unfit::Outputs("none".into()))?;
        let wrong = Unfit::Outputs(format!("{:?}", value.dtype()));
        let (shape, data) = value.into_shape_vec::<f32, 4>().map_err(|_| wrong)?;
        let [1, 1, rows, columns] = shape else {
            return Err(Unfit::Outputs(format!("{shape:?}")));
        };
        if rows == 0 || columns == 0 {
            return Err(Unfit::Outputs(format!("{shape:?}")));
        }
        let map = Map::of(data, columns as u32, rows as u32, (w, h)).ok_or(Unfit::NotFinite)?;
        Ok((map.mask(), map))
    }
}

impl Map {
    /// Reads what came out, stretched to the picture's size; `None` if it holds what is no number.
    fn of(
        mut data: Vec<f32>,
        columns: u32,
        rows: u32,
        (width, height): (u32, u32),
    ) -> Option<Self> {
        if !data.iter().all(|value| value.is_finite()) {
            return None;
        }
        if !data.iter().all(|value| (0.0..=1.0).contains(value)) {
            for value in &mut data {
                *value = 1.0 / (1.0 + (-*value).exp());
            }
        }
        if (columns, rows) == (width, height) {
            return Some(Self { width, height, data });
        }
        let map = image::ImageBuffer::<Luma<f32>, Vec<f32>>::from_raw(columns, rows, data)?;
        let data = imageops::resize(&map, width, height, FilterType::Triangle).into_raw();
        Some(Self { width, height, data })
    }

    /// Where the thing is more probable than not.
    fn mask(&self) -> GrayImage {
        GrayImage::from_fn(self.width, self.height, |x, y| {
            let value = self.data[y as usize * self.width as usize + x as usize];
            Luma([if value > 0.5 { 255 } else { 0 }])
        })
    }

    /// The mean of what is said over a mask; 0 of an empty one.
    fn score(&self, mask: &GrayImage) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for (pixel, value) in mask.pixels().zip(&self.data) {
            if pixel.0[0] > 0 {
                sum += f64::from(*value);
                n += 1.0;
            }
        }
        sum / f64::max(n, 1.0)
    }
}

/// The picture as red, green and blue planes from 0 to 1.
fn planes(picture: &RgbImage, width: u32, height: u32) -> Vec<f32> {
    let stretched;
    let picture = if picture.dimensions() == (width, height) {
        picture
    } else {
        stretched = imageops::resize(picture, width, height, FilterType::Triangle);
        &stretched
    };
    (0..3).flat_map(|c| picture.pixels().map(move |pixel| f32::from(pixel.0[c]) / 255.0)).collect()
}

/// The size that the file says of a value, where it says any: `None` for sides that it leaves open.
fn shape(model: &Model, id: NodeId) -> Option<Vec<Option<usize>>> {
    let of = |side: &Dimension| match side {
        Dimension::Fixed(side) => Some(*side),
        Dimension::Symbolic(_) => None,
    };
    Some(model.node_info(id)?.shape()?.iter().map(of).collect())
}

/// Whether a value holds floats, or does not say.
fn is_float(model: &Model, id: NodeId) -> bool {
    let said = model.node_info(id).and_then(|info| info.dtype());
    said.is_none_or(|dtype| dtype == ValueType::Tensor(DataType::Float))
}

/// Whether this side may be so long.
fn may_be(side: Option<usize>, long: usize) -> bool {
    side.is_none_or(|side| side == long)
}

fn is_picture(model: &Model, id: NodeId) -> bool {
    let is_one =
        |shape: Vec<Option<usize>>| shape.len() == 4 && may_be(shape[0], 1) && shape[1] == Some(3);
    is_float(model, id) && shape(model, id).is_some_and(is_one)
}

fn is_map(shape: &[Option<usize>]) -> bool {
    shape.len() == 4 && may_be(shape[0], 1) && may_be(shape[1], 1)
}

/// An input for a box or a point: four or two numbers, with sides of 1 before them.
fn place(model: &Model, id: NodeId) -> Option<Place> {
    let shape = shape(model, id)?;
    let (last, before) = shape.split_last()?;
    let count = (*last).filter(|count| [2, 4].contains(count))?;
    if !is_float(model, id) || before.len() > 2 || !before.iter().all(|side| may_be(*side, 1)) {
        return None;
    }
    let name = model.node_info(id)?.name().unwrap_or_default().to_owned();
    let shape = before.iter().map(|_| 1).chain([count]).collect();
    Some(Place { id, name, shape, is_box: count == 4 })
}

/// A value in words: `image [1, 3, H, W] of floats`.
fn described(model: &Model, id: NodeId) -> String {
    let info = model.node_info(id);
    let name = info.as_ref().and_then(|info| info.name()).unwrap_or("?").to_owned();
    let sides = info.as_ref().and_then(|info| info.shape()).map_or_else(String::new, |sides| {
        let side = |side: &Dimension| match side {
            Dimension::Fixed(side) => side.to_string(),
            Dimension::Symbolic(name) => name.clone(),
        };
        format!(" [{}]", sides.iter().map(side).collect::<Vec<_>>().join(", "))
    });
    let kind = info.and_then(|info| info.dtype()).map_or_else(String::new, |dtype| match dtype {
        ValueType::Tensor(DataType::Float) => String::new(),
        other => format!(" {other:?}"),
    });
    format!("`{name}`{sides}{kind}")
}
