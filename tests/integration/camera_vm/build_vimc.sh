#!/usr/bin/env bash
# build_vimc.sh KERNEL INTO: builds INTO/vimc.ko, which Debian's kernel packages lack, from the kernel's source against
# its headers. Both are downloaded with apt and unpacked without root.
set -euo pipefail
kernel=$1
into=$2
for tool in make gcc-12 xz; do
  command -v "$tool" >/dev/null || { echo "found no $tool"; exit 1; }
done
work=$into.partial
rm -rf "$work"
mkdir -p "$work"
trap 'rm -rf "$work"' EXIT
cd "$work"
version=$(apt-cache show "linux-image-$kernel" | sed -n 's/^Version: //p' | head -1)
apt-get -q -o APT::Sandbox::User=root download "linux-headers-$kernel" "linux-headers-${kernel%-amd64}-common" \
  linux-kbuild-6.1 "linux-source-6.1=$version"
for package in linux-headers-*.deb linux-kbuild-*.deb; do
  dpkg-deb -x "$package" "$work"
done
headers=$work/usr/src/linux-headers-$kernel
sed -i "s#/usr/src/#$work/usr/src/#" "$headers/Makefile"
dpkg-deb --fsys-tarfile linux-source-6.1_*.deb | tar -xO ./usr/src/linux-source-6.1.tar.xz |
  tar -xJ --strip-components=4 --wildcards '*/drivers/media/test-drivers/vimc/*'
sed -i 's/\$(CONFIG_VIDEO_VIMC)/m/' vimc/Makefile
make -s -C "$headers" M="$work/vimc" modules
rm -rf "$into"
mkdir "$into"
mv vimc/vimc.ko "$into"
