#!/usr/bin/env bash
# install_packages.sh run|test|check: installs the packages of packages.txt that are missing.
set -euo pipefail
list=$(dirname "$0")/../packages.txt

section() { sed -n "/^\\[$1\\]/,/^\\[/{/^[[#]/d; /^\$/d; p}" "$list"; }

# Prints those arguments that are not installed packages.
missing_of() {
  local installed package
  installed=$(dpkg-query -W -f '${Package} ${Status}\n' "$@" 2>/dev/null | sed -n 's/ install ok installed$//p' || true)
  for package in "$@"; do
    [[ $'\n'$installed$'\n' == *$'\n'$package$'\n'* ]] || echo "$package"
  done
}

install() {
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "$0: these Debian packages are missing and need root: $*" >&2; return 1; }
    as_root=(sudo)
  fi
  echo "Installing Debian packages: $*"
  "${as_root[@]}" apt-get update -q &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "$@"
}

case "${1:-}" in
  run) wanted=$(section run) ;;
  test) wanted=$(section run; section test) ;;
  check) wanted=$(section run; section test; section check) ;;
  *) echo "usage: $0 run|test|check" >&2; exit 2 ;;
esac
missing=$(missing_of $wanted)
[ -z "$missing" ] || install $missing
if [ "$1" != run ]; then
  missing=$(missing_of $(section vm))
  [ -z "$missing" ] || install $missing || echo "$0: without them tests on real camera drivers are skipped" >&2
fi
