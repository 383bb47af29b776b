"""What the scripts beside this one share: options, rounds in turns with `umbel bake`, and a JSON report on stdout."""

import argparse
import contextlib
import importlib.metadata
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time


def options(description):
    """Options of every script."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("scene", type=pathlib.Path, help="an OBJ file")
    parser.add_argument("--rays", type=int, default=64, help="per vertex or texel (default 64)")
    parser.add_argument("--repeat", type=int, default=5, help="rounds that count; one more goes before them")
    parser.add_argument("--umbel", metavar="FILE", help="the program umbel; without it the peer is timed alone")
    parser.add_argument("--threads", type=int, help="of umbel (default: all processors)")
    return parser


def require(module, package):
    """Imports a module, or says how to get it."""
    try:
        return __import__(module)
    except (ImportError, OSError) as error:
        sys.exit(f"{package} is not usable here: {error}\nIt comes from PyPI: pip install {package}")


@contextlib.contextmanager
def elsewhere():
    """Sends what libraries print to stderr: stdout carries the report only."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def timed(work):
    """The milliseconds of a call, and its value."""
    with elsewhere():
        start = time.perf_counter()
        value = work()
        ms = (time.perf_counter() - start) * 1e3
    return ms, value


def umbel_bake(args, job):
    """The milliseconds of umbel's engine for a bake, by its own report."""
    with tempfile.TemporaryDirectory() as folder:
        out, report = pathlib.Path(folder, "out.npy"), pathlib.Path(folder, "report.json")
        command = [args.umbel, "bake", args.scene, "-o", out, *job, "--rays", args.rays, "--report", report, "-q"]
        if args.threads is not None:
            command += ["--threads", args.threads]
        run = subprocess.run([str(part) for part in command], stderr=subprocess.PIPE, text=True)
        if run.returncode != 0:
            sys.exit(f"umbel bake failed with exit code {run.returncode}:\n{run.stderr}")
        return statistics.median(json.loads(report.read_text())["ms"]["engine"])


def compare(args, package, work, job, facts):
    """Times the peer and umbel in turns. `facts(value)` tells what the peer's call has computed."""
    peer, umbel, value = [], [], None
    for round in range(args.repeat + 1):
        ms, value = timed(work)
        own = umbel_bake(args, job) if args.umbel else None
        if round > 0:
            peer.append(ms)
            umbel += [own] if args.umbel else []
    report = {
        "schema": 1,
        "peer": package,
        "version": importlib.metadata.version(package),
        "machine": platform.machine(),
        "python": platform.python_version(),
        "scene": args.scene.stem,
        "rays": args.rays,
        **facts(value),
        "ms": {"peer": peer, "umbel": umbel},
        "median_ms": {
            "peer": statistics.median(peer),
            "umbel": statistics.median(umbel) if umbel else None,
        },
    }
    if umbel:
        report["ratio"] = report["median_ms"]["peer"] / report["median_ms"]["umbel"]
    print(json.dumps(report, indent=2))
