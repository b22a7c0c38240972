//! `--masks FILE.onnx` (feature `onnx`): networks whose files are written here, byte by byte: one that looks for blue by a convolution
//! of 1 x 1, one that is told where to look, and files that are of no use.

use image::{GrayImage, Rgb, RgbImage};

use crate::program::Scratch;

/// A field of a protobuf message: bytes with their length before them.
fn bytes(field: u64, value: &[u8]) -> Vec<u8> {
    let mut out = varint(field << 3 | 2);
    out.extend(varint(value.len() as u64));
    out.extend_from_slice(value);
    out
}

fn text(field: u64, value: &str) -> Vec<u8> {
    bytes(field, value.as_bytes())
}

fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

fn varint(mut value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    while value >= 0x80 {
        out.push((value & 0x7f) as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
    out
}

/// `ValueInfoProto`: a tensor of floats, or of another kind of element; a side of 0 is left open.
fn value(name: &str, kind: u64, shape: &[u64]) -> Vec<u8> {
    let side = |side: &u64| bytes(1, &if *side == 0 { text(2, "any") } else { number(1, *side) });
    let sides: Vec<u8> = shape.iter().flat_map(side).collect();
    let tensor = [number(1, kind), bytes(2, &sides)].concat();
    [text(1, name), bytes(2, &bytes(1, &tensor))].concat()
}

/// `TensorProto` of floats.
fn constant(name: &str, shape: &[u64], data: &[f32]) -> Vec<u8> {
    let raw: Vec<u8> = data.iter().flat_map(|value| value.to_le_bytes()).collect();
    let dims: Vec<u8> = shape.iter().flat_map(|side| number(1, *side)).collect();
    [dims, number(2, 1), text(8, name), bytes(9, &raw)].concat()
}

fn node(kind: &str, inputs: &[&str], output: &str) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|name| text(1, name)).collect();
    [inputs, text(2, output), text(4, kind)].concat()
}

/// A convolution as exporters write it, with all that is the default.
fn convolution(inputs: &[&str], output: &str) -> Vec<u8> {
    let attribute = |name: &str, values: &[u64]| {
        let values: Vec<u8> = values.iter().flat_map(|value| number(8, *value)).collect();
        bytes(5, &[text(1, name), values, number(20, 7)].concat())
    };
    let all = [
        attribute("dilations", &[1, 1]),
        attribute("kernel_shape", &[1, 1]),
        attribute("pads", &[0, 0, 0, 0]),
        attribute("strides", &[1, 1]),
    ];
    [node("Conv", inputs, output), all.concat()].concat()
}

struct Graph {
    nodes: Vec<Vec<u8>>,
    constants: Vec<Vec<u8>>,
    inputs: Vec<Vec<u8>>,
    outputs: Vec<Vec<u8>>,
}

impl Graph {
    /// `ModelProto`, of the operators of version 13.
    fn file(&self) -> Vec<u8> {
        let all = |field: u64, each: &[Vec<u8>]| -> Vec<u8> {
            each.iter().flat_map(|one| bytes(field, one)).collect()
        };
        let graph = [
            all(1, &self.nodes),
            text(2, "blue"),
            all(5, &self.constants),
            all(11, &self.inputs),
            all(12, &self.outputs),
        ];
        let version = [text(1, ""), number(2, 13)].concat();
        [number(1, 7), bytes(8, &version), bytes(7, &graph.concat())].concat()
    }
}

const FLOAT: u64 = 1;

/// Blue less red, less 40 of 255, as logits.
fn blue(side: [u64; 2]) -> Graph {
    Graph {
        nodes: vec![convolution(&["picture", "weights", "less"], "logits")],
        constants: vec![
            constant("weights", &[1, 3, 1, 1], &[-30.0, 0.0, 30.0]),
            constant("less", &[1], &[-30.0 * 40.0 / 255.0]),
        ],
        inputs: vec![value("picture", FLOAT, &[1, 3, side[0], side[1]])],
        outputs: vec![value("logits", FLOAT, &[1, 1, side[0], side[1]])],
    }
}

/// The same, and nothing unless the box begins right of 50 px: it is told of the box in its own pixels.
fn told() -> Graph {
    let mut graph = blue([0, 0]);
    graph.nodes = vec![
        convolution(&["picture", "weights", "less"], "blueness"),
        node("Mul", &["box", "left"], "lefts"),
        node("ReduceSum", &["lefts"], "from"),
        node("Sub", &["from", "fifty"], "beyond"),
        node("Clip", &["beyond", "low", "high"], "shift"),
        node("Add", &["blueness", "shift"], "logits"),
    ];
    graph.constants.extend([
        constant("left", &[1, 4], &[1.0, 0.0, 0.0, 0.0]),
        constant("fifty", &[1], &[50.0]),
        constant("low", &[], &[-1000.0]),
        constant("high", &[], &[0.0]),
    ]);
    graph.inputs.push(value("box", FLOAT, &[1, 4]));
    graph
}

fn inside(x: u32, y: u32) -> bool {
    (f64::from(x) - 150.0).hypot(f64::from(y) - 110.0) < 45.0
}

fn other(x: u32, y: u32) -> bool {
    (240..300).contains(&x) && (150..210).contains(&y)
}

/// A blue disc and a blue square on a table with a slope of light.
fn picture() -> RgbImage {
    RgbImage::from_fn(320, 240, |x, y| {
        let light = 150 + (x / 10) as u8;
        Rgb(if inside(x, y) || other(x, y) { [60, 90, 160] } else { [light, light, light - 10] })
    })
}

fn overlap(mask: &GrayImage, is_in: fn(u32, u32) -> bool) -> f64 {
    let (mut both, mut either) = (0.0, 0.0);
    for (x, y, pixel) in mask.enumerate_pixels() {
        let (a, b) = (pixel.0[0] > 0, is_in(x, y));
        both += f64::from(u8::from(a && b));
        either += f64::from(u8::from(a || b));
    }
    both / f64::max(either, 1.0)
}

#[test]
fn a_network_cuts_out_what_it_was_made_for() {
    let scratch = Scratch::new("onnx-blue");
    picture().save(scratch.path("photo.png")).unwrap();
    scratch.file("any.onnx", blue([0, 0]).file());
    // A side that is fixed: the picture is stretched to it, and the mask back.
    scratch.file("fixed.onnx", blue([120, 160]).file());
    scratch.file("told.onnx", told().file());
    for file in ["any.onnx", "fixed.onnx", "told.onnx"] {
        let args = ["camera", "segment", "photo.png", "--json", "--out", file, "--masks"];
        let args = [&args[..], &[file, "--box", "90,50,210,170"]].concat();
        let answer = scratch.trueup(&args).document("camera-segment");
        assert_eq!(answer["masks"]["came"], 1, "{file}: {answer:#}");
        // The one that is told where to look gives both blue things, which is not the outline of one.
        let is_good = answer["masks"]["agreement"].as_f64().unwrap() > 0.8;
        assert!(is_good || file == "told.onnx", "{file}: {answer:#}");
        let mask = image::open(scratch.path(&format!("{file}/mask-1.png"))).unwrap().to_luma8();
        assert!(overlap(&mask, inside) > 0.95, "{file}: {}", overlap(&mask, inside));
    }
    // With nothing said a network that is not told where to look gives every piece.
    let args = ["camera", "segment", "photo.png", "--json", "--masks", "any.onnx"];
    let answer = scratch.trueup(&args).json();
    assert_eq!(answer["masks"]["came"], 2, "{answer:#}");
    assert_eq!(answer["segments"].as_array().unwrap().len(), 2, "{answer:#}");
    // The box is told in the network's pixels: one that begins at the left edge is answered with nothing.
    let args = ["camera", "segment", "photo.png", "--json", "--masks", "told.onnx"];
    let said = scratch.trueup(&[&args[..], &["--box", "20,50,210,170"]].concat()).json();
    assert_eq!(said["masks"]["came"], 0, "{said:#}");
    let said = scratch.trueup(&args);
    assert_eq!(said.error("code"), "masks::network", "{said:?}");
    assert!(said.error("message").contains("`box` is a box, and none was said"), "{said:?}");
}

#[test]
fn what_is_no_such_network_is_refused_with_what_was_expected() {
    let scratch = Scratch::new("onnx-refused");
    picture().save(scratch.path("photo.png")).unwrap();
    let change = |change: &dyn Fn(&mut Graph)| {
        let mut graph = blue([0, 0]);
        change(&mut graph);
        graph.file()
    };
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("no protobuf", b"\x89PNG\r\n not a network".to_vec(), "cannot be loaded"),
        ("nothing", Vec::new(), "cannot be loaded"),
        (
            "grey",
            change(&|g| g.inputs[0] = value("picture", FLOAT, &[1, 1, 0, 0])),
            "expected one input [1, 3, H, W] of floats for the picture, and it has `picture` [1, 1, any, any]",
        ),
        ("bytes", change(&|g| g.inputs[0] = value("picture", 2, &[1, 3, 0, 0])), "UInt8"),
        (
            "three numbers",
            change(&|g| g.inputs.push(value("where", FLOAT, &[1, 3]))),
            "at most [1, 4] for a box or [1, 2] for a point",
        ),
        (
            "two classes",
            change(&|g| {
                g.constants[0] = constant("weights", &[2, 3, 1, 1], &[1.0; 6]);
                g.constants[1] = constant("less", &[2], &[0.0; 2]);
                g.outputs[0] = value("logits", FLOAT, &[1, 2, 0, 0]);
            }),
            "expected one output [1, 1, H, W] of floats, and it has `logits` [1, 2",
        ),
        (
            "two outputs",
            change(&|g| {
                g.nodes.push(node("Identity", &["logits"], "scores"));
                g.outputs.push(value("scores", FLOAT, &[1, 1, 0, 0]));
            }),
            "expected one output",
        ),
        (
            "not finite",
            change(&|g| g.constants[1] = constant("less", &[1], &[f32::NAN])),
            "numbers that are not finite",
        ),
        (
            "another operator",
            change(&|g| g.nodes[0] = node("NoSuchThing", &["picture"], "logits")),
            "cannot be loaded",
        ),
        (
            "fixed wrongly",
            change(&|g| g.constants[0] = constant("weights", &[1, 4, 1, 1], &[0.0; 4])),
            "it cannot be",
        ),
    ];
    for (name, file, word) in cases {
        scratch.file("model.onnx", file);
        let said = scratch.trueup(&[
            "camera",
            "segment",
            "photo.png",
            "--json",
            "--box",
            "90,50,210,170",
            "--masks",
            "model.onnx",
        ]);
        assert_eq!(said.error("code"), "masks::network", "{name}: {said:?}");
        assert!(said.error("message").contains(word), "{name}: {}", said.error("message"));
    }
    let args = ["camera", "segment", "photo.png", "--json", "--masks", "gone.onnx"];
    assert_eq!(scratch.trueup(&args).error("code"), "masks::network");
}
