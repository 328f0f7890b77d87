#!/usr/bin/env bash
# Chromium, node and tsc for the tests of the page, from the distribution; `tools/browser.sh axe`: axe-core, too, by npm into
# build/axe. Without them those tests say that they were skipped.
set -uo pipefail
AXE=axe-core@4.14.1
if [ "${1:-}" = axe ] && [ ! -f build/axe/node_modules/axe-core/axe.min.js ]; then
  if ! command -v npm >/dev/null; then
    echo "there is no npm, so no $AXE: tests/app/test_page_axe.py will be skipped" >&2
  elif ! timeout 120 npm install --no-save --no-audit --no-fund --ignore-scripts --loglevel=error --prefix build/axe "$AXE" >/dev/null; then
    echo "npm could not install $AXE: tests/app/test_page_axe.py will be skipped" >&2
  fi
fi
missing=()
for one in chromium:chromium node:nodejs tsc:node-typescript; do
  command -v "${one%%:*}" >/dev/null || missing+=("${one##*:}")
done
[ ${#missing[@]} -eq 0 ] && exit 0
echo "installing ${missing[*]} ..."
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  { timeout 240 apt-get install -y -qq "${missing[@]}" || { timeout 120 apt-get update -qq && timeout 240 apt-get install -y -qq "${missing[@]}"; }; } >/dev/null 2>&1 && exit 0
  # Where one cannot be had, the others still can.
  left=()
  for one in "${missing[@]}"; do timeout 240 apt-get install -y -qq "$one" >/dev/null 2>&1 || left+=("$one"); done
  missing=("${left[@]}")
  [ ${#missing[@]} -eq 0 ] && exit 0
fi
echo "could not install ${missing[*]}: tests that need them will be skipped (apt-get install ${missing[*]})" >&2
