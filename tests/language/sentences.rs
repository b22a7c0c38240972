//! Tables of sentences and the calls they mean. How a meaning that is no call is answered is asked in `meanings`.

use std::f64::consts::FRAC_PI_2;

use trueup::language::ast::Call;
use trueup::language::sentence::{Knowledge, Meaning, Spot, things, understand};
use trueup::language::{Library, Source};

use super::meanings::{nothing, nowhere};

/// A table as of an evening: two cups that hold water, a jar, a tray and a die.
const EVENING: &str = "scene evening {
    table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)
    jar: Container = cuboid(6 cm, 6 cm, 14 cm) { wall 3 mm holds 250 mL filled 150 mL looks \"transparent jar\" }
    red: Container = cylinder(radius 4 cm, height 9 cm) { looks \"red cup\" }
    blue: Container = cylinder(radius 4 cm, height 9 cm) { looks \"blue cup\" }
    die: Graspable = cuboid(3 cm, 3 cm, 3 cm) { looks \"white die\" }
    tray: Surface = cuboid(20 cm, 16 cm, 2 cm) { looks \"grey tray\" }
}";

/// What a person would make of each: the call, a question, or why not.
const SAID: &[(&str, &str)] = &[
    // One wish.
    ("pick up the die", "pick(die)"),
    ("Grab the white die, please.", "pick(die)"),
    ("take the jar", "pick(jar)"),
    ("set the die down", "place(die)"),
    ("move the die to the tray", "put(die, at: tray)"),
    ("stack the die on top of the tray", "stack(die, tray)"),
    ("bring the red cup to the table", "put(red, at: table)"),
    ("pour the jar into the red cup", "pour(jar, red)"),
    ("pour water from the jar to the blue cup", "pour(jar, blue)"),
    // Amounts.
    ("pour 50 mL of water from the jar into the red cup", "pour(jar, red, amount: 50 mL)"),
    ("pour 50 ml from the jar into the red cup", "pour(jar, red, amount: 50 mL)"),
    ("pour 50 ml into the red cup", "? which source: transparent jar or blue cup?"),
    ("pour 0.1 litres of the jar into the blue cup", "pour(jar, blue, amount: 0.1 L)"),
    ("pour half of the jar into the red cup", "pour(jar, red, amount: filled(jar) / 2)"),
    ("pour half the jar into the red cup", "pour(jar, red, amount: filled(jar) / 2)"),
    (
        "pour a third of the water in the jar into the red cup",
        "pour(jar, red, amount: filled(jar) / 3)",
    ),
    ("pour two thirds of the jar into the red cup", "pour(jar, red, amount: 2 * filled(jar) / 3)"),
    (
        "pour three quarters of the jar into the red cup",
        "pour(jar, red, amount: 3 * filled(jar) / 4)",
    ),
    ("pour 20 % of the jar into the blue cup", "pour(jar, blue, amount: 0.2 * filled(jar))"),
    (
        "pour all of the water from the jar into the blue cup",
        "pour(jar, blue, amount: filled(jar))",
    ),
    ("pour 50 cm of the jar into the red cup", "! `amount` is a volume, and `50 cm` is not"),
    ("pour some of the jar into the red cup", "! `some` is no number for `amount`"),
    // Empty and fill.
    ("empty the jar into the blue cup", "pour(jar, blue)"),
    ("empty the jar", "? which target: red cup or blue cup?"),
    ("fill the red cup from the jar", "pour(jar, red)"),
    ("fill the blue cup with water from the jar", "pour(jar, blue)"),
    ("fill the red cup", "? which source: transparent jar or blue cup?"),
    (
        "fill the red cup halfway from the jar",
        "pour(jar, red, amount: capacity(red) / 2 - filled(red))",
    ),
    (
        "fill the red cup half full with water from the jar",
        "pour(jar, red, amount: capacity(red) / 2 - filled(red))",
    ),
    (
        "fill a third of the blue cup from the jar",
        "pour(jar, blue, amount: capacity(blue) / 3 - filled(blue))",
    ),
    ("fill the cup to 80 % from the jar", "? which cup: red cup or blue cup?"),
    ("fill the red mug", "! there is no red mug here"),
    (
        "fill the red cup to the brim from the jar",
        "pour(jar, red, amount: capacity(red) - filled(red))",
    ),
    ("fill the red cup to 100 mL from the jar", "pour(jar, red, amount: 100 mL - filled(red))"),
    ("fill the red cup up to 0.1 l from the jar", "pour(jar, red, amount: 0.1 L - filled(red))"),
    (
        "fill the red cup to 10 cm from the jar",
        "! \"to 10 cm\" is not understood behind \"red cup\"",
    ),
    ("fill the red cup with 60 mL of water from the jar", "pour(jar, red, amount: 60 mL)"),
    ("pour 50ml of water in the red cup", "? which source: transparent jar or blue cup?"),
    ("pour 50ml of water from the jar in the red cup", "pour(jar, red, amount: 50 mL)"),
    ("pour the jar in the red cup", "pour(jar, red)"),
    ("pour 50 ml of lava", "! \"50 ml of lava\" is an amount, and a thing is meant"),
    ("pick up the die with care", "! \"with care\" is not understood behind \"die\""),
    // No word is passed over.
    ("put the jar back", "! \"back\" is not understood behind \"jar\""),
    ("put the jar back where it was", "! \"back where it was\" is not understood behind \"jar\""),
    ("pick up the die slowly", "! \"slowly\" is not understood behind \"die\""),
    (
        "pour the jar next to the red cup",
        "! \"next to the red cup\" may tell which is meant, and does not say what `target` is",
    ),
    ("pour one cup into the jar", "! \"one cup\" may be a thing or an amount"),
    (
        "pour the jar into the red cup and put it down",
        "! `place(jar)` needs something in the hand, and after `pour(jar, red)` nothing is in it",
    ),
    ("pour the jar into the red cup and put it back", "! \"back\" is not understood behind \"it\""),
    // One after the other, and what "it" is.
    ("pick up the die, then put it down", "pick(die) then place(die)"),
    ("pick up the die and put it down", "pick(die) then place(die)"),
    ("First grab the jar and then set it down.", "pick(jar) then place(jar)"),
    ("pour the jar into the red cup, then pick up the die", "pour(jar, red) then pick(die)"),
    (
        "pour half of the jar into the red cup and then pour it into the blue cup",
        "pour(jar, red, amount: filled(jar) / 2) then pour(jar, blue)",
    ),
    (
        "move the die to the tray and pick up the jar and put it down",
        "put(die, at: tray) then pick(jar) then place(jar)",
    ),
    ("pick up the cup, then put it down", "? which cup: red cup or blue cup?"),
    ("pick up the die, then fly to the moon", "-"),
    ("pick up the die and the jar", "! there is no die and jar here"),
    // Places told by others.
    ("move the die to the left of the red cup", "put(die, at: left_of(red))"),
    ("bring the die next to the jar", "put(die, at: next_to(jar))"),
    ("move the die in front of the cup", "? in front of which cup: red cup or blue cup?"),
    ("move the jar between the red cup and the blue cup", "put(jar, at: between(red, blue))"),
    ("move the jar between the red cup", "! what is between is between two things"),
    ("move the die behind the kettle", "! there is no kettle here"),
    // Several things.
    ("swap the red cup and the blue cup", "swap(red, blue)"),
    ("swap the cups", "swap(red, blue)"),
    ("exchange the two cups please", "swap(red, blue)"),
    ("swap the dice", "! only one die is here: white die"),
    ("swap the vessels", "! more than two fit: transparent jar, red cup or blue cup"),
    ("pick up the vessel", "? which vessel: transparent jar, red cup or blue cup?"),
    ("clear the tray", "clear(tray)"),
    ("clear the table", "! `at` of `clear` cannot be `table`"),
    ("pick up the die and put it on the tray", "pick(die) then place(die, at: tray)"),
    // What takes a thing itself is not told to take it first.
    ("take the jar and pour it into the red cup", "pour(jar, red)"),
    ("pick up the jar, then pour 50 ml of it into the red cup", "pour(jar, red, amount: 50 mL)"),
    ("pick up the die and stack it on the tray", "stack(die, tray)"),
    ("take the die and stir the red cup with it", "stir(red, die)"),
    ("take the die and hand it over to me, then go home", "hand_over(die) then home()"),
    ("take the jar and pour it into the cup", "? which cup: red cup or blue cup?"),
    ("pick up the die, then wipe the tray", "pick(die) then wipe(tray)"),
    ("set the die down and then put it on the tray", "place(die) then put(die, at: tray)"),
    ("put everything on the tray", "collect(tray)"),
    ("take out the die", "unstack(die)"),
    // With closed fingers, and with what they hold.
    ("push the die to the tray", "push_to(die, tray)"),
    ("shove the white die to the left of the red cup", "push(die, left_of(red))"),
    ("push the tray next to the jar", "push(tray, next_to(jar))"),
    ("stir the red cup with the die", "stir(red, die)"),
    ("wipe the tray", "wipe(tray)"),
    // The particle behind the thing, and what has no thing.
    ("pick the die up", "pick(die)"),
    ("pick it up", "! nothing was named before \"it\""),
    ("set the die down and then pick it up", "place(die) then pick(die)"),
    ("pour some water", "! \"water\" does not say how much, or of what"),
    ("pour half", "! \"half\" is an amount, and a thing is meant"),
    ("pour everything", "! \"everything\" is an amount, and a thing is meant"),
    ("pour all of it", "! \"all of it\" is an amount, and a thing is meant"),
    ("pour 3 oz of the jar into the red cup", "! `oz` is not a known unit of a volume"),
    ("pour 2 jiggers of the jar into the red cup", "! `jiggers` is not a known unit of a volume"),
    ("move the jar 2 spans to the left", "! `spans` is not a known unit of a length"),
    // Not here, not so, not known.
    ("put it down", "! nothing was named before \"it\""),
    ("pour the jar into the cup", "? which cup: red cup or blue cup?"),
    ("pour the jar into the green cup", "! there is no green cup here"),
    ("pour the jar into the jar", "! `jar` is given for `source` and for `target`"),
    ("put the jar on the jar", "! `jar` is given for `o` and for `at`"),
    ("pick up the jar on the jar", "! no jar is on the jar"),
    ("put the die next to the", "! the name of a thing is missing after \"the\""),
    ("put the die next to", "! the name of a thing is missing after \"to\""),
    ("pick up", "! the name of a thing is missing after \"up\""),
    ("pour the die into the red cup", "! `source` is a Container, and the die is a Graspable"),
    ("pick up the tray", "! `o` is a Graspable, and the tray is a Surface"),
    ("sing a song", "-"),
    // What everybody tries first.
    ("lift the die", "pick(die)"),
    ("put down the die", "place(die)"),
    ("hand the die over to me", "hand_over(die)"),
    ("pour out the jar", "? which target: red cup or blue cup?"),
    ("look again", "look()"),
    ("take a photo", "look()"),
    ("open the gripper", "open_gripper()"),
    ("close your hand", "close_gripper()"),
    ("go back home", "home()"),
    // Questions.
    ("Where is the jar?", "asks :objects"),
    ("what do you see", "asks :objects"),
    ("How much water is in the red cup?", "asks filled(red)"),
    ("is the jar empty?", "asks filled(jar)"),
    ("was anything spilt?", "asks spilt()"),
    ("did it spill?", "asks spilt()"),
    ("Why did it spill?", "asks spilt()"),
    ("did you spill any water", "asks spilt()"),
    ("did the jar spill anything?", "asks spilt()"),
    ("can you see the die", "asks visible(die)"),
    ("Can you reach the blue cup?", "asks reachable(blue)"),
    ("are you holding the die?", "asks held(die)"),
    ("are you holding anything?", "asks held(any)"),
    ("is the die on the tray?", "asks rests_on(die, tray)"),
    ("how far is the die from the jar?", "asks distance(die, jar)"),
    ("Is the jar above the red cup?", "asks above(jar, red)"),
    ("what went wrong?", "asks :why"),
    ("what can I say?", "asks :tasks"),
    ("is the cup full?", "! which cup: red cup or blue cup?"),
    ("is the kettle empty?", "! there is no kettle here"),
    ("what is the meaning of life", "-"),
];

#[test]
fn forty_sentences_are_understood_asked_back_or_refused() {
    let mut library = Library::standard();
    library.add(Source::new("evening.task", EVENING));
    let things = things(library.scene("evening").unwrap().0);
    let with = Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: None,
        spot: &nowhere,
        hindrance: &nothing,
    };
    let wrong = unlike(SAID, &with);
    assert!(SAID.len() >= 40 && wrong.is_empty(), "{wrong}");
}

/// Lists the sentences that are not read as a person would.
fn unlike(said: &[(&str, &str)], with: &Knowledge<'_>) -> String {
    let mut wrong = Vec::new();
    for (said, meant) in said {
        let made = match understand(said, with) {
            Meaning::Clear(found) => found.text,
            Meaning::Ambiguous { question, .. } => format!("? {question}"),
            Meaning::Asked { line, .. } => format!("asks {line}"),
            Meaning::Impossible { why, .. } => format!("! {why}"),
            Meaning::Unknown { .. } => "-".to_owned(),
        };
        if made != *meant {
            wrong.push(format!("{said}\n   {made}\n   and not {meant}"));
        }
    }
    wrong.join("\n")
}

/// The same table with a second die; two cups stand left of the jar and behind it, the dark die on the tray, to the right.
const STANDING: &str = "scene standing {
    table: Surface = box(120 cm, 80 cm, 2 cm) at (0.5 m, 0 m)
    jar: Container = cuboid(6 cm, 6 cm, 14 cm) { wall 3 mm holds 250 mL filled 150 mL looks \"transparent jar\" }
    red: Container = cylinder(radius 4 cm, height 9 cm) { looks \"red cup\" }
    blue: Container = cylinder(radius 4 cm, height 9 cm) { looks \"blue cup\" }
    die: Graspable = cuboid(3 cm, 3 cm, 3 cm) { looks \"white die\" }
    dark: Graspable = cuboid(3 cm, 3 cm, 3 cm) { looks \"dark die\" }
    tray: Surface = cuboid(20 cm, 16 cm, 2 cm) { looks \"grey tray\" }
}";

fn standing(name: &str) -> Option<Spot> {
    let round = Spot { radius: 0.04, height: 0.09, volume: 450e-6, ..Spot::default() };
    let small = Spot { radius: 0.02, height: 0.03, volume: 27e-6, ..Spot::default() };
    Some(match name {
        "jar" => Spot { ahead: 0.5, height: 0.14, water: Some(150e-6), ..round },
        "red" => Spot { left: 0.2, ahead: 0.52, water: Some(0.0), ..round },
        "blue" => Spot { left: -0.05, ahead: 0.695, water: Some(40e-6), volume: 600e-6, ..round },
        // As a base sees it that is turned by a right angle: its left is the world's -x.
        "die" => Spot { left: 0.1, ahead: 0.3, at: [-0.1, 0.3], facing: FRAC_PI_2, ..small },
        "dark" => Spot { left: -0.3, ahead: 0.4, on: Some("tray".into()), ..small },
        "tray" => Spot { left: -0.3, ahead: 0.42, radius: 0.13, height: 0.02, ..round },
        _ => return None,
    })
}

/// Things told by where they stand, how big they are and what is in them.
const TOLD: &[(&str, &str)] = &[
    ("move the white die between the cups", "put(die, at: between(red, blue))"),
    // By how far and which way from where it stands.
    ("move the white die 10 cm to the left", "put(die, at: point(-20 cm, 30 cm))"),
    ("move the white die 2 inches to the left", "put(die, at: point(-15.1 cm, 30 cm))"),
    ("shift the white die 5cm further away", "put(die, at: point(-10 cm, 35 cm))"),
    ("push the white die to the right by 25 millimetres", "push(die, point(-7.5 cm, 30 cm))"),
    ("move the kettle 10 cm back", "! there is no kettle here"),
    ("pick up the cup left of the jar", "pick(red)"),
    ("pick up the cup that is behind the jar", "pick(blue)"),
    ("pick up the cup to the right of the jar", "! no cup is right of the jar"),
    ("pick up the cup next to the jar", "! no cup is next to the jar"),
    ("pick up the cup closest to the jar", "? which cup closest to the jar: red cup or blue cup?"),
    ("pick up the cup farthest from me", "pick(blue)"),
    ("pour the jar into the leftmost cup", "pour(jar, red)"),
    ("pour the jar into the right cup", "pour(jar, blue)"),
    ("pour the jar into the empty cup", "pour(jar, red)"),
    ("pour the cup with water into the red cup", "pour(blue, red)"),
    ("pour half of the jar into the bigger one", "pour(jar, blue, amount: filled(jar) / 2)"),
    ("pour the cup that has water in it into the cup that is empty", "pour(blue, red)"),
    ("pick up the die", "? which die: white die or dark die?"),
    ("pick up the die on the tray", "pick(dark)"),
    ("take the die from the tray", "pick(dark)"),
    ("pick up the die on the table", "pick(die)"),
    ("move the die on the tray to the left of the jar", "put(dark, at: left_of(jar))"),
    ("move the die on the table on the tray", "put(die, at: tray)"),
    ("move the cup behind the jar next to the tray", "put(blue, at: next_to(tray))"),
    (
        "move the nearest die between the red cup and the blue cup",
        "put(die, at: between(red, blue))",
    ),
    (
        "pick up the die on the tray, then move it next to the cup left of the jar",
        "put(dark, at: next_to(red))",
    ),
    ("pick up the thing on the tray", "pick(dark)"),
    ("pick up the die left of the kettle", "! there is no kettle here"),
    ("pick up the die in the jar", "! no die is in the jar"),
    ("pick up the cup between the jar", "! what is between is between two things"),
];

#[test]
fn things_are_told_by_where_they_stand() {
    let mut library = Library::standard();
    library.add(Source::new("standing.task", STANDING));
    let things = things(library.scene("standing").unwrap().0);
    let with = |spot| Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: None,
        spot,
        hindrance: &nothing,
    };
    assert_eq!(unlike(TOLD, &with(&standing)), "");
    // Where nobody has looked, nothing is guessed.
    let blind =
        [("pick up the cup left of the jar", "? which cup left of the jar: red cup or blue cup?")];
    assert_eq!(unlike(&blind, &with(&nowhere)), "");
}

/// "put the die on the tray" was three questions at once: `place`, `put`, or `place` of "the die on the tray" anywhere.
#[test]
fn what_is_in_the_hand_tells_placing_from_putting() {
    let mut library = Library::standard();
    library.add(Source::new("evening.task", EVENING));
    let things = things(library.scene("evening").unwrap().0);
    let empty = |call: &Call| (call.name.text == "place").then(|| "nothing is held".to_owned());
    let full = |call: &Call| (call.name.text == "put").then(|| "something is held".to_owned());
    let with = |hindrance| Knowledge {
        library: &library,
        things: &things,
        phrases: &[],
        it: None,
        spot: &nowhere,
        hindrance,
    };
    let said = [
        ("put the jar left of the blue cup", "jar, at: left_of(blue)"),
        ("put the jar on the tray", "jar, at: tray"),
        ("put the die in the red cup", "die, at: red"),
    ];
    for (said, args) in said {
        assert_eq!(unlike(&[(said, &format!("put({args})"))], &with(&empty)), "");
        assert_eq!(unlike(&[(said, &format!("place({args})"))], &with(&full)), "");
        // Where nobody knows, nothing is in the hand that was not spoken of.
        assert_eq!(unlike(&[(said, &format!("put({args})"))], &with(&nothing)), "");
        let spoken_of = Knowledge { it: Some("jar"), ..with(&nothing) };
        let Meaning::Ambiguous { choices, .. } = understand(said, &spoken_of) else { panic!() };
        let calls: Vec<String> = choices.into_iter().map(|choice| choice.text).collect();
        assert_eq!(calls, [format!("place({args})"), format!("put({args})")]);
    }
}
