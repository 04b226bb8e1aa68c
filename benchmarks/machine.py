"""Describes the machine of a measurement: what decides its speed, nothing that identifies it."""

import importlib.metadata
import os
import platform
from collections.abc import Iterable
from pathlib import Path


def cpu_model() -> str:
    """The processor's name, the cores this process may use, and its widest vector unit."""
    lines = _cpuinfo()
    model = lines.get("model name") or platform.processor() or platform.machine()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    flags = lines.get("flags", "").split()
    vectors = next((name for flag, name in _VECTORS.items() if flag in flags), "")
    return ", ".join(part for part in (model, f"{cores} core{'s' * (cores != 1)}", vectors) if part)


_VECTORS = {"avx512f": "AVX-512", "avx2": "AVX2", "avx": "AVX"}


def _cpuinfo() -> dict[str, str]:
    """The first processor's lines where the system lists them (Linux), else nothing."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return {}
    first = text.split("\n\n")[0]
    pairs = (line.split(":", 1) for line in first.splitlines() if ":" in line)
    return {name.strip(): value.strip() for name, value in pairs}


def versions(packages: Iterable[str]) -> dict[str, str]:
    """The installed version of each package; packages without one are left out."""
    found = {}
    for package in packages:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def software(found: dict[str, str]) -> str:
    """One line: system, Python, and the given versions."""
    parts = [f"{platform.system()} {platform.machine()}", f"Python {platform.python_version()}"]
    return ", ".join(parts + [f"{name} {version}" for name, version in found.items()])
