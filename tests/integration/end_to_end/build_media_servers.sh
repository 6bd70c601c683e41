#!/usr/bin/env bash
# build_media_servers.sh FOLDER: builds go2rtc and MediaMTX of these versions into FOLDER, for watch_page_test.py.
#
#   LUMIGRAFT_MEDIA_SERVERS=FOLDER ctest -R watch_page
#
# Needs Go 1.24 or later (Debian 12 has 1.19) and the Go module proxy. Without them it says so and exits with 1.
set -euo pipefail
folder=$(realpath -m "${1:?usage: $0 FOLDER}")
export CGO_ENABLED=0 GOFLAGS=-mod=mod GOTOOLCHAIN=local

found=$(go env GOVERSION 2>/dev/null) || { echo "$0: go is not installed, 1.24 or later is needed" >&2; exit 1; }
printf '%s\n' go1.24 "$found" | sort -VC || { echo "$0: found $found, 1.24 or later is needed" >&2; exit 1; }
work=$(mktemp -d)
trap 'chmod -R u+w "$work"; rm -rf "$work"' EXIT
mkdir -p "$folder"

# A copy of a module's source, which Go keeps read-only.
source_of() {
  (cd "$work" && rm -f go.mod && go mod init download 2>/dev/null && go mod download -json "$1") |
    sed -n 's/^\t"Dir": "\(.*\)",$/\1/p'
}

build() {
  local name=$1 module=$2 prepare=${3:-true} source
  source=$(source_of "$module") && [ -n "$source" ] || { echo "$0: the module proxy does not give $module" >&2; exit 1; }
  cp -r "$source" "$work/$name"
  chmod -R u+w "$work/$name"
  (cd "$work/$name" && $prepare && go build -o "$folder/$name" .)
  echo "$folder/$name"
}

# Files that a release of MediaMTX generates. The player of HLS is not used here.
generate_mediamtx() {
  echo v1.13.1 > internal/core/VERSION
  : > internal/servers/hls/hls.min.js
}

build go2rtc github.com/AlexxIT/go2rtc@v1.9.9
build mediamtx github.com/bluenviron/mediamtx@v1.13.1 generate_mediamtx
