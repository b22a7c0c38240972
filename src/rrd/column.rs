//! What a column of a chunk holds: a component of one of Rerun's archetypes, and its items.
//!
//! Every row has the same number of items of a column. Names of archetypes, components and kinds, and the types of
//! Arrow behind them, are those of Rerun 0.41.

use std::iter;
use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, FixedSizeListArray, Float32Array, Float64Array, ListArray, StringArray,
    UInt8Array,
};
use arrow_buffer::OffsetBuffer;
use arrow_schema::{ArrowError, DataType, Field};

/// A component: a field of an archetype.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Component {
    archetype: &'static str,
    field: &'static str,
    kind: &'static str,
}

impl Component {
    /// Numbers to be drawn over time.
    pub const SCALARS: Self = Self::of("Scalars", "scalars", "Scalar");
    /// What the lines of [`Self::SCALARS`] are called.
    pub const LINE_NAMES: Self = Self::of("SeriesLines", "names", "Name");
    /// How their points are joined: [`STEP_AFTER`].
    pub const LINE_MODES: Self = Self::of("SeriesLines", "interpolation_mode", "InterpolationMode");
    /// Where a thing is, m.
    pub const TRANSLATION: Self = Self::of("Transform3D", "translation", "Translation3D");
    /// How it is turned: x, y, z, w.
    pub const QUATERNION: Self = Self::of("Transform3D", "quaternion", "RotationQuat");
    /// How long the axes are that show it, m.
    pub const AXIS_LENGTH: Self = Self::of("TransformAxes3D", "axis_length", "AxisLength");
    /// Whether its name stands beside them.
    pub const SHOW_FRAME: Self = Self::of("TransformAxes3D", "show_frame", "ShowLabels");
    /// Points that are joined.
    pub const STRIPS: Self = Self::of("LineStrips3D", "strips", "LineStrip3D");
    /// Which way the axes of a space point: [`Z_UP`].
    pub const VIEW: Self = Self::of("ViewCoordinates", "xyz", "ViewCoordinates");
    /// A picture as a file.
    pub const IMAGE: Self = Self::of("EncodedImage", "blob", "Blob");
    /// What kind of file it is.
    pub const IMAGE_TYPE: Self = Self::of("EncodedImage", "media_type", "MediaType");
    /// A line of a log.
    pub const LOG: Self = Self::of("TextLog", "text", "Text");
    /// How much it matters: `INFO`, `WARN`.
    pub const LOG_LEVEL: Self = Self::of("TextLog", "level", "TextLogLevel");
    /// A page to read.
    pub const DOCUMENT: Self = Self::of("TextDocument", "text", "Text");
    /// What kind of text it is.
    pub const DOCUMENT_TYPE: Self = Self::of("TextDocument", "media_type", "MediaType");
    /// What the recording is called.
    pub const RECORDING_NAME: Self = Self::of("RecordingInfo", "name", "Name");

    const fn of(archetype: &'static str, field: &'static str, kind: &'static str) -> Self {
        Self { archetype, field, kind }
    }

    /// Returns its name: `Scalars:scalars`.
    pub fn name(&self) -> String {
        format!("{}:{}", self.archetype, self.field)
    }

    /// Returns what a column says of itself.
    pub(super) fn metadata(&self) -> [(String, String); 3] {
        [
            ("rerun:archetype".to_owned(), format!("rerun.archetypes.{}", self.archetype)),
            ("rerun:component".to_owned(), self.name()),
            ("rerun:component_type".to_owned(), format!("rerun.components.{}", self.kind)),
        ]
    }
}

/// A line that keeps its value until the next point: `StepAfter`.
pub const STEP_AFTER: u8 = 2;
/// Right-handed, z up: right, forward, up.
pub const Z_UP: [u8; 3] = [3, 5, 1];

/// The items of a column, row after row.
#[derive(Debug, Clone, PartialEq)]
pub enum Items {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Lengths, m.
    Lengths(Vec<f32>),
    /// Points and translations, m.
    Points(Vec<[f32; 3]>),
    /// Turns: x, y, z, w.
    Turns(Vec<[f32; 4]>),
    /// Points that are joined, an item each.
    Strips(Vec<Vec<[f32; 3]>>),
    /// Texts.
    Texts(Vec<String>),
    /// Files.
    Files(Vec<Vec<u8>>),
    /// Numbers that stand for names.
    Codes(Vec<u8>),
    /// Directions of axes.
    Axes(Vec<[u8; 3]>),
    /// Yes and no.
    Flags(Vec<bool>),
}

impl Items {
    /// One text.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Texts(vec![text.into()])
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Numbers(items) => items.len(),
            Self::Lengths(items) => items.len(),
            Self::Points(items) => items.len(),
            Self::Turns(items) => items.len(),
            Self::Strips(items) => items.len(),
            Self::Texts(items) => items.len(),
            Self::Files(items) => items.len(),
            Self::Codes(items) => items.len(),
            Self::Axes(items) => items.len(),
            Self::Flags(items) => items.len(),
        }
    }

    /// How many bytes of different length there are.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Texts(items) => items.iter().map(String::len).sum(),
            Self::Files(items) => items.iter().map(Vec::len).sum(),
            _ => 0,
        }
    }

    /// Returns the items as an array, as many in each of `rows`.
    pub(super) fn rows(self, rows: usize) -> Result<ListArray, ArrowError> {
        let width = self.len() / rows.max(1);
        listed(iter::repeat_n(width, rows), self.array()?, true)
    }

    fn array(self) -> Result<ArrayRef, ArrowError> {
        Ok(match self {
            Self::Numbers(items) => Arc::new(Float64Array::from(items)),
            Self::Lengths(items) => Arc::new(Float32Array::from(items)),
            Self::Points(items) => Arc::new(points(items)?),
            Self::Turns(items) => {
                let flat = Float32Array::from(items.into_flattened());
                Arc::new(grouped(4, Arc::new(flat))?)
            }
            Self::Strips(items) => {
                let lengths: Vec<usize> = items.iter().map(Vec::len).collect();
                Arc::new(listed(lengths, Arc::new(points(items.concat())?), false)?)
            }
            Self::Texts(items) => Arc::new(StringArray::from(items)),
            Self::Files(items) => {
                let lengths: Vec<usize> = items.iter().map(Vec::len).collect();
                Arc::new(listed(lengths, Arc::new(UInt8Array::from(items.concat())), false)?)
            }
            Self::Codes(items) => Arc::new(UInt8Array::from(items)),
            Self::Axes(items) => {
                Arc::new(grouped(3, Arc::new(UInt8Array::from(items.into_flattened())))?)
            }
            Self::Flags(items) => Arc::new(BooleanArray::from(items)),
        })
    }
}

fn points(items: Vec<[f32; 3]>) -> Result<FixedSizeListArray, ArrowError> {
    grouped(3, Arc::new(Float32Array::from(items.into_flattened())))
}

/// Lists of these lengths, of which the items may be absent or not.
fn listed(
    lengths: impl IntoIterator<Item = usize>,
    values: ArrayRef,
    may_be_absent: bool,
) -> Result<ListArray, ArrowError> {
    let item = item(values.data_type(), may_be_absent);
    ListArray::try_new(item, OffsetBuffer::from_lengths(lengths), values, None)
}

/// Lists of `n` items each.
fn grouped(n: i32, values: ArrayRef) -> Result<FixedSizeListArray, ArrowError> {
    FixedSizeListArray::try_new(item(values.data_type(), false), n, values, None)
}

fn item(kind: &DataType, may_be_absent: bool) -> Arc<Field> {
    Arc::new(Field::new("item", kind.clone(), may_be_absent))
}
