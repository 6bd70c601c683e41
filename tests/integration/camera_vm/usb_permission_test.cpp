// USB cameras that only root may use: a device with the IDs of a depth camera of OpenNI2, and one with the interface
// class of USB3 Vision, as seen by the libraries' own drivers.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "capture/error.h"
#include "capture/live/aravis/source.h"
#include "capture/live/camera_list.h"
#include "capture/live/openni/source.h"
#include "tests/capture/child_process.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
constexpr uid_t kNobody = 65534;

class UsbPermission : public testing::Test {
 protected:
  /// Returns when the system has the device.
  void plug(const char* vendor, const char* product, const char* interface_class, const char* subclass) {
    process_.emplace(std::vector<std::string>{LUMIGRAFT_USB_SHELL, vendor, product, interface_class, subclass});
    const auto begin = std::chrono::steady_clock::now();
    while (!is_there(product) && std::chrono::steady_clock::now() - begin < 20s) {
      std::this_thread::sleep_for(20ms);
    }
    ASSERT_TRUE(process_->running() && is_there(product));
  }
  template <typename Function>
  static auto as_nobody(const Function& function) {
    EXPECT_EQ(seteuid(kNobody), 0);
    const auto result = function();
    EXPECT_EQ(seteuid(0), 0);
    return result;
  }
  template <typename Open>
  static std::string fault_of(const Open& open) {
    try {
      open();
    } catch (const CameraFault& e) {
      return e.what();
    }
    return "no fault";
  }
  /// Why the first listed camera of this kind cannot be opened.
  static std::string rejection_reason(const std::vector<CameraListing>& all, const std::string& source) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.source.rfind(source, 0) == 0; });
    return found == all.end() ? "not listed" : found->rejection_reason;
  }

  static constexpr char kSays[] = "found no permission to use it, allowed: root and whom the rules of udev let use it";

 private:
  /// After its configuration was selected, so that its interfaces exist.
  static bool is_there(const std::string& product) {
    for (const auto& entry : std::filesystem::directory_iterator("/sys/bus/usb/devices")) {
      std::ifstream in(entry.path() / "idProduct");
      std::string is;
      if (in >> is && is == product) {
        return std::filesystem::exists(entry.path() / (entry.path().filename().string() + ":1.0"));
      }
    }
    return false;
  }

  std::optional<test::ChildProcess> process_;
};

TEST_F(UsbPermission, OfADepthCamera) {
  plug("1d27", "0600", "ff", "00");  // PrimeSense
  const StreamSpec spec{.stream = Stream::color, .width = 640, .height = 480};
  const auto open = [&] { OpenNiSource source(OpenNiSource::Kind::device, "", {spec}); };
  EXPECT_EQ(as_nobody([&] { return fault_of(open); }), std::string("openni2:: ") + kSays);
  EXPECT_EQ(as_nobody([] { return rejection_reason(list_openni_cameras(), "openni2:1d27/0600@"); }), kSays);
  EXPECT_EQ(fault_of(open).find("openni2:: found nothing OpenNI2 can open: "), 0u) << "root gets another fault";
}

TEST_F(UsbPermission, OfACameraOfUsb3Vision) {
  const StreamSpec spec{.stream = Stream::color, .width = 640, .height = 480};
  const auto open = [&] { AravisSource source("Maker-0001", spec); };
  EXPECT_EQ(fault_of(open).find("aravis:Maker-0001: found no such camera that answers: "), 0u) << "no such camera";
  plug("1d6b", "0103", "ef", "05");
  EXPECT_EQ(as_nobody([&] { return fault_of(open); }),
            std::string("aravis:Maker-0001: found no such camera but one of USB3 Vision: ") + kSays);
  EXPECT_EQ(as_nobody([] { return rejection_reason(list_aravis_cameras(), "aravis:"); }), kSays);
  EXPECT_EQ(rejection_reason(list_aravis_cameras(), "aravis:Maker-0001").find(kSays), std::string::npos)
      << "root finds it";
}

}  // namespace
}  // namespace lumigraft::capture
