#include "server/commands/doctor.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>
#include <utility>

#include "relight/gpu/device.h"

namespace lumigraft::server {
namespace {

TEST(Doctor, EveryDeviceHasALineAndOneDraws) {
  std::ostringstream out;
  EXPECT_TRUE(write_doctor_report(out)) << out.str();
  for (const relight::gpu::DeviceListing& device : relight::gpu::list_devices()) {
    const std::string line = "  " + std::string(relight::gpu::name_of(device.backend)) + ": " + device.name + ": ";
    EXPECT_NE(out.str().find(line + (device.rejection_reason.empty() ? "ok, " : "cannot be used: ")), std::string::npos)
        << out.str();
  }
  const std::string draws =
      "  GPU: ok, " + std::string(relight::gpu::name_of(relight::gpu::best_backend())) + " draws unless";
  EXPECT_NE(out.str().find(draws), std::string::npos) << out.str();
}

/// The program's report with these environment variables, and whether it succeeds.
std::pair<std::string, bool> doctor_with(const std::string& variables) {
  FILE* const pipe = popen(("env " + variables + " " LUMIGRAFT_PROGRAM " doctor 2>&1").c_str(), "r");
  std::string text;
  for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) text += static_cast<char>(c);
  return {text, pclose(pipe) == 0};
}

// The variables hide the drivers from the loaders, as if not installed.
TEST(Doctor, SaysWhatIsMissingAndWhy) {
  const std::string no_vulkan = "VK_ICD_FILENAMES=/nowhere.json", no_egl = "__EGL_VENDOR_LIBRARY_FILENAMES=/nowhere";
  const std::string vulkan_line = "vulkan: Vulkan: cannot be used: no Vulkan device: no driver is installed",
                    egl_line = "egl: EGL: cannot be used: no EGL device";
  {
    const auto [text, good] = doctor_with(no_vulkan);
    EXPECT_TRUE(good) << text;
    EXPECT_NE(text.find(vulkan_line), std::string::npos) << text;
    EXPECT_NE(text.find("; VK_ICD_FILENAMES is /nowhere.json\n"), std::string::npos) << text;
    EXPECT_NE(text.find("GPU: ok, egl draws"), std::string::npos) << text;
  }
  {
    const auto [text, good] = doctor_with(no_egl);
    EXPECT_TRUE(good) << text;
    EXPECT_NE(text.find(egl_line), std::string::npos) << text;
    EXPECT_NE(text.find("GPU: ok, vulkan draws"), std::string::npos) << text;
  }
  const auto [text, good] = doctor_with(no_vulkan + " " + no_egl);
  EXPECT_FALSE(good) << text;
  EXPECT_NE(text.find(vulkan_line), std::string::npos) << text;
  EXPECT_NE(text.find(egl_line), std::string::npos) << text;
  EXPECT_NE(text.find("\n  GPU: cannot be used: no usable GPU"), std::string::npos) << text;
  EXPECT_EQ(text.find("GPU: ok"), std::string::npos) << text;
}

}  // namespace
}  // namespace lumigraft::server
