#!/usr/bin/env bash
# run.sh FOLDER V4L2_TESTS LIBCAMERA_TESTS ARGS...: boots Debian's kernel in QEMU, without KVM and without root, and runs
# guest.sh with these programs. The virtual machine sees the host's files read-only and writes to its memory. FOLDER
# keeps the kernel between runs. Exits with 77 if QEMU is not installed.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
folder=$1
shift
PATH=$PATH:/usr/sbin:/sbin

for tool in qemu-system-x86_64 busybox cpio depmod modprobe apt-get dpkg-deb; do
  command -v "$tool" >/dev/null || { echo "skipped: found no $tool (packages.txt, [vm]), so real camera drivers are not tested"; exit 77; }
done

newest_kernel() {
  apt-cache pkgnames linux-image-6.1.0- | grep -E '^linux-image-6\.1\.0-[0-9]+-amd64$' | sort -V | tail -1
}

# Unpacks into FOLDER/KERNEL the kernel and the modules that are used below.
fetch_kernel() {
  local package=$1 into=$2
  rm -rf "$into" "$into.partial"
  mkdir -p "$into.partial"
  (cd "$into.partial" && apt-get -q -o APT::Sandbox::User=root download "$package")
  local modules='./lib/modules/*/kernel'
  dpkg-deb --fsys-tarfile "$into.partial/$package"_*.deb |
    tar -x -C "$into.partial" --wildcards './boot/vmlinuz-*' './lib/modules/*/modules.*' "$modules/drivers/media/*" \
      "$modules/drivers/usb/*" "$modules/drivers/virtio/*" "$modules/net/9p/*" "$modules/fs/*"
  rm "$into.partial/$package"_*.deb
  depmod -b "$into.partial" "${package#linux-image-}"
  mv "$into.partial" "$into"
}

mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
package=$(newest_kernel || true)
if [ -z "$package" ] && [ "$(id -u)" -eq 0 ]; then
  apt-get -q update
  package=$(newest_kernel || true)
fi
kept=$(find "$folder" -maxdepth 1 -name 'linux-image-*-amd64' -printf '%f\n' | sort -V | tail -1)
package=${package:-$kept}
[ -n "$package" ] || { echo "found no kernel among apt's packages, allowed: linux-image-6.1.0-*-amd64 (apt-get update)"; exit 1; }
if [ ! -d "$folder/$package" ]; then
  find "$folder" -maxdepth 1 -name 'linux-image-*' -exec rm -rf {} +
  fetch_kernel "$package" "$folder/$package"
fi
kernel=${package#linux-image-}
root=$folder/$package
vimc=$root/lib/modules/$kernel/vimc
if [ ! -d "$vimc" ]; then
  if "$here/build_vimc.sh" "$kernel" "$vimc"; then
    depmod -b "$root" "$kernel"
  else
    echo "vimc is not built (packages.txt, [vm]), so libcamera is tested on a USB camera alone"
  fi
fi

# The initial file system: what is needed to mount the host's files.
first=$(mktemp -d)
trap 'rm -rf "$first"' EXIT
mkdir "$first"/{bin,dev,proc,sys,modules,host,new}
cp "$(command -v busybox)" "$first/bin/busybox"
cp "$here/init" "$first/init"
number=100
for module in virtio_pci 9p 9pnet_virtio overlay; do
  for file in $(modprobe -d "$root" -S "$kernel" --show-depends "$module" | awk '/^insmod/ {print $2}'); do
    name=$(basename "$file")
    compgen -G "$first/modules/*-$name" >/dev/null || cp "$file" "$first/modules/$((number++))-$name"
  done
done
# LUMIGRAFT_CYCLES: number of times that cameras are removed and return, for longer tests; a usual run takes less than
# three minutes.
cycles=${LUMIGRAFT_CYCLES:-}
limit_s=$([ -n "$cycles" ] && echo 6000 || echo 360)
printf '%q ' env ${cycles:+LUMIGRAFT_CYCLES="$cycles"} bash "$here/guest.sh" "$root" "$@" >"$first/command"
(cd "$first" && find . | cpio --quiet -o -H newc | gzip -1) >"$folder/first.gz"

log=$folder/log.txt
# One processor: see usb_camera.cpp.
timeout "$limit_s" qemu-system-x86_64 -accel tcg -cpu max -smp 1 -m 1024 -nodefaults -no-user-config -display none -no-reboot \
  -serial stdio -kernel "$root/boot/vmlinuz-$kernel" -initrd "$folder/first.gz" \
  -append "console=ttyS0 quiet panic=-1 mitigations=off tsc=unstable nokaslr" \
  -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap </dev/null 2>&1 | tee "$log"
grep -q '^all passed' "$log"
