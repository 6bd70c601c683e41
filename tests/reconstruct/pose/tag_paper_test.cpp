// The tag's paper is as large as its family says.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <utility>

#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/math/tag_family.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {
namespace {

/// A tag of 0.1 m on a metal plate.
capture::Session on_metal(const char* family, const std::filesystem::path& folder) {
  const std::filesystem::path mesh = folder / "plate.ply";
  std::ofstream(mesh) << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                         "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                         "-1 -1 0\n1 -1 0\n0 1 0\n3 0 1 2\n";
  capture::Session session;
  session.tag.family = family;
  session.tag.size_m = 0.1;
  capture::RealSurface plate;
  plate.mesh = mesh;
  plate.metallic = 1;
  session.real_surfaces = {plate};
  return session;
}

TEST(TagPaper, HidesMetalAsFarAsTheFamilySays) {
  const auto folder = std::filesystem::temp_directory_path() / "lumigraft_tag_paper_test";
  std::filesystem::create_directories(folder);
  // Cells across the print over those across the black square.
  for (const auto& [family, ratio] : {std::pair("tag36h11", 10.0 / 8), {"tag25h9", 9.0 / 7}, {"tag16h5", 8.0 / 6}}) {
    SCOPED_TRACE(family);
    const MetalMask metal(on_metal(family, folder));
    const float edge_m = static_cast<float>(0.05 * ratio);
    EXPECT_FALSE(metal.contains({0.99f * edge_m, 0, 0}));
    EXPECT_TRUE(metal.contains({1.01f * edge_m, 0, 0}));
  }
  std::filesystem::remove_all(folder);
}

TEST(TagPaper, IsAsLargeAsThePrintOfTheDetector) {
  for (const char* family : {"tag36h11", "tag36h10", "tag25h9", "tag16h5", "tagStandard41h12", "tagCircle21h7"}) {
    SCOPED_TRACE(family);
    const capture::Tag tag{.family = family, .id = 1, .size_m = 0.1};
    const TagFinder finder(tag);
    const TagPattern& pattern = finder.pattern();
    EXPECT_DOUBLE_EQ(print_edge_m(tag), 0.1 * pattern.cells / pattern.square_cells);
  }
  EXPECT_DOUBLE_EQ(print_edge_m({.family = "tag16h5", .size_m = 0.06}), 0.08);
}

}  // namespace
}  // namespace lumigraft::reconstruct
