#!/usr/bin/env bash
# last_release.sh: the commit of the last release. That is the newest version tag before this commit or, in a clone
# without tags, the commit that dated the newest dated version in CHANGELOG.md. Nothing where there was none, or where the
# clone does not reach back.
set -euo pipefail
cd "$(dirname "$0")/.."
tag=$(git tag --merged HEAD --sort=-version:refname | grep -E '^v?[0-9]+\.[0-9]+' | head -1 || true)
if [ -n "$tag" ]; then
  git rev-parse "$tag^{commit}"
  exit
fi
[ "$(git rev-parse --is-shallow-repository)" = false ] || exit 0
dated=$(grep -E -m1 '^## \[?[0-9]+\.[0-9]+.*[0-9]{4}-[0-9]{2}-[0-9]{2}' CHANGELOG.md || true)
[ -z "$dated" ] || git log -1 --format=%H -S"$dated" -- CHANGELOG.md
