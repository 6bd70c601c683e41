#pragma once
// Reads organised point clouds from PCD files (binary_compressed) with the fields x y z and optionally label.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace lumigraft::test {

struct PointCloud {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> points;  ///< camera frame, metres; z = 0: no measurement
  std::vector<std::uint32_t> labels;    ///< empty if the file has none
};

/// Decompresses LZF as PCL writes it (Lehmann's liblzf): runs of literals and back references.
inline std::vector<char> unpack_lzf(const std::vector<char>& packed, std::size_t size) {
  std::vector<char> out;
  out.reserve(size);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(packed.at(i)); };
  for (std::size_t i = 0; i < packed.size();) {
    const unsigned control = byte(i++);
    if (control < 32) {
      for (unsigned n = 0; n <= control; ++n) out.push_back(packed.at(i++));
      continue;
    }
    unsigned length = control >> 5;
    if (length == 7) length += byte(i++);
    std::size_t from = out.size() - ((control & 31u) << 8) - 1;
    from -= byte(i++);
    for (unsigned n = 0; n < length + 2; ++n) out.push_back(out.at(from++));
  }
  if (out.size() != size) throw std::runtime_error("a cloud that does not unpack to its size");
  return out;
}

inline PointCloud read_cloud(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  PointCloud cloud;
  std::vector<std::string> fields;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "WIDTH") words >> cloud.width;
    if (key == "HEIGHT") words >> cloud.height;
    if (key == "FIELDS")
      for (std::string name; words >> name;) fields.push_back(name);
    if (key == "DATA") break;
  }
  std::array<std::uint32_t, 2> sizes{};
  in.read(reinterpret_cast<char*>(sizes.data()), sizeof(sizes));
  std::vector<char> packed(sizes[0]);
  in.read(packed.data(), static_cast<std::streamsize>(packed.size()));
  const std::vector<char> data = unpack_lzf(packed, sizes[1]);  // field after field, four bytes each
  const std::size_t count = static_cast<std::size_t>(cloud.width) * cloud.height;
  cloud.points.assign(count, Eigen::Vector3f::Zero());
  for (std::size_t f = 0; f < fields.size(); ++f) {
    const char* const column = &data.at(4 * count * f);
    for (int axis = 0; axis < 3; ++axis) {
      if (fields[f] != std::string(1, static_cast<char>('x' + axis))) continue;
      for (std::size_t i = 0; i < count; ++i) std::memcpy(&cloud.points[i][axis], column + 4 * i, 4);
    }
    if (fields[f] != "label") continue;
    cloud.labels.resize(count);
    std::memcpy(cloud.labels.data(), column, 4 * count);
  }
  for (Eigen::Vector3f& point : cloud.points)
    if (!point.allFinite()) point.setZero();
  return cloud;
}

}  // namespace lumigraft::test
