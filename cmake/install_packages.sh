#!/usr/bin/env bash
# install_packages.sh run|test: installs what packages.txt names and this machine lacks.
set -euo pipefail
list=$(dirname "$0")/../packages.txt
case "${1:-}" in
  run) wanted=$(sed '/^\[test\]/,$d; /^[[#]/d; /^$/d' "$list") ;;
  test) wanted=$(sed '/^[[#]/d; /^$/d' "$list") ;;
  *) echo "usage: $0 run|test" >&2; exit 2 ;;
esac
installed=$(dpkg-query -W -f '${Package} ${Status}\n' $wanted 2>/dev/null | sed -n 's/ install ok installed$//p' || true)
missing=()
for package in $wanted; do
  [[ $'\n'$installed$'\n' == *$'\n'$package$'\n'* ]] || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "$0: these Debian packages are missing and need root: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing Debian packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
