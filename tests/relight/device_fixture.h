#pragma once
// One device for all tests of a program, with the validation layer on.
#include <gtest/gtest.h>

#include <cstring>

#include "relight/gpu/device.h"

namespace lumigraft::gpu {

// Generated from tests/relight/shaders.
std::span<const ShaderCode> device_test_shaders();

class DeviceTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    device_ = create_vulkan_device({.validation = true, .more_shaders = device_test_shaders()});
  }
  static void TearDownTestSuite() { device_.reset(); }

  template <typename T>
  std::unique_ptr<Buffer> buffer_with(const std::vector<T>& values, std::string_view name) {
    auto buffer = device_->create_buffer(values.size() * sizeof(T), name);
    device_->upload(*buffer, 0, std::as_bytes(std::span(values)));
    return buffer;
  }

  inline static std::unique_ptr<Device> device_;
};

template <typename T>
std::vector<T> values_of(const std::vector<std::byte>& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
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

}  // namespace lumigraft::gpu
