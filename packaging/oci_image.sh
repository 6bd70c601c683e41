#!/usr/bin/env bash
# Makes an OCI image of the program from its Debian package and those that it needs, and of nothing else:
#
#   cmake --build --preset release --target package
#   packaging/oci_image.sh build/release/lumigraft_0.2.0_amd64.deb IMAGE [SOURCES]
#
# IMAGE is the folder of an OCI layout, with the tag `latest`. SOURCES: an apt sources file instead of Debian's usual
# mirror. Needs root, and the Debian packages mmdebstrap and umoci. To run it:
#
#   skopeo copy oci:IMAGE:latest docker-daemon:lumigraft:latest      # or containers-storage: of podman
#   docker run --rm -p 127.0.0.1:8080:8080 lumigraft                 # the recording that comes with it
#   docker run --rm -p 8080:8080 -v /srv/kiosk:/var/lib/lumigraft --device /dev/dri --device /dev/video0 \
#     --group-add video --group-add render lumigraft serve --config /var/lib/lumigraft/kiosk.toml
set -euo pipefail
package=$(realpath "$1") image=$2 sources=("${@:3}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# systemd itself isn't needed, only what makes the user.
mmdebstrap --quiet --variant=minbase --include=systemd-standalone-sysusers \
  --aptopt='APT::Install-Recommends "false"' \
  --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/doc/*' \
  --dpkgopt='path-include=/usr/share/doc/*/copyright' --dpkgopt='path-exclude=/usr/share/locale/*' \
  --customize-hook="copy-in '$package' /tmp" \
  --customize-hook='chroot "$1" sh -c "apt-get install -y -q /tmp/lumigraft_*.deb >/dev/null && rm -f /tmp/*.deb"' \
  --customize-hook='rm -rf "$1"/var/lib/apt/lists/* "$1"/var/cache/apt/*' \
  bookworm "$work/root.tar" "${sources[@]}"

umoci init --layout "$image"
umoci new --image "$image:latest"
umoci raw add-layer --image "$image:latest" "$work/root.tar"
umoci config --image "$image:latest" --architecture "$(dpkg --print-architecture)" \
  --config.user lumigraft --config.workingdir /var/lib/lumigraft --config.volume /var/lib/lumigraft \
  --config.volume /var/cache/lumigraft --config.env XDG_CACHE_HOME=/var/cache/lumigraft \
  --config.exposedports 8080/tcp --config.stopsignal SIGTERM --config.entrypoint lumigraft \
  --config.cmd serve --config.cmd --session --config.cmd /usr/share/lumigraft/recordings/tabletop \
  --config.cmd --listen --config.cmd 0.0.0.0:8080
umoci gc --layout "$image"
echo "$image: $(du -sh "$image" | cut -f1)"
