"""What a measurement was made with: processor, memory, system, versions, the compiler."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def machine() -> dict[str, str]:
    """Processor, cores, memory, system, Python, and how busy it is now."""
    about = {
        "processor": _line("/proc/cpuinfo", r"model name\s*:\s*(.+)")
        or platform.processor()
        or platform.machine(),
        "cores": str(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
    }
    memory = _line("/proc/meminfo", r"MemTotal:\s*(\d+) kB")
    if memory:
        about["memory"] = f"{int(memory) / 2**20:.0f} GiB"
    if hasattr(os, "getloadavg"):
        about["load before"] = f"{os.getloadavg()[0]:.1f}"
    return about


def versions(packages: Iterable[str]) -> dict[str, str]:
    """The installed versions; what is not installed says so."""
    out = {}
    for package in packages:
        try:
            out[package] = version(package)
        except PackageNotFoundError:
            out[package] = "not installed"
    return out


def compiler() -> str | None:
    """The C++ compiler's own first line, or None where there is none."""
    found = shutil.which("g++") or shutil.which("clang++")
    if found is None:
        return None
    told = subprocess.run([found, "--version"], capture_output=True, text=True, check=False).stdout
    return told.splitlines()[0] if told else None


def _line(path: str, pattern: str) -> str | None:
    file = Path(path)
    if not file.is_file():
        return None
    found = re.search(pattern, file.read_text())
    return found.group(1).strip() if found else None
