# gnuplot -e "data='FILE'; out='FOLDER'" figures.gp   draws the figure of docs/solids.md
set encoding utf8
ink = "#333333"
set terminal pngcairo size 1200,460 font "DejaVu Sans,12" noenhanced
set output out."/energy.png"
set border 3 lc rgb ink
set tics nomirror textcolor rgb ink
set grid lc rgb "#dddddd" lt 1
set style line 1 lc rgb "#8c8c8c" lw 2
set style line 2 lc rgb "#7570b3" lw 2
set style line 3 lc rgb "#d95f02" lw 2
set style line 4 lc rgb "#e6ab02" lw 2
set style line 5 lc rgb "#66a61e" lw 2
set style line 6 lc rgb "#1b6ca8" lw 2.5
set xlabel "time [s]"
set xrange [0:1]
set yrange [0:1.1]
set xtics 0.25
set multiplot
title(n) = n == 0 ? "steps of 0.3 cells of sound" : n == 1 ? "a quarter of that" : "a sixteenth"
set lmargin 8; set rmargin 2; set bmargin 4; set tmargin 3
unset key
do for [n=0:1] {
  set origin 0.28*n, 0; set size 0.28, 1
  set title title(n) textcolor rgb ink
  if (n == 0) { set ylabel "kinetic and elastic energy over that of the start" } else { unset ylabel }
  plot for [k=2:7] data index n using 1:k with lines ls k-1 notitle
}
set origin 0.56, 0; set size 0.44, 1
set rmargin 21
set key outside right center Left reverse samplen 3
set title title(2) textcolor rgb ink
plot for [k=2:7] data index 2 using 1:k with lines ls k-1 title columnheader(k)
unset multiplot
