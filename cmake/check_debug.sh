#!/usr/bin/env bash
# check_debug.sh [--minutes N]: builds without optimization, where no function is inlined and Eigen checks its use, and
# runs the tests of capture, reconstruct and server. Left out are relight's, which render, and suites that solve whole
# rooms: each takes minutes here; and tests that limit how long the optimized program takes to end. Every 16th test runs
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
timeout --signal=INT "${minutes:-0}m" cmake --build --preset debug --target capture_tests reconstruct_tests server_tests || {
  status=$?
  [ $status -eq 124 ] || exit $status
  echo "Debug build: not finished after $minutes minutes, all of its tests left out"
  exit 0
}

left_out='^Program\.|^(AlbedoStage|RepeatedSolutions|IncrementalSolver|UnobservedOccluders|LightFromShading|SceneBuilder)\.'
stride=16
log=build/debug/check_debug.log
for ((pass = 1; pass <= stride; ++pass)); do
  if [ -n "$minutes" ] && [ $SECONDS -ge $((60 * minutes)) ]; then
    echo "Debug build: left out after $minutes minutes: $((stride - pass + 1)) of every $stride tests"
    break
  fi
  if ! ctest --test-dir build/debug --parallel "$(nproc)" --output-on-failure --no-tests=ignore --quiet --output-log "$log" \
      --label-regex '^(capture|reconstruct|server)$' --exclude-regex "$left_out" \
      --tests-information "$pass,,$stride"; then
    cat "$log"
    exit 1
  fi
done
echo "Debug build: $((pass - 1)) of every $stride tests passed"
