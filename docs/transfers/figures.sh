#!/bin/sh
# Draws the figures of docs/transfers.md again: docs/transfers/figures.sh [BUILD_DIR]. Needs a configured build and gnuplot.
set -e
here=$(cd "$(dirname "$0")" && pwd)
build=${1:-$here/../../build/release}
cmake --build "$build" --target transfer_figures
data=$(mktemp)
trap 'rm -f "$data"' EXIT
"$build/docs/transfers/transfer_figures" > "$data"
gnuplot -e "data='$data'; out='$here'" "$here/figures.gp"
