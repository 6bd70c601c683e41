#!/usr/bin/env bash
# openni_with_coverage.sh INTO: builds INTO/libOpenNI2.so.0 and its driver for recordings from the source in apt, with
# libFuzzer's coverage and AddressSanitizer.
set -euo pipefail
mkdir -p "$1"
into=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

mkdir -p lists/partial
key=/usr/share/keyrings/debian-archive-keyring.gpg
echo "deb-src [signed-by=$key] http://deb.debian.org/debian bookworm main" >sources.list
apt=(apt-get -q -o Dir::Etc::SourceList="$work/sources.list" -o Dir::Etc::SourceParts=/dev/null
  -o Dir::State::lists="$work/lists" -o APT::Sandbox::User=root)
"${apt[@]}" update
"${apt[@]}" source --download-only --tar-only openni2
tar -xf openni2_*.orig.tar.* --strip-components=1

flags=(-g -O1 -fPIC -w -msse3 -std=gnu++11 -DOPENNI2_EXPORT -fno-omit-frame-pointer -fsanitize=fuzzer-no-link,address
  -IInclude -IThirdParty/PSCommon/XnLib/Include -IThirdParty/PSCommon/XnLib/Source -ISource/Core
  -ISource/Drivers/OniFile -ISource/Drivers/OniFile/Formats)
objects() {
  local folder=$1 file
  shift
  mkdir -p "$folder"
  for file in "$@"; do
    case $file in *USB* | *Matrix3x3*) continue ;; esac
    clang++ "${flags[@]}" -c "$file" -o "$folder/$(basename "$file").o"
  done
}
objects base ThirdParty/PSCommon/XnLib/Source/*.cpp ThirdParty/PSCommon/XnLib/Source/Linux/*.cpp
objects formats Source/Drivers/OniFile/Formats/*.cpp
objects core Source/Core/*.cpp
objects player Source/Drivers/OniFile/*.cpp
link=(-shared -fsanitize=fuzzer-no-link,address -Wl,-Bsymbolic -ljpeg -lpthread -ldl -lrt)
drivers=$into/OpenNI2/Drivers
mkdir -p "$drivers"
clang++ core/*.o formats/*.o base/*.o -o "$into/libOpenNI2.so.0" -Wl,-soname,libOpenNI2.so.0 "${link[@]}"
clang++ player/*.o formats/*.o base/*.o -o "$drivers/libOniFile.so" "${link[@]}"
