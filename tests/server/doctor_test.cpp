#include "server/doctor.h"

#include <gtest/gtest.h>

#include <sstream>

#include "relight/gpu/device.h"

namespace lumigraft {
namespace {

TEST(Doctor, EveryDeviceHasALineAndOneDraws) {
  std::ostringstream out;
  EXPECT_TRUE(write_doctor_report(out)) << out.str();
  for (const gpu::DeviceListing& device : gpu::list_devices()) {
    const std::string line = "  " + std::string(gpu::name_of(device.backend)) + ": " + device.name + ": ";
    EXPECT_NE(out.str().find(line + (device.why_not.empty() ? "ok, " : "cannot be used: ")), std::string::npos)
        << out.str();
  }
  const std::string draws = "  GPU: ok, " + std::string(gpu::name_of(gpu::best_backend())) + " draws unless";
  EXPECT_NE(out.str().find(draws), std::string::npos) << out.str();
}

}  // namespace
}  // namespace lumigraft
