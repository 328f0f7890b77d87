#!/usr/bin/env bash
# Renew the pinned versions in requirements/ from pyproject.toml, without index or file addresses in them.
set -euo pipefail
cd "$(dirname "$0")/.."
python=.venv/bin/python
"$python" -m pip install --quiet pip-tools
compile() {
  out=$1
  shift
  CUSTOM_COMPILE_COMMAND="make requirements" "$python" -m piptools compile --quiet --strip-extras --no-emit-index-url \
    --no-emit-find-links --no-emit-trusted-host --no-emit-options --output-file "requirements/$out" "$@" pyproject.toml
}
compile run.txt
compile dev.txt --constraint requirements/run.txt --extra dev
# rosbags asks for it before Python 3.14 alone, and it cannot be installed on later ones.
sed -i -E 's/^(backports-zstd==[^ ;]+).*/\1 ; python_version < "3.14"/' requirements/dev.txt
compile bench.txt --constraint requirements/run.txt --extra bench
compile nightly.txt --constraint requirements/run.txt --constraint requirements/dev.txt --extra nightly
compile docs.txt --constraint requirements/run.txt --constraint requirements/dev.txt --extra docs
