#!/usr/bin/env bash
# Prepares everything that examples/run.sh and tests/run.sh need, and nothing that is there already.
#
#   bash examples/setup.sh [--tests] [--bpy VERSION] [--venv FOLDER]
#
# Debian packages (installed by apt-get as root or through sudo), a virtual environment in .venv/ with Blender's Python
# module bpy and the tools to build with, and in it the native core, built anew whenever its sources have changed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bpy=5.0.1
venv=.venv
tests=0
while [ $# -gt 0 ]; do
  case $1 in
    --tests) tests=1 ;;
    --bpy) bpy=$2 && shift ;;
    --venv) venv=$2 && shift ;;
    *) echo "setup.sh: unknown option $1" >&2 && exit 2 ;;
  esac
  shift
done

# Compilers (Clang with its linker for faster code, GCC for its standard library) and what the core links, Python 3.11
# with its headers, and the X and GL libraries that bpy loads: EGL to draw Grease Pencil, where it
# ends the process without.
packages=(
  clang-19 lld-19 g++ cmake ninja-build libembree-dev libosd-dev libtbb-dev python3 python3-dev python3-venv ca-certificates
  libegl1 libgl1 libice6 libsm6 libx11-6 libxext6 libxfixes3 libxi6 libxkbcommon0 libxrender1 libxxf86vm1
)
[ $tests = 0 ] || packages+=(libgtest-dev ccache)

fail() {
  printf 'setup.sh: %s\n' "$*" >&2
  exit 1
}

install_system_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "Not a Debian system: taking it that the likes of these are installed: ${packages[*]}"
    return
  fi
  local missing=() package
  for package in "${packages[@]}"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || fail "these packages are missing, and there is no sudo: ${missing[*]}
  As root: apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  echo "Installing system packages: ${missing[*]}"
  local log
  log=$(mktemp)
  if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
    cat "$log" >&2
    fail "apt-get could not install: ${missing[*]}"
  fi
  rm -f "$log"
}

install_python_packages() { # install_python_packages NAME PACKAGE...: unless just these went in under this name before
  local stamp=$venv/.cistern-$1 && shift
  if [ "$(cat "$stamp" 2>/dev/null)" = "$*" ]; then return; fi
  echo "Installing into $venv: $* (some minutes)"
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "$@" || fail "pip could not install: $*
  Where your package index lacks bpy $bpy, set PIP_EXTRA_INDEX_URL to the one that Blender publishes its wheels on."
  printf '%s' "$*" >"$stamp"
}

make_environment() {
  local python
  python=$(command -v python3.11) || fail "bpy $bpy needs Python 3.11 exactly, and there is no python3.11 here"
  [ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
  # Some 400 MB to fetch. OpenImageIO and SciPy are pinned because later ones ask for a NumPy that bpy does not accept.
  install_python_packages packages "bpy==$bpy" "OpenImageIO==3.0.21.0" "scikit-build-core==1.1.2" "pybind11==3.1.0"
  [ $tests = 0 ] || install_python_packages test-packages \
    "pytest==9.2.0" "scipy==1.14.1" "ruff==0.17.5" "clang-format==14.0.6"
}

build_core() {
  local stamp=$venv/.cistern-core sources
  sources=$(find native CMakeLists.txt pyproject.toml -type f ! -name '*.md' -print0 | LC_ALL=C sort -z |
    xargs -0 sha256sum | sha256sum)
  # Tests use the objects of the module.
  if [ "$(cat "$stamp" 2>/dev/null)" = "$sources" ] && "$venv/bin/python" -c 'import cistern_core' 2>/dev/null &&
    { [ $tests = 0 ] || [ -f build/core/CMakeCache.txt ]; }; then
    return
  fi
  echo "Building the core (some minutes)"
  rm -f "$stamp"
  # Else scikit-build-core takes the compiler that Python was built with.
  local version
  for version in -19 ''; do
    if [ -z "${CXX:-}" ] && command -v "clang++$version" >/dev/null; then export CC=clang$version CXX=clang++$version; fi
  done
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall \
    --config-settings=build-dir=build/core . || fail "the core could not be built"
  printf '%s' "$sources" >"$stamp"
}

install_system_packages
make_environment
build_core
