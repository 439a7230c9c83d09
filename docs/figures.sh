#!/bin/sh
# Draws the figures of a page of the docs again: docs/figures.sh solids|transfers [BUILD_DIR]. Needs a configured build and gnuplot.
set -e
docs=$(cd "$(dirname "$0")" && pwd)
page=$1
build=${2:-$docs/../build/release}
[ -f "$docs/$page/figures.gp" ] || { sed -n 2p "$0" >&2; exit 2; }
cmake --build "$build" --target "${page%s}_figures"
data=$(mktemp)
trap 'rm -f "$data"' EXIT
"$build/docs/$page/${page%s}_figures" > "$data"
gnuplot -e "data='$data'; out='$docs/$page'" "$docs/$page/figures.gp"
