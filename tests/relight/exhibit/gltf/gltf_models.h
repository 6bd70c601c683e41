#pragma once
// What tests of glTF files share: loading from a temporary folder, and comparing vertices.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "capture/error.h"
#include "relight/exhibit/exhibit.h"
#include "tests/capture/formats/coded_pictures.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {

/// z is up, so that coordinates are those of the file.
inline std::shared_ptr<const relight::Model> loaded(const std::string& bytes, const std::string& name = "a.gltf") {
  const TemporaryFolder folder;
  return relight::load_model(folder.write(name, bytes), 'z');
}

/// The message of the refusal, without the file's path; empty if there is none.
inline std::string refusal_of(const std::string& bytes, const std::string& name = "a.gltf") {
  const TemporaryFolder folder;
  const std::string path = folder.write(name, bytes).string();
  try {
    relight::load_model(path, 'z');
  } catch (const capture::InputError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(path + ": ")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message.substr(path.size() + 2);
  }
  return "";
}

/// The positions of the corners of all triangles, in order.
inline std::vector<Eigen::Vector3f> corners_of(const relight::Model& model) {
  std::vector<Eigen::Vector3f> corners;
  for (const std::uint32_t i : model.indices) corners.push_back(model.positions_m[i]);
  return corners;
}

inline ::testing::AssertionResult same(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b,
                                       float tolerance = 1e-5f) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " are not " << b.size();
  for (std::size_t i = 0; i < a.size(); ++i) {
    if ((a[i] - b[i]).cwiseAbs().maxCoeff() > tolerance)
      return ::testing::AssertionFailure() << i << ": " << a[i].transpose() << " is not " << b[i].transpose();
  }
  return ::testing::AssertionSuccess();
}

inline std::size_t vertex_at(const relight::Model& model, const Eigen::Vector3f& p) {
  for (std::size_t v = 0; v < model.positions_m.size(); ++v) {
    if ((model.positions_m[v] - p).norm() < 1e-4f) return v;
  }
  ADD_FAILURE() << "no vertex at " << p.transpose();
  return 0;
}

/// A picture of one colour, in the format of a file name's extension.
inline std::string picture_bytes(std::string_view extension, int width, int height, std::array<std::uint8_t, 3> rgb) {
  capture::Image<std::uint8_t> picture(width, height, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) picture.data[i] = rgb[i % 3];
  return extension == ".jpg" ? jpeg_bytes(picture) : extension == ".webp" ? webp_bytes(picture) : png_bytes(picture);
}

}  // namespace lumigraft::test
