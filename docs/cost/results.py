"""Tables and plots of studies for docs/cost-of-accuracy.md: results.py FOLDER STUDIES SUBJECT..."""
import json
import pathlib
import re
import shutil
import sys

MEASURES = ["energy", "position", "vorticity", "velocity", "volume", "surface", "image"]


def number(value):
    return "" if value is None else f"{value:.2g}"


def sentence(text, name):
    return (text if text.startswith(name) else text[0].upper() + text[1:]) + "."


def seconds_to_error(case):
    times = case["seconds_to_error"]
    lines = [f"**{case['name']}.** " + " ".join(s for s in case["sentences"] if s), "", f"Seconds to an error of {case['decides']} of:", ""]
    lines.append("| scheme | " + " | ".join(f"{level:g}" for level in times["errors"]) + " |")
    lines.append("| --- |" + " --- |" * len(times["errors"]))
    for name, seconds in times["schemes"].items():
        cells = ["" if s is None else ("≤ " if bound else "") + f"{s:.3g}" for s, bound in zip(seconds, times["at_most"][name])]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines


def table(study, case):
    if "seconds_to_error" in case:
        return seconds_to_error(case)
    rows = [v for v in study["variants"] if v["case"] == case["name"]]
    shown = [m for m in MEASURES if any("error_" + m in v for v in rows)]
    lines = [f"**{case['name']}.** " + " ".join(s for s in case["sentences"] if s), ""]
    lines.append("| | variant | " + " | ".join("error of " + m for m in shown) + " | seconds | CPU seconds | MB |")
    lines.append("| --- | --- |" + " --- |" * (len(shown) + 3))
    for v in rows:
        if "failure" in v:
            lines.append(f"| | {v['variant']} | could not run: {v['failure']} |" + " |" * (len(shown) + 2))
            continue
        errors = " | ".join(number(v.get("error_" + m)) for m in shown)
        front = "*" if v["pareto"] else ""
        lines.append(f"| {front} | {v['variant']} | {errors} | {number(v['seconds_median'])} | {number(v['cpu_seconds'])} | {v['peak_bytes'] / 1e6:.0f} |")
    if case.get("noise"):
        lines += ["", "Another seed alone makes: " + ", ".join(f"{m} {number(e)}" for m, e in case["noise"].items()) + "."]
    return lines


def main():
    folder, studies, *subjects = sys.argv[1:]
    folder, studies = pathlib.Path(folder), pathlib.Path(studies)
    lines = ["# Results", "", "Written by docs/cost/make; [cost-of-accuracy.md](../cost-of-accuracy.md) says what they mean. `*`: on the Pareto front."]
    for subject in subjects:
        study = json.loads((studies / subject / "cost.json").read_text())
        if subject == subjects[0]:
            lines += ["", f"Measured on {study['machine']['processor']}, {study['machine']['cores']} cores, with {study['threads']} threads."]
        lines += ["", f"## {subject}", "", sentence(study["title"], subject), ""]
        command = re.sub(r" --(quiet|out \S+)", "", study["command"])
        lines += [f"    {command}", ""]
        lines += ["; ".join(f"{name.removeprefix('error_')}: {text}" for name, text in study["meaning"].items()) + "."]
        for note in study["notes"]:
            lines.append(note[0].upper() + note[1:] + ".")
        for case in study["cases"]:
            lines += [""] + table(study, case)
            slug = case["name"].replace(",", "").replace(" ", "_")
            found = sorted((studies / subject / "plots").glob(f"error_{case['decides']}*.svg"))
            own = [f for f in found if slug in f.name] or (found if len(study["cases"]) == 1 else [])
            if own:
                name = f"{subject}.svg" if "seconds_to_error" in case else f"{subject}.{slug}.svg"
                shutil.copyfile(own[0], folder / name)
                lines += ["", f"![Error of {case['decides']} against seconds]({name})"]
    text = re.sub(r"\d+\.\d{8,}", lambda long: f"{float(long[0]):.3g}", "\n".join(lines))
    (folder / "results.md").write_text(text + "\n")


if __name__ == "__main__":
    main()
