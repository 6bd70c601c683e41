#!/usr/bin/env bash
# guest.sh KERNEL_ROOT V4L2_TESTS LIBCAMERA_TESTS ARGS...: runs in the virtual machine; loads the drivers and runs the
# tests.
set -uo pipefail
root=$1
v4l2_tests=$2
libcamera_tests=$3
shift 3

# A single-planar and a multi-planar webcam, and a frame grabber with the inputs webcam and HDMI, two bits per input.
modprobe -d "$root" vivid n_devs=3 node_types=0x1,0x1,0x1 num_inputs=1,1,2 input_types=0x0,0x0,0xc multiplanar=1,2,1
# The link that udev creates for a USB camera.
mkdir -p /dev/v4l/by-id
ln -s ../../video0 /dev/v4l/by-id/usb-Maker_Camera_0123-video-index0
# An emulated USB port for the camera that the tests plug in.
for module in dummy_hcd gadgetfs uvcvideo; do
  modprobe -d "$root" $module
done
mkdir -p /dev/gadget
mount -t gadgetfs gadgetfs /dev/gadget
echo "up after $(cut -d' ' -f1 /proc/uptime) s"
"$v4l2_tests" --gtest_color=no "$@" || exit 1

# libcamera names a webcam by its path in the firmware's tables. The emulated port has none, so /sys is extended by one.
mkdir /run/sys
mount -t tmpfs sys /run/sys
for folder in /sys/*; do
  mkdir "/run/sys/$(basename "$folder")"
  mount --rbind "$folder" "/run/sys/$(basename "$folder")"
done
mkdir /run/sys/firmware_node
echo '\_SB_.USB0' >/run/sys/firmware_node/path
mount --move /run/sys /sys
# libcamera accepts only cameras that udev has announced.
modprobe -d "$root" vimc
mkdir -p /run/udev
/lib/systemd/systemd-udevd --daemon
udevadm trigger --subsystem-match=media --subsystem-match=video4linux
udevadm settle -t 20
# A test starts libcamera's helper, which lies beside the test program, as a user who may not be let into the build folder.
programs=/run/programs
install -D -m 755 -t "$programs" "$libcamera_tests" "$(dirname "$libcamera_tests")/lumigraft_libcamera"
"$programs/$(basename "$libcamera_tests")" --gtest_color=no "$@" && echo "all passed after $(cut -d' ' -f1 /proc/uptime) s"
