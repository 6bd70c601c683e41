// usb_shell VENDOR PRODUCT CLASS SUBCLASS (hexadecimal): a device on the emulated USB port with these IDs and this
// interface class, and no function.
#include <cstdio>
#include <cstdlib>

#include "tests/integration/camera_vm/usb_port.h"

using namespace lumigraft::test;

namespace {

std::uint8_t low(unsigned long number) { return static_cast<std::uint8_t>(number); }
std::uint8_t high(unsigned long number) { return static_cast<std::uint8_t>(number >> 8); }

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    return 2;
  }
  const auto number = [&](int word) { return std::strtoul(argv[word], nullptr, 16); };
  constexpr std::uint8_t kTotalLength = 18;  // bytes of the whole configuration
  Bytes configuration, device;
  add(configuration, {USB_DT_CONFIG, kTotalLength, 0, 1, 1, 0, 0xC0, 50});
  add(configuration, {USB_DT_INTERFACE, 0, 0, 0, low(number(3)), low(number(4)), 0, 0});
  add(device, {USB_DT_DEVICE, 0x00, 0x02, 0xEF, 2, 1, 64, low(number(1)), high(number(1)), low(number(2)),
               high(number(2)), 0x00, 0x01, 1, 2, 3, 1});
  UsbPort port(configuration, configuration, device);
  if (!port.plugged()) {
    std::perror("/dev/gadget");
    return 1;
  }
  raise_priority(2);
  std::puts("plugged");
  std::fflush(stdout);
  port.serve(
      [&port](const usb_ctrlrequest& q) {
        const bool standard = (q.bRequestType & USB_TYPE_MASK) == USB_TYPE_STANDARD;
        if (standard && (q.bRequest == USB_REQ_SET_CONFIGURATION || q.bRequest == USB_REQ_SET_INTERFACE)) {
          port.acknowledge();
        } else if (standard && q.bRequest == USB_REQ_GET_DESCRIPTOR && q.wValue >> 8 == USB_DT_STRING) {
          port.reply_text(q, {"", "Maker", "Shell", "0001"});
        } else {
          port.refuse(q);
        }
      },
      [] {});
  return 0;
}
