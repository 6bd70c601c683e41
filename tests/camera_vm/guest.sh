#!/usr/bin/env bash
# guest.sh KERNEL_ROOT PROGRAM ARGS...: runs in the machine. Loads the drivers and tests them with PROGRAM.
set -uo pipefail
root=$1
shift

# A camera of the single-planar kind and one of the multi-planar kind, both as webcams are.
modprobe -d "$root" vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0x0,0x0 multiplanar=1,2
# What udev makes of a USB camera.
mkdir -p /dev/v4l/by-id
ln -s ../../video0 /dev/v4l/by-id/usb-Maker_Camera_0123-video-index0
# A port of the USB that leads back into this machine, for the camera that the tests plug in.
for module in dummy_hcd gadgetfs uvcvideo; do
  modprobe -d "$root" $module
done
mkdir -p /dev/gadget
mount -t gadgetfs gadgetfs /dev/gadget
echo "up after $(cut -d' ' -f1 /proc/uptime) s"
"$@" --gtest_color=no && echo "all passed after $(cut -d' ' -f1 /proc/uptime) s"
