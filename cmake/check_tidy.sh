#!/usr/bin/env bash
# check_tidy.sh [--all] [--minutes N]: runs clang-tidy on the files that differ from the last release, or on all files;
# .clang-tidy lists the checks. A header is checked with its source file. Files with the most changed lines come first.
# Files that are not started within N minutes are left out and listed.
set -euo pipefail
cd "$(dirname "$0")/.."
all= minutes=
while [ $# -gt 0 ]; do
  case "$1" in
    --all) all=yes ;;
    --minutes) minutes=$2; shift ;;
    *) echo "usage: $0 [--all] [--minutes N]" >&2; exit 2 ;;
  esac
  shift
done

cmake --preset tidy >/dev/null
folder=build/tidy/clang-tidy
rm -rf "$folder"
mkdir "$folder"

# All compiled files except generated ones.
sed -n "s#^ *\"file\": \"$PWD/\(.*\)\"\$#\1#p" build/tidy/compile_commands.json | grep -v '^build/' | sort -u >"$folder/sources"

# Lines "COUNT PATH" of C++ files that differ from commit $1.
changed_since() {
  local added deleted path
  git diff --numstat -z -M -l0 "$1" -- '*.cpp' '*.h' | while IFS=$'\t' read -r -d '' added deleted path; do
    if [ -z "$path" ]; then  # renamed: both names follow
      read -r -d '' path
      read -r -d '' path
    fi
    [ "$((added + deleted))" -eq 0 ] || echo "$((added + deleted)) $path"
  done
  git ls-files -z --others --exclude-standard -- '*.cpp' '*.h' | xargs -0 -r wc -l | sed '/ total$/d; s/^ *//'
}

# The source file with which file $1 is checked.
source_of() {
  local same=${1%.*}.cpp
  if grep -qxF "$same" "$folder/sources"; then
    echo "$same"
  elif [[ $1 == *.h ]]; then
    xargs grep -lF "#include \"$1\"" <"$folder/sources" | head -1 || true
  fi
}

release=$([ -n "$all" ] || cmake/last_release.sh)
if [ -z "$release" ]; then
  echo "clang-tidy: all files"
  cp "$folder/sources" "$folder/wanted"
else
  echo "clang-tidy: files that differ from the last release, $(git log -1 --format='%h of %as' "$release")"
  changed_since "$release" | sort -rn | while read -r _ path; do source_of "$path"; done | awk '!seen[$0]++' >"$folder/wanted"
fi

deadline=$([ -z "$minutes" ] || echo $(($(date +%s) + 60 * minutes)))
check() {
  local said
  if [ -n "$deadline" ] && [ "$(date +%s)" -ge "$deadline" ]; then
    echo "$1" >>"$folder/left_out"
  elif said=$(clang-tidy --quiet -p build/tidy "$1" 2>&1); then
    echo "$1" >>"$folder/clean"
  else
    printf '%s\n' "$said" | sed '/ warnings* .*generated/d'
    echo "$1" >>"$folder/failed"
  fi
}
export folder deadline
export -f check
touch "$folder"/{clean,failed,left_out}
xargs -r -n 1 -P "$(nproc)" bash -c 'check "$1"' check <"$folder/wanted"

count() { wc -l <"$folder/$1"; }
echo "clang-tidy: $(count clean) files without a finding, $(count failed) with findings, $(count left_out) left out"
[ ! -s "$folder/left_out" ] || { echo "Left out after $minutes minutes:"; sort "$folder/left_out" | sed 's/^/  /'; }
[ ! -s "$folder/failed" ] || { echo "With findings:"; sort "$folder/failed" | sed 's/^/  /'; exit 1; }
