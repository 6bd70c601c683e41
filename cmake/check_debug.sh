#!/usr/bin/env bash
# check_debug.sh [--minutes N]: builds without optimization, where no function is inlined and Eigen checks its use, and
# runs the tests of capture, reconstruct and server. Left out are relight's, which render, and suites that solve whole
# rooms: each takes minutes here; and tests that limit how long the optimized program takes to end. Every 16th suite runs
# first, then the ones after these, and so on until N minutes, the build among them, are over; it says how much was left
# out, also where the build alone takes longer.
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=
case "${1:-}" in
  "") ;;
  --minutes) minutes=$2 ;;
  *) echo "usage: $0 [--minutes N]" >&2; exit 2 ;;
esac
cmake --preset debug >/dev/null

# Runs a command for the time that is left; exits with 124 where that is over.
within_time() {
  local left=0  # no limit
  if [ -n "$minutes" ]; then
    left=$((60 * minutes - SECONDS))
    [ $left -gt 0 ] || return 124
  fi
  timeout --signal=INT "$left" "$@"
}

status=0
within_time cmake --build --preset debug --target capture_tests reconstruct_tests server_tests || status=$?
if [ $status -eq 124 ]; then
  echo "Debug build: not finished after $minutes minutes, all of its tests left out"
  exit 0
fi
[ $status -eq 0 ] || exit $status

left_out='[.](Program|AlbedoStage|RepeatedSolutions|IncrementalSolver|UnobservedOccluders|LightFromShading|SceneBuilder)$'
stride=16
log=$PWD/build/debug/check_debug.log
for ((pass = 1; pass <= stride; ++pass)); do
  within_time ctest --test-dir build/debug --parallel "$(nproc)" --output-on-failure --no-tests=ignore --quiet \
    --output-log "$log" --label-regex '^(capture|reconstruct|server)$' --exclude-regex "$left_out" \
    --tests-information "$pass,,$stride" || status=$?
  if [ $status -eq 124 ]; then
    echo "Debug build: left out after $minutes minutes: $((stride - pass + 1)) of every $stride suites"
    break
  elif [ $status -ne 0 ]; then
    cat "$log"
    exit 1
  fi
done
echo "Debug build: $((pass - 1)) of every $stride suites passed"
