#!/usr/bin/env bash
# check_format.sh [--fix]: checks that all C++ files are formatted according to .clang-format; --fix formats them.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  "") how=(--dry-run -Werror) ;;
  --fix) how=(-i) ;;
  *) echo "usage: $0 [--fix]" >&2; exit 2 ;;
esac
find capture reconstruct relight server tests \( -name '*.cpp' -o -name '*.h' \) -print0 | xargs -0 clang-format "${how[@]}"
