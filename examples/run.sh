#!/usr/bin/env bash
# Renders a .blend file, or the demo scene, with Cistern.
#
#   bash examples/run.sh [FILE.blend] [options] [SETTING=VALUE ...]
#
# The first run prepares the machine (see examples/setup.sh); `--help` lists the options. Pictures go to out/.
# CISTERN_RUN_LIMIT=SECONDS ends a render that takes longer, whose picture is lost.
set -euo pipefail
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

bash "$repository/examples/setup.sh"

# The user's Blender settings stay out of the render, and temporary files go however it ends.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
limit=${CISTERN_RUN_LIMIT:-0}  # 0: none
status=0
TMPDIR=$scratch BLENDER_USER_RESOURCES=$scratch timeout --foreground -k 5 "$limit" \
  "$repository/.venv/bin/python" "$repository/examples/render.py" "$@" || status=$?
if [ $status = 124 ]; then
  echo "run.sh: stopped after $limit s, as CISTERN_RUN_LIMIT says" >&2
fi
exit $status
