#!/usr/bin/env bash
# Make a virtual environment with PYTHON at DIR, on a machine that may lack the venv module's parts.
set -euo pipefail
python=$1
dir=$2
"$python" - <<'PY' || exit 1
import sys
if sys.version_info < (3, 11):
    sys.exit(f"lampyris needs Python 3.11 or later; this is {sys.version.split()[0]} (try: make PYTHON=python3.11)")
PY
if ! "$python" -m venv "$dir" >/dev/null 2>&1; then
  # Debian ships ensurepip apart.
  version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "installing python$version-venv ..."
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "python$version-venv" >/dev/null
    "$python" -m venv "$dir"
  else
    echo "cannot make a virtual environment: install python$version-venv and run this again" >&2
    exit 1
  fi
fi
