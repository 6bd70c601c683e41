#!/usr/bin/env bash
# check_odr.sh: whether every name in the program is defined once. Links it with what the linker sees of all its types
# and fails where two files define one name differently.
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset odr >/dev/null
cmake --build --preset odr
