#!/usr/bin/python3
"""docs/stability/cases.md and energy.svg from what `polypic verify` wrote.

    ./polypic verify --out out/verify && docs/stability/tables.py out/verify
"""
import json
import pathlib
import re
import sys

folder = pathlib.Path(sys.argv[1])
here = pathlib.Path(__file__).resolve().parent
found = json.loads((folder / "verify.json").read_text())

families = {}
for case in found["cases"]:
    families.setdefault(case["name"].split("/")[0], []).append(case)
lines = ["# Hard cases, as last run", "", f"{len(found['cases'])} cases: {found['passed']} pass, {found['failed']} fail. `docs/stability/tables.py` writes this page.", "",
         "| case | how many | case or page | must hold | tolerance | worst found |", "| --- | --- | --- | --- | --- | --- |"]
for name, cases in families.items():
    kinds = {}
    for c in cases:
        kinds.setdefault(re.sub(r'"[^"]*"', '"..."', c["expect"]), []).append(c)
    for expect, members in kinds.items():
        worst = max(members, key=lambda c: c["value"] / c["tolerance"] if c["tolerance"] else c["value"])
        tolerances = sorted({c["tolerance"] for c in members})
        shown = f"{tolerances[0]:g}" if len(tolerances) == 1 else f"{tolerances[0]:g} to {tolerances[-1]:g}"
        source = sorted({c["source"] for c in members})[0]
        failed = [c for c in members if not c["passed"]]
        lines.append(f"| {name.replace('_', ' ')} | {len(members)} | {source} | {expect.replace('|', '/')} | {shown} | {worst['value']:.3g}{' FAILS' if failed else ''} |")
lines += ["", "Not built, and counted apart:", "", "| case | needs |", "| --- | --- |"] + [f"| {c['name'].replace('_', ' ')} | {c['needs']} |" for c in found["not_built"]]
(here / "cases.md").write_text("\n".join(lines) + "\n")

page = (folder / "report.html").read_text()
part = page[page.index("spinning disk</h2>"):]
svg = re.search(r"<svg.*?</svg>", part, re.S).group(0)
(here / "energy.svg").write_text(svg if "xmlns=" in svg else svg.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"', 1))
