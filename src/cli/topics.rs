//! How things are done, each in about ten lines: what `trueup help TOPIC` tells, with lines that work from a checkout.
//!
//! Lines that begin with `trueup` are examples; the tests read each as the program would. No option is explained here:
//! that is what `trueup COMMAND --help` is for.

/// How one thing is done.
pub(super) struct Topic {
    /// What it is asked by; where a command has that name, its help ends with the topic.
    pub(super) name: &'static str,
    /// What it is, in a line.
    pub(super) title: &'static str,
    /// How it is done.
    pub(super) text: &'static str,
}

impl Topic {
    /// Returns all that is told of it.
    pub(super) fn told(&self) -> String {
        let mut title = self.title.chars();
        let first = title.by_ref().take(1).flat_map(char::to_uppercase).collect::<String>();
        format!("{first}{}\n\n{}", title.as_str(), self.text)
    }
}

/// Returns the names of all topics, each with what is told of it.
pub(super) fn topics() -> Vec<(&'static str, String)> {
    TOPICS.iter().map(|topic| (topic.name, topic.told())).collect()
}

/// All topics, in the order in which a newcomer meets them.
pub(super) const TOPICS: &[Topic] = &[
    Topic {
        name: "run",
        title: "pour water in the built-in laboratory, and see why it went as it did",
        text: "\
One line, or a script of lines. No arm is needed; a run folder is kept.
  trueup -c 'pour(jar, cup)'
  trueup run scripts/pour.task --seed 3
What is on the table, what can be called, what a name means:
  trueup -c :objects
  trueup -c '?pour'
A run that is over: list, tell again, one page, what differs.
  trueup runs
  trueup replay 1
  trueup report 1 -o run.html
The prompt is `trueup` alone: Tab completes, `:why` tells the numbers.",
    },
    Topic {
        name: "task",
        title: "write a task of your own",
        text: "\
A file to begin with, which runs as it is. Edit it, check it, run it.
  trueup new task tidy
  trueup check tidy.task
  trueup run tidy.task
  trueup fmt tidy.task
Its And-Or graph, its examples run in the twin, a mistake explained:
  trueup graph scripts/pour.task --format svg
  trueup test tidy.task
  trueup explain task::unit
Colours, completion and fixes in an editor: examples/editor.",
    },
    Topic {
        name: "scene",
        title: "describe your own table",
        text: "\
A scene says sizes, looks, dots, camera and robot. It says no places: those are
seen. A file to begin with, what it lacks to run, a call on it:
  trueup new scene breakfast
  trueup check breakfast.task
  trueup --scene breakfast.task -c :objects
The dots of the table, to print in true size:
  trueup marks --scene breakfast.task --pdf marks.pdf
What a photograph shows: known things found, unknown things measured.
  trueup camera see photo.png --scene breakfast.task --out seen/
  trueup scene from photo.png --scene breakfast.task --out found.task",
    },
    Topic {
        name: "robot",
        title: "use another arm, or ask an arm's model",
        text: "\
From a maker's URDF to a pour: docs/your-robot.md. Is the file whole?
  trueup robot check stdlib/robots/panda/panda.urdf
Kinematics, dynamics, a path without collisions; the Gen3 where none is named:
  trueup robot fk --q '0,0.26,3.14,-2.27,0,0.96,1.57'
  trueup robot ik --pose '0.5,0,0.3,0.5,0.5,0.5,0.5'
  trueup robot dynamics --q '0,0.26,3.14,-2.27,0,0.96,1.57'
The same task with other arms of the standard library:
  trueup --scene stdlib/scenes/kitchen_panda.task -c 'pour(jar, cup)'
A real Gen3 moves only when you say so: docs/safety.md, then docs/kortex.md.
  trueup doctor --robot kortex://admin@192.168.1.10",
    },
    Topic {
        name: "bridge",
        title: "connect your own simulator or robot",
        text: "\
A server of yours answers lines of JSON; docs/bridge.md has the protocol, and
examples/bridge has servers to copy:
  python examples/bridge/mujoco_server.py --seed 1
Is it there, and are its joints, units and pictures right? Nothing moves.
  trueup doctor --robot bridge://127.0.0.1:5555
A call, a file and the prompt with it:
  trueup -c 'pick(jar)' --robot bridge://127.0.0.1:5555
  trueup run scripts/pour.task --robot bridge://127.0.0.1:5555
  trueup --robot bridge://127.0.0.1:5555
A robot of its own time moves only when you say so: docs/safety.md.",
    },
    Topic {
        name: "teach",
        title: "go one step at a time, and ask what people expect",
        text: "\
A call runs step by step; `help` there lists the words.
  trueup teach 'pick(jar)'
  trueup run scripts/pour.task --step
On a page in the browser, on this machine only:
  trueup teach 'pour(jar, cup)' --page
A run that is over, by its number; nothing moves.
  trueup teach 1
The words from a file, answers kept for later:
  trueup teach 'pick(jar)' --script words.txt --answers answers.jsonl",
    },
    Topic {
        name: "gap",
        title: "name the effect that a model lacks, from recordings",
        text: "\
The first recording is fitted, the last is held out. `--out` writes a page that
shows why. Here 0.8 N*m of dry friction is missing, then nothing:
  cd tests/discovery/recordings
  trueup gap coulomb_a.csv coulomb_b.csv --out gap/
  trueup gap control_a.csv control_b.csv
Your arm: columns `t[s]`, `q_1[rad]`, `tau_1[N*m]`, ..; other names are mapped.
  trueup gap a.csv b.csv --robot-file arm.urdf --map 'time=t[s],j1=q_1[rad]'
Write what was found into a model, then the next run is simulated with it:
  trueup gap 1 2 --model bench.task --apply
The same, with an effect that the laboratory hides: `trueup help lab`.
Points and pixels of a camera, equations, held things: docs/method.md.",
    },
    Topic {
        name: "lab",
        title: "hide an effect in the laboratory, and find it",
        text: "\
A sealed file, two runs with it, the name of what is missing, the twin mended:
  cp scripts/hidden_effect.task bench.task
  trueup lab hide --seed 1 --out hidden.toml
  trueup run bench.task --lab hidden.toml --seed 1
  trueup run bench.task --lab hidden.toml --seed 2
  trueup gap runs/* --model bench.task --out gap/ --apply
The same laboratory pours again, and the seal is opened:
  trueup run bench.task --lab hidden.toml --seed 1
  trueup lab reveal hidden.toml --guess 'lip_dribble(jar)'
All of it in one go: scripts/hidden_effect.sh.",
    },
    Topic {
        name: "camera",
        title: "calibrate a camera, and find where it sits",
        text: "\
Photographs of a printed chessboard, tilted differently; inner corners count.
  trueup camera calibrate *.jpg --board chessboard:9x6:25mm --write cam.json
What stands on a table, and a thing cut out of any picture:
  trueup camera see photo.png --calibration cam.json --out seen/
  trueup camera segment photo.png --box 450,250,640,480 --out cut/
Masks of a server beside our own; examples/masks_server.py is one:
  trueup camera see photo.png --masks http://127.0.0.1:8000/masks
On the wrist or beside the arm, from the arm's pose at each photograph:
  trueup align hand-eye poses.csv photos/ --board chessboard:9x6:25mm
  trueup align hand-eye poses.csv photos/ --board charuco:7x5:40mm:30mm:4x4_50
The three regressions on tables of pairs:
  trueup align map pairs.csv --model auto
  trueup align offset pairs.csv --model rigid",
    },
    Topic {
        name: "export",
        title: "take a run elsewhere",
        text: "\
One self-contained page; a film; a recording for Rerun; a bag for Foxglove and
ROS 2; a table.
  trueup report 1 -o run.html
  trueup export 1 --mp4 run.mp4
  trueup export 1 --rrd run.rrd
  trueup export 1 --mcap run.mcap
  trueup export 1 --csv run.csv
`gap` reads what was exported:
  trueup gap run.mcap --robot-file stdlib/robots/gen3_2f85/gen3_2f85.urdf
Every command answers as one JSON document; docs/schema/ says its form.
  trueup replay 1 --json
  trueup -c 'pick(jar)' --json",
    },
    Topic {
        name: "trials",
        title: "count over many laboratories, on one machine or many",
        text: "\
The same task in the laboratories of seeds 1 to 20, and without each regression:
  trueup trials --task scripts/pour.task --n 20 --ablate 1,2,3 --out trials/pour
The same command goes on where it ended. In parts, on several machines:
  trueup trials --task scripts/pour.task --n 20 --shard 1/2 --out trials/a
  trueup trials --task scripts/pour.task --n 20 --shard 2/2 --out trials/b
  trueup trials merge trials/a trials/b --parquet trials.parquet
Ray, Dask and Slurm: examples/cluster. The paper's own tables:
  trueup paper table2 --n 20",
    },
];

/// Returns the topic of a name.
pub(super) fn topic(name: &str) -> Option<&'static Topic> {
    TOPICS.iter().find(|topic| topic.name == name)
}
