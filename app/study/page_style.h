#pragma once
// How a page looks and what it does when it is touched: plain CSS and JavaScript, nothing from outside.
#include <string_view>

namespace app {

inline constexpr std::string_view kPageHead = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="polypic">
<link rel="icon" href="data:,">
)";

inline constexpr std::string_view kPageStyle = R"(:root { --ink: #1d2227; --soft: #5c6670; --line: #dde2e7; --paper: #f4f6f8;
  --card: #ffffff; --accent: #0072b2; --mark: #e8f2f9; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ec; --soft: #9aa5b0; --line: #343b43; --paper: #16191d; --card: #1f242a; --accent: #56b4e9; --mark: #20323f; }
}
* { box-sizing: border-box; }
html { color-scheme: light dark; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 17px/1.5 "DejaVu Sans", Verdana, "Segoe UI", sans-serif; }
main { max-width: 1320px; margin: 0 auto; padding: 40px 32px 64px; }
h1 { font-size: 34px; line-height: 1.2; margin: 0 0 6px; }
h2 { font-size: 23px; margin: 44px 0 12px; padding-top: 18px; border-top: 1px solid var(--line); }
p { max-width: 90ch; margin: 8px 0; }
.subtitle { color: var(--soft); margin: 0 0 22px; }
.lead { background: var(--mark); border-left: 5px solid var(--accent); border-radius: 4px; padding: 14px 22px; margin: 20px 0; font-size: 20px; }
.lead p { margin: 7px 0; }
.lead + .lead { margin-top: -12px; }
.lead strong { color: var(--accent); margin-right: 8px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 6px 24px; margin: 12px 0; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 18px 0; background: var(--card); border: 1px solid var(--line); border-radius: 6px; overflow: hidden; }
figure > svg { display: block; width: 100%; height: auto; background: #ffffff; }
figcaption { padding: 9px 16px; color: var(--soft); font-size: 15px; border-top: 1px solid var(--line); }
.pair figure { margin: 0; }
.pair { margin: 18px 0; display: grid; grid-template-columns: repeat(auto-fit, minmax(480px, 1fr)); gap: 18px; }
.wide { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 6px; margin: 14px 0; }
table { border-collapse: collapse; width: 100%; font-size: 14px; font-variant-numeric: tabular-nums; }
caption { white-space: normal; text-align: left; padding: 10px 14px; color: var(--soft); }
th { text-align: left; border-bottom: 2px solid var(--line); padding: 0; vertical-align: bottom; }
th button { all: unset; cursor: pointer; display: block; box-sizing: border-box; width: 100%; padding: 9px 10px;
  font-weight: bold; font-size: 13px; line-height: 1.3; }
th button:hover, th button:focus-visible { background: var(--mark); }
th button:focus-visible, input:focus-visible, summary:focus-visible { outline: 2px solid var(--accent); outline-offset: -2px; }
th button::after { content: "\2195"; color: var(--line); padding-left: 5px; }
th[aria-sort="ascending"] button::after { content: "\2191"; color: var(--accent); }
th[aria-sort="descending"] button::after { content: "\2193"; color: var(--accent); }
td { padding: 6px 10px; border-bottom: 1px solid var(--line); }
tbody tr:last-child td { border-bottom: 0; }
tbody tr:hover { background: var(--mark); }
.number { text-align: right; }
td.number, td.strong, td.name { white-space: nowrap; }
.strong { font-weight: bold; }
.strips, .sheet { display: grid; gap: 12px; grid-template-columns: repeat(auto-fill, minmax(min(100%, 290px), 1fr)); }
.sheet { grid-template-columns: repeat(auto-fill, minmax(min(100%, 230px), 1fr)); gap: 8px; }
.strip, .sheet figure { margin: 0; }
.strip figcaption { color: var(--ink); font-weight: bold; }
.sheet figcaption { padding: 4px 10px; font-size: 13px; }
img { display: block; width: 100%; height: auto; }
[hidden] { display: none !important; }
.none { display: block; padding: 60px 12px; text-align: center; color: var(--soft); }
.controls { position: sticky; bottom: 0; display: flex; gap: 16px; align-items: center; background: var(--card);
  border: 1px solid var(--line); border-radius: 6px; padding: 10px 16px; margin-top: 12px; }
.controls input { flex: 1; accent-color: var(--accent); }
.controls output { min-width: 15ch; text-align: right; font-variant-numeric: tabular-nums; }
.play { all: unset; cursor: pointer; font-size: 18px; width: 1.6em; text-align: center; color: var(--accent); }
details { margin: 12px 0; }
summary { cursor: pointer; color: var(--accent); }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 6px; padding: 14px; overflow-x: auto;
  font: 14px/1.45 "DejaVu Sans Mono", Menlo, Consolas, monospace; white-space: pre-wrap; overflow-wrap: anywhere; }
@media print { body { background: #ffffff; } .controls { position: static; } figure, .wide { break-inside: avoid; } }
)";

inline constexpr std::string_view kPageScript = R"("use strict";
// A column's cells in order; cells without a value come last either way.
function sortBy(table, column, ascending) {
  const body = table.tBodies[0], rows = Array.from(body.rows);
  const key = row => { const cell = row.cells[column]; return cell.dataset.value !== undefined ? Number(cell.dataset.value) : cell.textContent; };
  const numbers = rows.some(row => typeof key(row) === "number");
  const missing = k => numbers ? typeof k !== "number" : k === "";
  rows.sort((a, b) => {
    const x = key(a), y = key(b);
    if (missing(x) || missing(y)) return missing(x) - missing(y);
    const order = numbers ? x - y : String(x).localeCompare(String(y), "en", { numeric: true });
    return ascending ? order : -order;
  });
  rows.forEach(row => body.appendChild(row));
  Array.from(table.tHead.rows[0].cells).forEach((head, c) =>
    head.setAttribute("aria-sort", c !== column ? "none" : ascending ? "ascending" : "descending"));
}
for (const table of document.querySelectorAll("table"))
  Array.from(table.tHead.rows[0].cells).forEach((head, column) =>
    head.querySelector("button").addEventListener("click", () => sortBy(table, column, head.getAttribute("aria-sort") !== "ascending")));

for (const scrubber of document.querySelectorAll(".scrubber")) {
  const slider = scrubber.querySelector("input"), output = scrubber.querySelector("output"), play = scrubber.querySelector(".play");
  const moments = Array.from(scrubber.querySelectorAll("ol li"), item => item.textContent);
  const frames = Array.from(scrubber.querySelectorAll("[data-frame]"));
  const show = () => {
    for (const frame of frames) frame.hidden = frame.dataset.frame !== slider.value;
    output.textContent = moments[Number(slider.value)] || "";
  };
  let timer = 0;
  const stop = () => { clearInterval(timer); timer = 0; play.textContent = "\u25b6"; play.setAttribute("aria-label", "play"); };
  slider.addEventListener("input", () => { stop(); show(); });
  play.addEventListener("click", () => {
    if (timer) return stop();
    timer = setInterval(() => { slider.value = Number(slider.value) === Number(slider.max) ? 0 : Number(slider.value) + 1; show(); }, 125);
    play.textContent = "\u275a\u275a";
    play.setAttribute("aria-label", "pause");
  });
  show();
}
)";

}  // namespace app
