#!/usr/bin/env bash
# check_format.sh [--fix]: whether every C++ file is formatted as .clang-format says; with --fix it is afterwards.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  "") how=(--dry-run -Werror) ;;
  --fix) how=(-i) ;;
  *) echo "usage: $0 [--fix]" >&2; exit 2 ;;
esac
find capture reconstruct relight server tests \( -name '*.cpp' -o -name '*.h' \) -print0 | xargs -0 clang-format "${how[@]}"
