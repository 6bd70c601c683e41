#include "server/commands/views_file.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

reconstruct::KeyframeMap::Views one_view() {
  reconstruct::Keyframe view;
  view.features.pixels = {{10, 20}, {30, 40}};
  view.features.sigma_px = {1, 1.2f};
  view.features.descriptors = capture::Image<std::uint8_t>(reconstruct::ViewFeatures::kDescriptorBytes, 2, 1, 7);
  view.features.small = {0.6f, -0.8f};
  view.points_m = {{0.1f, 0.2f, 1}, {0.3f, 0.4f, 2}};
  return {std::make_shared<const reconstruct::Keyframe>(view)};
}

TEST(ViewsFileTest, SurvivesARestartAndKeepsWhatItCannotUse) {
  const TinySession folder("views");
  const fs::path file = views_file_of(folder.folder / "kiosk.toml");
  EXPECT_EQ(file, folder.folder / "kiosk.views.yml.gz");
  capture::Session session;
  session.color.model.width = 64;
  session.color.model.height = 48;
  ViewsFile first(file, session);
  EXPECT_EQ(first.message(), "");
  EXPECT_EQ(first.save(one_view()), "");
  const ViewsFile second(file, session);
  ASSERT_EQ(second.views().size(), 1u);
  EXPECT_EQ(second.views()[0]->points_m, one_view()[0]->points_m);
  EXPECT_EQ(second.message(), file.string() + ": 1 views of the room, as kept before");

  capture::Session other = session;
  other.tag.id = 3;
  ViewsFile refused(file, other);
  EXPECT_TRUE(refused.views().empty());
  EXPECT_NE(refused.message().find("world: found"), std::string::npos) << refused.message();
  EXPECT_EQ(refused.save(one_view()), "");
  EXPECT_TRUE(fs::exists(file.string() + ".unused")) << "the other room's views";
  EXPECT_EQ(ViewsFile(file, other).views().size(), 1u);
}

TEST(ViewsFileTest, AFailedSaveIsReportedOnce) {
  const TinySession folder("views-absent");
  ViewsFile views(folder.folder / "absent" / "kiosk.views.yml.gz", capture::Session());
  EXPECT_NE(views.save(one_view()).find("views of the room cannot be saved: "), std::string::npos);
  EXPECT_EQ(views.save(one_view()), "");
}

}  // namespace
}  // namespace lumigraft::server
