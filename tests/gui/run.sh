#!/usr/bin/env bash
# Tests of the 3D viewport in a real Blender with windows.
#
#   bash tests/gui/run.sh [SCENARIO...]        default: everyday properties toggles final_renders bake quit_while_rendering
#
# CISTERN_BLENDER   Blender's executable (default: `blender` on the path)
# CISTERN_CORE      folder with a cistern_core built for the Python of that Blender, unless it is installed there
# CISTERN_GUI_OUT   folder for logs and screenshots (default: out/gui)
#
# Needs a display, or Xvfb; xdotool and ImageMagick's `import`. Says so and succeeds where there is no such Blender.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

blender=${CISTERN_BLENDER:-blender}
out=${CISTERN_GUI_OUT:-out/gui}
for tool in "$blender" xdotool import; do
  command -v "$tool" >/dev/null || { echo "GUI tests left out: there is no '$tool'" && exit 0; }
done
if [ -z "${DISPLAY:-}" ]; then
  command -v xvfb-run >/dev/null || { echo "GUI tests left out: neither a display nor xvfb-run" && exit 0; }
  exec xvfb-run -a -s "-screen 0 1280x800x24 +extension GLX" bash "$0" "$@"
fi

mkdir -p "$out"
CISTERN_GUI_OUT=$(readlink -f "$out")
export CISTERN_GUI_OUT
failed=()
for scenario in ${@:-everyday properties toggles final_renders bake quit_while_rendering}; do
  log=$CISTERN_GUI_OUT/$scenario.log
  start=$SECONDS
  status=0
  timeout -k 10 "${CISTERN_GUI_SECONDS:-600}" "$blender" --factory-startup --gpu-backend opengl \
    --window-geometry 0 0 1280 800 --python "tests/gui/$scenario.py" >"$log" 2>&1 || status=$?
  if [ $status = 0 ] && grep -q '^GUI PASSED' "$log" && ! grep -q -e '^Traceback' -e 'Error:' "$log"; then
    echo "$scenario passed ($((SECONDS - start)) s)"
  else
    echo "$scenario FAILED with status $status ($((SECONDS - start)) s); see $log"
    failed+=("$scenario")
  fi
done
[ ${#failed[@]} = 0 ]
