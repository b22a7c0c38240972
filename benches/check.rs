//! What an editor and a build wait on: reading and checking many task files, laying one out.

#![expect(clippy::unwrap_used, reason = "a failed unwrap in a bench is a failed bench")]

use std::fs;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use trueup::language::{Source, format, parse};
use trueup::workcell::Stdlib;
use trueup::workcell::check::check_all;

/// A file as a user writes one: a task of ten steps with a choice and a recovery, a fluent, and a call.
fn file(i: usize) -> String {
    format!(
        "/// Clears the table, way {i}.\n\
         task clear_{i}(o: Graspable, at: Place = table) {{\n\
             say \"clear [the] {{o}} away {i}\"\n\
             needs visible(o) and reachable(o) and not held(any)\n\
             gives done_{i}(o)\n\
             look()\n\
             either a prior 0.7 when tall(o) {{ pick(o) via level_side }}\n\
             or     b prior 0.3 {{ approach(o, top) grasp(o, top) lift(o, by: {i} mm) }}\n\
             repeat upto 3 times {{ look() }} until visible(o)\n\
             if level(o) {{ place(o, at: at) }} else {{ abort_{i}(o) }}\n\
             on failure of grasp(o) {{ open_gripper() retry other upto 2 times }}\n\
         }}\n\
         task abort_{i}(o: Graspable) {{ lower(o) then open_gripper() then retreat(up: 10 cm) }}\n\
         /// Away from where it was.\n\
         fluent done_{i}(o: Graspable) = upright(o) and distance(o, gripper) >= {i} mm\n\
             ask \"Is the {{o}} away?\"\n\
         clear_{i}(jar)\n"
    )
}

fn checking(criterion: &mut Criterion) {
    // Read from a folder, as `trueup check FOLDER` does.
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("check-1000");
    fs::create_dir_all(&dir).unwrap();
    for i in 0..1000 {
        fs::write(dir.join(format!("f{i:04}.task")), file(i)).unwrap();
    }
    let stdlib = Stdlib::embedded();
    let mut group = criterion.benchmark_group("language");
    group.sample_size(10);
    group.bench_function("check a folder of 1000 files", |bencher| {
        bencher.iter(|| {
            let sources = (0..1000).map(|i| {
                let path = dir.join(format!("f{i:04}.task"));
                Source::new(path.display().to_string(), fs::read_to_string(path).unwrap())
            });
            let found = check_all(&stdlib, None, sources.collect()).unwrap();
            assert!(found.is_empty(), "{:?}", found[0].0);
            black_box(found)
        });
    });
    let text = stdlib.file("tasks/std.task").unwrap().to_owned();
    group
        .bench_function("parse tasks/std.task", |bencher| bencher.iter(|| parse(black_box(&text))));
    group.bench_function("lay out tasks/std.task", |bencher| {
        bencher.iter(|| format(black_box(&text)));
    });
    group.finish();
}

criterion_group!(benches, checking);
criterion_main!(benches);
