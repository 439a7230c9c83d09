#!/bin/sh
# Draws the figure of docs/solids.md again: docs/solids/figures.sh [BUILD_DIR]. Needs a configured build and gnuplot.
set -e
here=$(cd "$(dirname "$0")" && pwd)
build=${1:-$here/../../build/release}
cmake --build "$build" --target solid_figures
data=$(mktemp)
trap 'rm -f "$data"' EXIT
"$build/docs/solids/solid_figures" > "$data"
gnuplot -e "data='$data'; out='$here'" "$here/figures.gp"
