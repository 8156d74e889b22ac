#!/usr/bin/env bash
# From a bare clone to a result, without prompts, on Debian 12 or Ubuntu 24.04, as root or with sudo.
#
#   cmake/setup.sh demo         install what is missing, build, render the demonstration
#   cmake/setup.sh test [PRESET...]   the same, and run the tests (of build presets: release, asan, tsan, dev, fuzz)
#   cmake/setup.sh deps         only install what is missing
#   cmake/setup.sh build [PRESET]     install and build
#   cmake/setup.sh bench        install, build and run the benchmarks
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  g++ cmake ninja-build ccache git ca-certificates
  libgdal-dev libgeographiclib-dev libeigen3-dev libtbb-dev proj-data
  pkg-config libdeflate-dev libzstd-dev liblzma-dev libjpeg-dev libwebp-dev liblerc-dev libpugixml-dev
  libfmt-dev libexpected-dev libyaml-cpp-dev nlohmann-json3-dev libcli11-dev libxxhash-dev libhwy-dev
  # Image files. OpenImageIO's CMake files name the tools, Python's Imath and OpenCV's headers.
  libopenimageio-dev openimageio-tools python3-imath libfreetype-dev fonts-dejavu-core
  # Maps behind URLs: headers to build with, and the library that is loaded when the first one is read (libcurl4 comes along)
  libcurl4-openssl-dev
  gnuplot-nox libtiff-dev libvips-tools libvips-dev libosmesa6-dev  # pictures of benchmarks, and peers in them
  # Tests and benchmarks
  libgtest-dev libgmock-dev libbenchmark-dev libboost-dev libopencv-core-dev libopencv-imgproc-dev libopencv-calib3d-dev
  gdal-bin python3-gdal python3-jsonschema nginx-light clang libclang-rt-dev valgrind
)

say() { printf '\n== %s\n' "$*"; }

as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"
  elif command -v sudo >/dev/null; then sudo -n "$@"
  else echo "setup.sh: installing needs root: run as root, or install sudo, or install by hand: ${packages[*]}" >&2; return 1
  fi
}

deps() {
  local missing=() package
  for package in "${packages[@]}"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} = 0 ] && return
  say "installing ${missing[*]}"
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq update
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "${missing[@]}" >/dev/null
}

build() {
  local preset=$1
  say "building ${preset}"
  cmake --preset "$preset" -Wno-dev >"/tmp/nadir-configure.$$" 2>&1 || { cat "/tmp/nadir-configure.$$" >&2; return 1; }
  grep -E '^-- NADIR_[A-Z]+: off' "/tmp/nadir-configure.$$" || true
  rm -f "/tmp/nadir-configure.$$"
  cmake --build --preset "$preset" --parallel "$(nproc)"
}

run_tests() {
  local preset
  for preset in "$@"; do
    build "$preset"
    say "testing ${preset}"
    # Under sanitizers the quick tests; slow ones there would say little more.
    case $preset in
      asan|tsan) quick_only=(-L quick) ;;
      fuzz) quick_only=(-L slow) ;;
      *) quick_only=() ;;
    esac
    ASAN_OPTIONS=detect_leaks=0 TSAN_OPTIONS="suppressions=$PWD/cmake/tsan.supp" \
      ctest --test-dir "build/$preset" --output-on-failure --parallel "$(nproc)" "${quick_only[@]}" --progress
  done
}

command=${1:-help}
shift || true
case $command in
  deps) deps ;;
  build) deps; build "${1:-release}" ;;
  demo) deps; build release; say "demonstration"; sim/demo/run.sh build/release/nadir build/demo ;;
  test) deps; run_tests "${@:-release}" ;;
  bench) deps; build release
    for suite in build/release/*_bench; do say "$suite"; "$suite"; done
    say "peak memory"; bench/render/memory.py "$PWD/build/release/nadir" "$PWD" ;;
  *) sed -n '2,9s/^# \{0,1\}//p' "$0"; [ "$command" = help ] ;;
esac
