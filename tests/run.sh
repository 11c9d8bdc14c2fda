#!/usr/bin/env bash
# Runs the tests: the core's own, Python over the binding, and Blender with the add-on.
#
#   bash tests/run.sh [--full]
#
# --full adds what takes long: tests marked slow, the cases that tests/conftest.py leaves out, twice the samples beside
# Cycles, the core's tests under the address and undefined-behaviour sanitizers, clang-tidy where it is installed, the
# Blender tests in Blender 4.2 and 4.5 too, and the extension in each Blender (which asks for Python 3.13).
#
# CISTERN_BLENDER names a Blender with windows, for --full to test viewports in (tests/gui/README.md); else that is left out.
# CISTERN_TEST_SCENES names a folder of further .blend files; tests that need them are skipped without it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

full=0
case "${1:-}" in
  '') ;;
  --full) full=1 ;;
  *) echo "usage: bash tests/run.sh [--full]" >&2 && exit 2 ;;
esac
[ $full = 0 ] || export CISTERN_FULL_TESTS=1

resources=$(mktemp -d)
trap 'stop_job; rm -rf "$resources"' EXIT
failed=()

part() { # part NAME COMMAND...: runs it, tells how long it took, remembers a failure and goes on
  local name=$1 start=$SECONDS
  shift
  echo "== $name"
  if "$@"; then
    echo "== $name passed ($((SECONDS - start)) s)"
  else
    echo "== $name FAILED ($((SECONDS - start)) s)"
    failed+=("$name")
  fi
}

native_tests() { # native_tests FOLDER [CMAKE_OPTION...]
  local folder=$1
  cmake -B "$@" >/dev/null && cmake --build "$folder" --target cistern_tests -- --quiet &&
    timeout -k 5 900 ctest --test-dir "$folder" --output-on-failure -j "$(nproc)" --timeout 300 | tail -n 15
}

python_tests() { # python_tests VENV SECONDS FOLDER: pytest in a process with a hard end, Blender's settings kept apart
  local venv=$1 limit=$2 folder=$3 marks="not slow"
  [ $full = 0 ] || marks="slow or not slow"
  BLENDER_USER_RESOURCES=$(mktemp -d -p "$resources") \
    timeout -k 5 "$limit" "$venv/bin/python" -m pytest -q -m "$marks" "$folder"
}

job='' # what runs beside
result_of_job() { # result_of_job LOG: waits for it, and prints what it wrote
  local status=0
  wait "$job" || status=$?
  job=''
  cat "$1"
  return $status
}
stop_job() { # its shell ends with what runs in it
  [ -z "$job" ] || kill $(cat "/proc/$job/task/$job/children") 2>/dev/null || :
}

tidy() { # without precompiled headers, which are another compiler's and hide that one is not included
  command -v clang-tidy >/dev/null || { echo "clang-tidy is not installed: left out" && return 0; }
  cmake --preset Release -B build/tidy -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null &&
    cmake --build build/tidy --target generated/albedo_tables.inc -- --quiet &&
    git ls-files -z 'native/*.cpp' ':!native/binding' | xargs -0 -n 4 -P "$(nproc)" clang-tidy --quiet -p build/tidy
}

bash examples/setup.sh --tests
if [ -z "${CISTERN_TEST_SCENES:-}" ]; then
  echo "CISTERN_TEST_SCENES is not set: tests on further scenes are skipped"
fi
limit=1500
[ $full = 0 ] || limit=7200

# Where the objects of the module are.
part "native tests" native_tests build/core -DCISTERN_BUILD_TESTS=ON "-Dpybind11_DIR=$(.venv/bin/python -m pybind11 --cmakedir)"
# Side by side: each leaves a core idle in turn.
python_tests .venv $limit tests/render >"$resources/render.log" 2>&1 &
job=$!
part "Blender 5.0 tests" python_tests .venv $limit tests/blender
part "render tests" result_of_job "$resources/render.log"
part "extension tests" python_tests .venv $limit tests/extension
if [ $full = 1 ]; then
  part "native tests under sanitizers" native_tests build/sanitize --preset Sanitize
  part "clang-tidy" tidy
  for version in 4.2.23 4.5.15; do
    venv=build/venv-${version%.*}
    part "Blender ${version%.*} set-up" bash examples/setup.sh --tests --bpy $version --venv "$venv"
    part "Blender ${version%.*} tests" python_tests "$venv" $limit tests/blender
  done
  if [ -n "${CISTERN_BLENDER:-}" ]; then part "viewports in windows" bash tests/gui/run.sh; else
    echo "CISTERN_BLENDER is not set: tests of viewports in windows are left out"
  fi
  part "extension in all versions" timeout -k 5 $limit .venv/bin/python -m tests.extension.matrix
fi

if [ ${#failed[@]} -gt 0 ]; then
  printf 'FAILED after %d s:' $SECONDS && printf ' %s;' "${failed[@]}" && echo
  exit 1
fi
echo "All tests passed in $SECONDS s"
