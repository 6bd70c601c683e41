#!/usr/bin/env bash
# last_release.sh: prints the commit of the last release: the newest version tag before this commit or, in a clone
# without tags, the commit that added the newest date in CHANGELOG.md. Prints nothing if there is no release or the
# clone is too shallow.
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
