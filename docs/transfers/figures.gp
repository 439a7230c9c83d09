# gnuplot -e "data='FILE'; out='FOLDER'" figures.gp   draws the figures of docs/transfers.md
set encoding utf8
ink = "#333333"; grid = "#dddddd"
set border 3 lc rgb ink
set tics nomirror textcolor rgb ink

# What a mode is: the nine of the quadratic kernel, over the stencil of a particle (+) at x = (0.2, -0.15) from the middle node.
set terminal pngcairo size 900,960 font "DejaVu Sans,12" noenhanced
set output out."/modes.png"
px = 0.2; py = -0.15
g(w, x) = w**2 - x*(1 - 4*x**2)*w - 0.25
f(a, w, x) = a == 0 ? 1 : a == 1 ? w : g(w, x)
array na[9] = [0, 1, 0, 1, 2, 0, 2, 1, 2]
array nb[9] = [0, 0, 1, 1, 0, 2, 1, 2, 2]
array label[9] = ["1:  1", "2:  x", "3:  y", "4:  xy", "5:  g1", "6:  g2", "7:  g1 y", "8:  x g2", "9:  g1 g2"]
array who[9] = ["PIC ends here", "", "APIC ends here", "multilinear ends here", "", "quadratic ends here", "", "", "full ends here"]
set palette defined (-1 "#2166ac", -0.5 "#92c5de", 0 "#f7f7f7", 0.5 "#f4a582", 1 "#b2182b")
set cbrange [-1.45:1.45]
unset colorbox
unset key
set xrange [-1.25:1.25]
set yrange [-1.25:1.25]
set size square
set xtics -1,1,1 offset 0,0.4
set ytics -1,1,1 offset 0.4,0
$particle << EOD
0.2 -0.15
EOD
$nodes << EOD
-1 -1
-1 0
-1 1
0 -1
0 0
0 1
1 -1
1 0
1 1
EOD
set multiplot layout 3,3 margins 0.05,0.98,0.04,0.95 spacing 0.06,0.075
do for [r=1:9] {
  set title label[r].(strlen(who[r]) > 0 ? "      ".who[r] : "") offset 0,-0.6 textcolor rgb ink
  plot sample [u=-1.25:1.25:0.0125] [v=-1.25:1.25:0.0125] '++' using 1:2:(f(na[r], $1 - px, px)*f(nb[r], $2 - py, py)) with image, \
       $particle with points pt 1 ps 2 lw 2 lc rgb "#000000", \
       $nodes using 1:2:(f(na[r], $1 - px, px)*f(nb[r], $2 - py, py)) with points pt 7 ps 2.4 lc palette, \
       $nodes with points pt 6 ps 2.4 lw 1.2 lc rgb "#000000"
}
unset multiplot

# What a transfer to particles and back loses, without any motion: a row of random velocities, and vortices of every width.
reset
set terminal pngcairo size 1000,760 font "DejaVu Sans,12" noenhanced
set output out."/losses.png"
set border 3 lc rgb ink
set tics nomirror textcolor rgb ink
set grid lc rgb grid lt 1
set style line 1 lc rgb "#8c8c8c" lw 2
set style line 2 lc rgb "#d95f02" lw 2
set style line 3 lc rgb "#e6ab02" lw 2
set style line 4 lc rgb "#66a61e" lw 2
set style line 5 lc rgb "#1b6ca8" lw 2.5
set style line 6 lc rgb "#d95f02" lw 2 dt 2
set style line 7 lc rgb "#000000" lw 2 dt 3
set multiplot
set origin 0,0.56; set size 1,0.44
set lmargin 9; set rmargin 20
set key outside right top Left reverse samplen 2
set title "A row of random face velocities after one round trip" textcolor rgb ink
set xlabel "face" offset 0,0.5
set ylabel "velocity [m/s]"
set xrange [-0.3:16.3]
set yrange [-1.1:1.1]
set xtics 2
set key autotitle columnheader
plot data index 0 using 0:1 with points pt 6 ps 2 lw 1.5 lc rgb "#000000" title "on the grid", \
     '' index 0 using 0:2 with lines ls 1 title "PIC", '' index 0 using 0:3 with lines ls 2 title "APIC", \
     '' index 0 using 0:4 with lines ls 3 title "PolyPIC 4", '' index 0 using 0:6 with linespoints ls 5 pt 7 ps 0.8 title "PolyPIC 9"
set origin 0,0; set size 0.44,0.56
set lmargin 9; set rmargin 3
unset key
set title "Energy kept in one round trip" textcolor rgb ink
set xlabel "cells a wavelength"
set ylabel "energy over that of the start"
set logscale x 2
set xrange [2:64]
set yrange [0:1.05]
set xtics (2, 4, 8, 16, 32, 64)
plot for [k=2:8] data index 1 using 1:k with lines ls k-1 notitle
set origin 0.44,0; set size 0.56,0.56
set lmargin 8
set rmargin 24
set key outside right center Left reverse samplen 3
set title "Eight cells a wavelength" textcolor rgb ink
unset logscale x
set xlabel "round trips"
set ylabel ""
set xrange [0:100]
set xtics 25
plot for [k=2:8] data index 2 using 1:k with lines ls k-1 title columnheader(k)
unset multiplot
