#!/usr/bin/env bash
# Kills a run with -9 at random moments and goes on: the result must be that of a run nobody killed.
#   tests/kill_and_resume.sh PROGRAM [KILLS [SEED]]     50 kills unless said; prints its verdict, exit 1 when it is bad
# Each round starts a run in a directory of its own, kills it once somewhere between its start and its usual end, runs the same
# command to the end, and compares: state hashes, every image, no name that starts with a dot. A round whose kill came too
# late is counted apart; half of them at least must have been in time.
set -euo pipefail
program=$(readlink -f "$1")
kills=${2:-50}
RANDOM=${3:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cat >x.toml <<'SHOT'
[shot]
frames = 6
checkpoint_every = 2

[sim]
domain = [[0, 0, 0], [0.6, 0.3, 0.3]]
cell = 0.03

[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.27, 0.3, 0.18]] }

[[effect]]
kind = "gravity"

[render]
width = 96
height = 54
spp = 1
SHOT

milliseconds() { echo $(($(date +%s%N) / 1000000)); }
states() { sed -n 's/.*"state_hash": *//p' "$1/run.json"; }
images() { (cd "$1/images" && sha256sum -- *); }

begun=$(milliseconds)
"$program" run x.toml --out straight --quiet
usual=$(($(milliseconds) - begun))
[ "$(states straight | wc -l)" = 6 ] || { echo "the run nobody killed has not six states"; exit 1; }

in_time=0 bad=0
for round in $(seq "$kills"); do
  "$program" run x.toml --out "$round" --quiet 2>/dev/null & child=$!
  pause=$((RANDOM * usual / 32768))
  sleep "$((pause / 1000)).$(printf %03d $((pause % 1000)))"
  if kill -9 "$child" 2>/dev/null; then in_time=$((in_time + 1)); fi
  wait "$child" 2>/dev/null || true
  mkdir -p "$round"   # killed before it made any
  made=$(find "$round" -type f | wc -l)
  said=$("$program" run x.toml --out "$round" --quiet 2>&1) || said="exit $?: $said"
  complaint=
  [ -z "$said" ] || complaint="it said: $said"
  [ "$(states "$round")" = "$(states straight)" ] || complaint="other states"
  [ "$(images "$round")" = "$(images straight)" ] || complaint="other images"
  left=$(find "$round" -name '.*' -printf '%P ')
  [ -z "$left" ] || complaint="left over: $left"
  if [ -n "$complaint" ]; then
    bad=$((bad + 1))
    echo "round $round: killed after $pause ms with $made files: $complaint"
  fi
  rm -rf "$round"
done
echo "$kills rounds of $usual ms, $in_time killed in time, $bad bad"
[ "$bad" = 0 ] && [ $((2 * in_time)) -ge "$kills" ]
