#!/usr/bin/env bash
# check_odr.sh: checks the one-definition rule. Links the program with the type information of link-time optimization
# and fails if two files define a name differently.
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset odr >/dev/null
cmake --build --preset odr
