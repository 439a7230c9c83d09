#!/usr/bin/env bash
# Kills a run with -9 at random moments and goes on: the result must be that of a run nobody killed.
#   tests/kill_and_resume.sh PROGRAM [KILLS [SEED]]     50 unless said; prints its verdict, exit 1 when it is bad
# Rounds take turns: three with a shot in space, one with a shot in a plane. Each starts a run in a directory of its own, kills it
# once somewhere between its start and its usual end, runs the same command to the end, and compares every file that does not tell
# of times (points, surfaces, states, images, movies), the hashes of the states, and looks for names that start with a dot.
# A kill that came too late, on a machine less busy than before, is done again after half the time; five in a row are a failure.
set -euo pipefail
program=$(readlink -f "$1")
kills=${2:-50}
RANDOM=${3:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cat >space.toml <<'SHOT'
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
cat >plane.toml <<'SHOT'
[shot]
frames = 6
checkpoint_every = 2

[sim]
dimension = 2
domain = [[0, 0], [0.6, 0.3]]
cell = 0.01
particles_per_cell = 4

[[body]]
name = "column"
shape = { box = [[0, 0], [0.27, 0.18]] }

[[effect]]
kind = "gravity"
acceleration = [0, -9.81]

[render]
width = 160
height = 90
SHOT

milliseconds() { echo $(($(date +%s%N) / 1000000)); }
states() { sed -n 's/.*"state_hash": *//p' "$1/run.json"; }
content() { (cd "$1" && find . -type f ! -path './ledger/*' ! -name run.json ! -name report.html -exec sha256sum {} + | sort); }
# make SHOT DIR: the command of every round
make() { "$program" run "$1.toml" --preview --out "$2" --quiet; }
# What the run was at: the frame and stage it would have recorded next, or the movies.
was_at() {
  local last
  last=$(find "$1/ledger" -name '[a-z]*.0*.json' -printf '%T@ %f\n' 2>/dev/null | sort -n | tail -n 1)
  if [ -n "$(find "$1" -name '.movie.tmp*' -o -name '.preview.tmp*.mp4')" ]; then echo movie; return; fi
  case $last in
    '') echo start ;;
    *simulate*) echo preview ;;
    *preview*) [ "$2" = plane ] && echo render || echo surface ;;
    *surface*) echo render ;;
    *render.0006*) echo movie ;;
    *) echo simulate ;;
  esac
}

declare -A usual=() at=()
for shot in space plane; do
  begun=$(milliseconds)
  make $shot "$shot.straight"
  usual[$shot]=$(($(milliseconds) - begun))
  [ "$(states "$shot.straight" | sort -u | wc -l)" = 6 ] || { echo "the run nobody killed has not six states"; exit 1; }
done

in_time=0 bad=0
for round in $(seq "$kills"); do
  shot=space
  [ $((round % 4)) != 0 ] || shot=plane
  pause=$((RANDOM * usual[$shot] / 32768))
  place=late
  for _ in 1 2 3 4 5; do
    rm -rf "$round"
    "$program" run $shot.toml --preview --out "$round" --quiet 2>/dev/null & child=$!   # as make does, but not in a shell that would outlive it
    sleep "$((pause / 1000)).$(printf %03d $((pause % 1000)))"
    mkdir -p "$round"   # killed before it made any
    if kill -9 "$child" 2>/dev/null; then
      in_time=$((in_time + 1))
      place=$(was_at "$round" $shot)
      wait "$child" 2>/dev/null || true
      break
    fi
    wait "$child" 2>/dev/null || true
    pause=$((pause / 2))
  done
  at[$place]=$((${at[$place]:-0} + 1))
  said=$(make $shot "$round" 2>&1) || said="exit $?: $said"
  complaint=
  [ -z "$said" ] || complaint="it said: $said"
  [ "$(states "$round")" = "$(states $shot.straight)" ] || complaint="other states"
  [ "$(content "$round")" = "$(content $shot.straight)" ] || complaint+=" other files: $(diff <(content "$round") <(content $shot.straight) | head -n 4 || true)"
  left=$(find "$round" -name '.*' -printf '%P ')
  [ -z "$left" ] || complaint+=" left over: $left"
  if [ -n "$complaint" ]; then
    bad=$((bad + 1))
    echo "round $round, $shot: killed after $pause ms at $place: $complaint"
  fi
  rm -rf "$round"
done

# An encoder that starts late: it may not make its file again behind the run that goes on.
mkdir bin
printf '#!/bin/sh\nsleep 0.6\nexec %s "$@"\n' "$(command -v ffmpeg)" >bin/ffmpeg
chmod +x bin/ffmpeg
PATH=$work/bin:$PATH "$program" run plane.toml --out late --quiet 2>/dev/null & child=$!
until [ -n "$(find late -name '.movie.tmp*' 2>/dev/null)" ]; do kill -0 "$child"; sleep 0.01; done
kill -9 "$child"
wait "$child" 2>/dev/null || true
"$program" run plane.toml --out late --quiet
sleep 1
left=$(find late -name '.*' -printf '%P ')
if [ -n "$left" ]; then bad=$((bad + 1)); echo "killed while its encoder started: left over: $left"; fi

printf '%s rounds of %s and %s ms, %s killed in time, %s bad; killed at' "$kills" "${usual[space]}" "${usual[plane]}" "$in_time" "$bad"
for place in "${!at[@]}"; do printf ' %s %s,' "$place" "${at[$place]}"; done
echo
[ "$bad" = 0 ] && [ "$in_time" = "$kills" ]
