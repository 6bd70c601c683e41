#pragma once
// Device tests run on both backends, one device of each kind for all tests of a suite, with the validation layer or
// debug output on.
#include <gtest/gtest.h>

#include <cstring>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

// Generated from tests/relight/gpu/shaders.
std::span<const ShaderCode> device_test_shaders();

class DeviceTest : public testing::TestWithParam<Backend> {
 protected:
  DeviceTest() {
    if (backend_ != GetParam()) device_.reset();
    if (!device_) device_ = create_device(GetParam(), {.validation = true, .more_shaders = device_test_shaders()});
    backend_ = GetParam();
  }
  static void TearDownTestSuite() { device_.reset(); }

  template <typename T>
  std::unique_ptr<Buffer> buffer_with(const std::vector<T>& values, std::string_view name) {
    auto buffer = device_->create_buffer(values.size() * sizeof(T), name);
    device_->upload(*buffer, 0, std::as_bytes(std::span(values)));
    return buffer;
  }

  inline static std::unique_ptr<Device> device_;

 private:
  inline static Backend backend_ = Backend::best;
};

inline std::string backend_label(const testing::TestParamInfo<Backend>& info) {
  return std::string(gpu::name_of(info.param));
}
#define ON_BOTH_DEVICES(suite)                                                                                         \
  INSTANTIATE_TEST_SUITE_P(                                                                                            \
      On, suite, testing::Values(::lumigraft::relight::gpu::Backend::vulkan, ::lumigraft::relight::gpu::Backend::egl), \
      ::lumigraft::relight::gpu::backend_label)

template <typename T>
std::vector<T> values_of(const std::vector<std::byte>& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  return values;
}

/// Runs `action` and returns the text of the error it throws.
template <typename Error, typename Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace lumigraft::relight::gpu
