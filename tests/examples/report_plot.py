#!/usr/bin/env python3
"""Tests examples/report/plot.py: report_plot.py PLOT. Needs matplotlib, as that does."""

import copy
import json
import os
import re
import subprocess
import sys
import tempfile

PLOT = sys.argv[1]
FOLDER = tempfile.TemporaryDirectory(prefix="nook-plot-")
# Nothing of the user's own settings, and nothing left in a home.
ENVIRONMENT = {**os.environ, "MPLCONFIGDIR": FOLDER.name}


def fail(what):
    sys.exit(f"report_plot.py: {what}")


def check(condition, what):
    if not condition:
        fail(what)


def path(name):
    return os.path.join(FOLDER.name, name)


def content(name):
    with open(path(name), "rb") as file:
        return file.read()


def write(name, text):
    with open(path(name), "w", encoding="utf-8") as file:
        file.write(text)
    return path(name)


def run(*arguments):
    return subprocess.run([sys.executable, PLOT, *arguments], env=ENVIRONMENT, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120)


def refuses(words, *arguments):
    """Exit code 2, one line on stderr with these words, and no file more than before."""
    before = sorted(os.listdir(FOLDER.name))
    result = run(*arguments)
    said = result.stderr
    check(result.returncode == 2, f"{arguments}: exit code {result.returncode}, not 2: {said}")
    check(said.count("\n") == 1 and said.endswith("\n"), f"{arguments}: not one line: {said}")
    for word in words:
        check(word in said, f"{arguments}: no {word!r} in: {said}")
    check(result.stdout == "", f"{arguments}: wrote to stdout: {result.stdout}")
    check(sorted(os.listdir(FOLDER.name)) == before, f"{arguments}: left a file behind")


def result_of(kernel, setting, time, error, slow=False, row_step=1):
    errors = {"rmse": error, "mae": error, "bias": 0, "p99": error, "max": error, "pixels": 9,
              "ssim": 1 - error, "fitted_rmse": error / 2, "rank_correlation": 1 - error}
    return {"id": f"{kernel}-{setting}", "kernel": kernel, "meaning": "visibility",
            "slow": slow, "row_step": row_step, "error": errors,
            "timings": [{"threads": 1, "median": time}, {"threads": 4, "median": time / 3}]}


def cell_of(name, results):
    return {"id": name, "scene": name, "radius": 0.25, "width": 64, "height": 36,
            "references": [{"meaning": "visibility", "standard_error": 0.002}],
            "results": results}


def kernel_of(name, family, comparable):
    return {"name": name, "family": family, "comparable": comparable}


REPORT = {
    "format": 3,
    "kernels": [kernel_of("chebyshev-window", "depth", False),
                kernel_of("horizon", "surface", True), kernel_of("traced", "traced", True)],
    "cells": [
        cell_of("bowl", [
            result_of("chebyshev-window", "1", 0.5, 0.2),   # on the front: the fastest
            result_of("horizon", "2x4", 1, 0.1),            # on the front
            result_of("horizon", "3x3", 2, 0.1),            # not: slower and no closer
            result_of("horizon", "4x8", 3, 0.15),           # not
            result_of("traced", "4", 20, 0.05),             # on the front
            result_of("traced", "64", 20, 0.05),            # on it too: the same in both
            result_of("traced", "256", 300, 0.01),          # on the front
            result_of("traced", "slow", 9, 0.001, slow=True),
            result_of("traced", "rows", 9, 0.001, row_step=4)]),
        cell_of("empty", [result_of("horizon", "2x4", 1, 0), result_of("traced", "4", 9, 0)]),
    ],
}
FRONT = {"chebyshev-window-1", "horizon-2x4", "traced-4", "traced-64", "traced-256"}

report = write("report.json", json.dumps(REPORT))

# Whole files, of the kinds asked for, the same every time.
for attempt in ("one", "two"):
    done = run(report, "--cell", "bowl", "--cell", "empty", "--out", path(f"{attempt}.svg"),
               "--out", path(f"{attempt}.png"), "--out", path(f"{attempt}.pdf"))
    check(done.returncode == 0 and done.stderr == "" and done.stdout == "", f"fails: {done}")
for ending, start in (("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")):
    check(content(f"one.{ending}").startswith(start), f"the .{ending} is none")
    check(content(f"one.{ending}") == content(f"two.{ending}"), f"the .{ending} differs")
check(b"</svg>" in content("one.svg")[-10:], "the SVG has no end")
check(b"<dc:date>" not in content("one.svg"), "the SVG is dated")
check(not [name for name in os.listdir(FOLDER.name) if "part" in name], "left a part behind")

# Names of the front and of no other mark.
done = run(report, "--cell", "bowl", "--out", path("front.svg"))
check(done.returncode == 0, f"fails: {done}")
names = re.findall(r'id="bowl\.([^"]*)"', content("front.svg").decode())
check(sorted(names) == sorted(FRONT), f"the front is {names}")
done = run(report, "--cell", "bowl", "--no-names", "--out", path("bare.svg"))
check(done.returncode == 0 and b"bowl." not in content("bare.svg"), "names in spite of all")

# Another measure, and another number of threads, make another picture.
pictures = {content("front.svg")}
for extra in (["rank"], ["fitted_rmse", "--threads", "4"]):
    done = run(report, "--cell", "bowl", "--measure", *extra, "--out", path("other.svg"))
    check(done.returncode == 0 and done.stderr == "", f"{extra} fails: {done}")
    pictures.add(content("other.svg"))
check(len(pictures) == 3, "two measures look alike")

# Bad input: one line, and an older picture stays as it was.
older = content("one.svg")
bowl = ["--cell", "bowl", "--out", path("one.svg")]
refuses(["missing.json", "cannot read"], path("missing.json"), *bowl)
refuses(["cannot read"], FOLDER.name, *bowl)
refuses(["not JSON"], write("cut.json", json.dumps(REPORT)[:500]), *bowl)
refuses(["not JSON"], write("deep.json", "[" * 100000), *bowl)
with open(path("bytes.json"), "wb") as file:
    file.write(b"\xff\xfe\x00")
refuses(["not JSON"], path("bytes.json"), *bowl)
refuses(["not an object"], write("list.json", "[]"), *bowl)
refuses(["format", "1"], write("old.json", '{"format": 1}'), *bowl)
refuses(['"bowls"', "bowl, empty"], report, "--cell", "bowls", "--out", path("one.svg"))
refuses(["7 threads", "1, 4"], report, *bowl, "--threads", "7")
refuses(["obscurance", "visibility"], report, *bowl, "--meaning", "obscurance")
refuses(["--threads"], report, *bowl, "--threads", "0")
refuses(["--measure"], report, *bowl, "--measure", "psnr")
refuses(["--out", ".svg, .pdf, .png"], report, "--cell", "bowl", "--out", path("one.jpg"))
refuses(["--out"], report, "--cell", "bowl")
refuses(["--cell"], report, "--out", path("one.svg"))
refuses(["cannot write"], report, *bowl, "--out", path("nowhere/one.png"))
os.mkdir(path("folder.svg"))
refuses(["cannot write", "folder.svg"], report, "--cell", "bowl", "--out", path("folder.svg"))


def broken(change):
    other = copy.deepcopy(REPORT)
    change(other)
    return write("broken.json", json.dumps(other))


write("broken.json", "")
bad = ["cells[0].results[2]"]
result = lambda other: other["cells"][0]["results"][2]
refuses(bad + ["error", '"rmse"'], broken(lambda r: result(r)["error"].pop("rmse")), *bowl)
refuses(bad + ["finite"], broken(lambda r: result(r)["error"].update(rmse=float("nan"))), *bowl)
refuses(bad + ["number"], broken(lambda r: result(r)["error"].update(rmse="0.1")), *bowl)
refuses(bad + ["finite"], broken(lambda r: result(r)["error"].update(rmse=10**400)), *bowl)
refuses(bad + ["below 0"], broken(lambda r: result(r)["error"].update(rmse=-1)), *bowl)
refuses(bad + ["above 0"], broken(lambda r: result(r)["timings"][0].update(median=0)), *bowl)
refuses(bad + ["list"], broken(lambda r: result(r).update(timings=3)), *bowl)
refuses(bad + ["kernel"], broken(lambda r: result(r).update(kernel="unheard-of")), *bowl)
refuses(["family"], broken(lambda r: r["kernels"][1].update(family="unheard-of")), *bowl)
refuses(["standard_error"], broken(lambda r: r["cells"][0]["references"][0].clear() or
        r["cells"][0]["references"][0].update(meaning="visibility")), *bowl)
check(content("one.svg") == older, "an older picture was touched")
