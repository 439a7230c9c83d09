#!/usr/bin/env bash
# Fills a small disk (a tmpfs of its own) a bit later each time, so that every stage meets it, then makes room and goes on.
#   tests/full_disk.sh PROGRAM [ROUNDS]     40 unless said, and eight at the movies; prints its verdict, exit 1 when it is bad, 77 where no disk can be mounted
# Each round must be refused for want of room or stop with exit code 5 and one line that names a file, leave no name that starts with a dot and nothing but whole
# files, and end as the run that had room, to the byte, once there is room.
set -euo pipefail
if [ "${POLYPIC_OWN_MOUNTS:-}" != 1 ]; then
  own=(unshare -m)
  [ "$(id -u)" = 0 ] || own=(unshare -rm)
  "${own[@]}" mount -t tmpfs -o size=64k tmpfs /mnt 2>/dev/null || { echo "no disk can be mounted here"; exit 77; }
  POLYPIC_OWN_MOUNTS=1 exec "${own[@]}" "$0" "$@"
fi
program=$(readlink -f "$1")
rounds=${2:-40}
work=$(mktemp -d)
trap 'cd /; umount "$work/disk" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
mkdir disk

cat >x.toml <<'SHOT'
[shot]
frames = 4
checkpoint_every = 2

[sim]
domain = [[0, 0, 0], [0.6, 0.3, 0.3]]
cell = 0.06

[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.24, 0.3, 0.18]] }

[[effect]]
kind = "gravity"

[render]
width = 96
height = 54
spp = 1
SHOT

# Content of all files but those that tell of times.
content() { (cd "$1" && find . -type f ! -path './ledger/*' ! -name run.json ! -name report.html -exec sha256sum {} + | sort); }

"$program" run x.toml --preview --out straight --quiet
content straight >straight.sums
need=$(du -s --apparent-size -k straight | cut -f1)
# [kB] what is there when the first movie is begun: pages of 4 kB, and two locks
before_movies=$(find straight -type f ! -name '*.mp4' ! -name 'movie.json' ! -name 'preview.json' ! -name run.json ! -name report.html -printf '%s\n' | awk '{sum += 4 * int(($1 + 4095) / 4096)} END {print sum + 8}')

bad=0
declare -A met=()
for round in $(seq $((rounds + 8))); do
  size=$((round * need / rounds + 16))
  [ "$round" -le "$rounds" ] || size=$((before_movies + 4 * (round - rounds - 1)))   # the movies, their records, run.json and report.html
  mount -t tmpfs -o size="${size}k" tmpfs disk
  code=0 complaint=
  said=$("$program" run x.toml --preview --out disk/x --quiet 2>&1) || code=$?
  if [ "$code" = 0 ]; then
    met[none]=$((${met[none]:-0} + 1))
  else
    what=$(sed -n 's,^polypic: disk/\(x/\)\?\([a-z]*\).*,\2,p' <<<"$said")
    expected=5
    [[ $said != *"of disk, and there are"* ]] || what=plan expected=2   # refused before it began
    met[${what:-?}]=$((${met[${what:-?}]:-0} + 1))
    [ "$code" = $expected ] && [ -n "$what" ] && [ "$(wc -l <<<"$said")" = 1 ] && [[ $said != *.tmp* ]] || complaint="exit $code: $said"
    if [ -d disk/x ]; then
      left=$(find disk/x -name '.*' -printf '%P ')
      [ -z "$left" ] || complaint+=" left over: $left"
      torn=$(content disk/x | grep -vxFf straight.sums | grep -v ' ./checkpoint/') || true   # states between those the whole run keeps
      [ -z "$torn" ] || complaint+=" not whole: $torn"
      for state in disk/x/checkpoint/*; do [ ! -e "$state" ] || "$program" info "$state" >/dev/null || complaint+=" $state is not whole"; done
    fi
    mount -o remount,size=64m disk
    said=$("$program" run x.toml --preview --out disk/x --quiet 2>&1) || said="exit $?: $said"
    [ -z "$said" ] || complaint+=" with room again: $said"
  fi
  [ "$(content disk/x)" = "$(<straight.sums)" ] || complaint+=" other files than those of the run that had room"
  left=$(find disk/x -name '.*' -printf '%P ')
  [ -z "$left" ] || complaint+=" left over at the end: $left"
  if [ -n "$complaint" ]; then
    bad=$((bad + 1))
    echo "round $round, $size kB: $complaint"
  fi
  umount disk
done
printf '%s rounds of 16 to %s kB, %s bad; full at' "$((rounds + 8))" "$((need + 16))" "$bad"
for what in "${!met[@]}"; do printf ' %s %s,' "$what" "${met[$what]}"; done
echo
[ "$bad" = 0 ] || exit 1
for what in points surface images checkpoint ledger preview movie; do
  [ -n "${met[$what]:-}" ] || [ "$rounds" -lt 20 ] || { echo "the disk was never full at $what"; exit 1; }
done
