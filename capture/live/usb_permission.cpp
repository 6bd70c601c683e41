#include "capture/live/usb_permission.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>

#include "capture/message_text.h"

namespace lumigraft::capture {
namespace {

namespace fs = std::filesystem;

/// Number in a file of /sys; -1 if there is none.
int number_in(const fs::path& file, int base) {
  std::ifstream in(file);
  int value = -1;
  in >> std::setbase(base) >> value;
  return in ? value : -1;
}

bool is_forbidden(int bus, int address) {
  const std::string node = formatted("/dev/bus/usb/%03d/%03d", bus, address);
  return faccessat(AT_FDCWD, node.c_str(), R_OK | W_OK, AT_EACCESS) != 0 && errno == EACCES;
}

}  // namespace

bool is_forbidden_usb_device(const std::string& uri) {
  unsigned vendor = 0, product = 0;
  int bus = 0, address = 0;
  return std::sscanf(uri.c_str(), "%x/%x@%d/%d", &vendor, &product, &bus, &address) == 4 && is_forbidden(bus, address);
}

bool is_forbidden_usb_interface(int interface_class, int subclass) {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/sys/bus/usb/devices", none)) {
    if (number_in(entry.path() / "bInterfaceClass", 16) != interface_class ||
        number_in(entry.path() / "bInterfaceSubClass", 16) != subclass) {
      continue;
    }
    const fs::path device = fs::canonical(entry.path(), none).parent_path();
    if (!none && is_forbidden(number_in(device / "busnum", 10), number_in(device / "devnum", 10))) return true;
  }
  return false;
}

}  // namespace lumigraft::capture
