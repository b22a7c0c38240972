//! Reads, checks and lays out random and damaged texts, as many as asked for, and tells of the first that is
//! not survived: `cargo run --release --example fuzz_parse -- 1000000 1`.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

mod texts;

use std::panic;
use std::process::ExitCode;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;
use trueup::language::Library;

/// How many texts are drawn from one seed.
const BATCH: u64 = 1000;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1).map(|arg| arg.parse::<u64>());
    let (count, seed) = match (args.next(), args.next()) {
        (None, None) => (10_000, 1),
        (Some(Ok(count)), None) => (count, 1),
        (Some(Ok(count)), Some(Ok(seed))) => (count, seed),
        _ => {
            println!("usage: fuzz_parse [HOW MANY] [SEED]");
            return ExitCode::from(2);
        }
    };
    let (pieces, standard) = (texts::pieces(), Library::standard());
    let batches = count.div_ceil(BATCH);
    let failed = (0..batches).into_par_iter().find_map_any(|batch| {
        let mut rng = StdRng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(batch));
        (0..BATCH.min(count - batch * BATCH)).find_map(|_| {
            let text = texts::draw(&mut rng, &pieces);
            panic::catch_unwind(|| texts::survives(&text, &standard)).is_err().then_some(text)
        })
    });
    if let Some(text) = failed {
        println!("not survived: {text:?}");
        return ExitCode::FAILURE;
    }
    println!("{count} texts of seed {seed} were read, checked and laid out without a panic");
    ExitCode::SUCCESS
}
