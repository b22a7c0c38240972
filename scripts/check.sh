#!/usr/bin/env bash
# Everything that must pass, in order, each step named; the same thing CI runs.
set -euo pipefail
cd "$(dirname "$0")/.."
step() { printf '\n== %s\n' "$1"; shift; "$@"; }
step "format" cargo fmt --check
step "lints" cargo clippy --locked --all-targets -- -D warnings
step "docs" env RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps
step "tests" cargo test --locked
for example in examples/*.rs; do
    name=$(basename "$example" .rs)
    step "example $name" cargo run --locked --quiet --example "$name"
done
printf '\nall checks passed\n'
