#!/bin/sh
# The laboratory spills by a hidden effect; `gap` names it from the runs, the twin is patched, and the next
# run pours. Usage: scripts/hidden_effect.sh [SEED] (default 1); works in a new folder under /tmp.
set -eu
seed=${1:-1}
root=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/trueup-hidden.XXXXXX")
trueup=${TRUEUP:-"$root/target/release/trueup"}
[ -x "$trueup" ] || cargo build --release --manifest-path "$root/Cargo.toml"
cp "$root/scripts/hidden_effect.task" "$work/bench.task"
cd "$work"

echo "== an effect is drawn and hidden"
"$trueup" lab hide --seed "$seed" --out hidden.toml
echo "== two runs with it"
for n in 1 2; do
    "$trueup" run bench.task --lab hidden.toml --seed "$n" --quiet || echo "   run $n: exit $?"
done
echo "== what is missing from the twin?"
"$trueup" gap runs/* --model bench.task --out gap --apply
echo "== the same laboratory again, with what was found"
# A cup that runs over is not poured into beyond its brim: then the run is refused, and says how much goes in.
"$trueup" run bench.task --lab hidden.toml --seed 1 --quiet || echo "   exit $?"
echo "== what was hidden"
guess=$(sed -n 's/^ *effect \([a-z_]*([a-z_0-9]*)\).*/\1/p' bench.task | head -n 1)
"$trueup" lab reveal hidden.toml --guess "$guess"
echo "everything is in $work"
