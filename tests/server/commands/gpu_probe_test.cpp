#include "server/commands/gpu_probe.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

namespace lumigraft::server {
namespace {

std::string loaded_libraries() {
  std::ifstream maps("/proc/self/maps");
  return {std::istreambuf_iterator<char>(maps), {}};
}

TEST(GpuProbe, SaysWhatDeviceThereIsAndLoadsNoDriverOfIt) {
  if (loaded_libraries().find("libLLVM") != std::string::npos) GTEST_SKIP() << "a test before has loaded the drivers";
  const bool only_software = only_software_device(relight::gpu::Backend::best);
  EXPECT_EQ(loaded_libraries().find("libLLVM"), std::string::npos);
  EXPECT_EQ(only_software, relight::gpu::create_device(relight::gpu::Backend::best, {})->is_software());
}

}  // namespace
}  // namespace lumigraft::server
