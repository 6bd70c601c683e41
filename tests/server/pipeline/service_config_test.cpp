#include "server/pipeline/service_config.h"

#include <gtest/gtest.h>

#include "capture/error.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

std::string error_of(const ServiceFiles& files) {
  try {
    read_service(files, relight::Plan{});
  } catch (const capture::InputError& e) {
    return e.what();
  }
  return "";
}

TEST(ServiceConfig, ASessionBringsItsOwnExhibit) {
  const TinySession tiny("own-exhibit");
  ServiceFiles files;
  files.session = tiny.folder;
  files.overrides = {"plan.volume=32", "server.listen=0.0.0.0:9", "tag.id=7"};
  const ServiceInput input = read_service(files, interactive_plan());
  EXPECT_EQ(input.session.name, "tiny");
  EXPECT_EQ(input.session.tag.id, 7);
  ASSERT_EQ(input.exhibit.objects.size(), 1u);
  EXPECT_FLOAT_EQ(input.exhibit.objects[0].white_radiance, 1 / 3.0f) << "exposure 3";
  EXPECT_EQ(input.plan.volume, 32);
  EXPECT_EQ(input.plan.trace_scale, 4) << "what is not set stays interactive";
  EXPECT_EQ(input.plan.look, "camera");
  EXPECT_EQ(read_service(files, replay_plan()).plan.look, "plain") << "replay compares radiance";
  ASSERT_EQ(input.server.listeners.size(), 1u);
  EXPECT_EQ(input.server.listeners[0].address, "0.0.0.0");
  EXPECT_EQ(input.server.listeners[0].port, 9);
}

TEST(ServiceConfig, AConfigurationMayNameASession) {
  const TinySession tiny("named");
  tiny.write("other.toml", "");
  tiny.write("kiosk.toml",
             "session = \".\"\nexhibit = \"other.toml\"\n[server]\nmax_viewers = 3\n[plan]\nvolume = 64\n");
  ServiceFiles files;
  files.config = tiny.folder / "kiosk.toml";
  files.overrides = {"tag.id=8", "server.jpeg_quality=50", "server.backend=egl", "server.max_field_memory_mb=2048",
                     "server.room=hall.room"};
  const ServiceInput input = read_service(files, relight::Plan{});
  EXPECT_EQ(input.session.name, "tiny");
  EXPECT_EQ(input.session.tag.id, 8) << "--set reaches the session's keys";
  EXPECT_TRUE(input.exhibit.objects.empty());
  EXPECT_EQ(input.server.max_viewers, 3);
  EXPECT_EQ(input.server.jpeg_quality, 50);
  EXPECT_EQ(input.server.backend, relight::gpu::Backend::egl);
  EXPECT_EQ(input.server.fusion.max_memory_mb, 2048);
  EXPECT_EQ(input.server.room, tiny.folder / "hall.room") << "beside the configuration";
  EXPECT_EQ(input.plan.volume, 64);
}

TEST(ServiceConfig, AddressesOfAMediaServerAreCheckedAndNoPasswordIsShown) {
  const TinySession tiny("published");
  ServiceFiles files;
  files.session = tiny.folder;
  files.overrides = {"server.publish=rtsp://kiosk:secret@media.example/hall",
                     "server.watch=https://media.example/hall/whep"};
  const ServiceInput input = read_service(files, relight::Plan{});
  EXPECT_EQ(input.server.publish->shown, "rtsp://media.example/hall");
  EXPECT_EQ(input.server.watch.origin, "https://media.example");
  files.overrides = {"server.publish=rtmp://kiosk:secret@media.example/hall"};
  const std::string refused = error_of(files);
  EXPECT_NE(refused.find("server.publish: found \"rtmp://media.example\", allowed: \"rtsp://HOST/PATH\", "),
            std::string::npos)
      << refused;
  EXPECT_EQ(refused.find("secret"), std::string::npos) << refused;
  files.overrides = {"server.watch=https://kiosk:secret@media.example/hall"};
  EXPECT_EQ(error_of(files).find("secret"), std::string::npos) << error_of(files);
  EXPECT_NE(error_of(files).find("server.watch: found"), std::string::npos) << error_of(files);
}

TEST(ServiceConfig, AConfigurationMayHoldCamerasItself) {
  const TinySession tiny("kiosk");
  tiny.write("kiosk.toml", "exhibit = \"exhibit.toml\"\n" + tiny.read("session.toml") + "[server]\nlisten = \":81\"\n");
  ServiceFiles files;
  files.config = tiny.folder / "kiosk.toml";
  const ServiceInput input = read_service(files, relight::Plan{});
  EXPECT_EQ(input.exhibit.objects.size(), 1u);
  EXPECT_EQ(input.server.listeners[0].port, 81);
}

TEST(ServiceConfig, ObsoleteKeysOfAnExhibitAreWarnedOf) {
  const TinySession tiny("obsolete");
  ServiceFiles files;
  files.session = tiny.folder;
  EXPECT_TRUE(read_service(files, relight::Plan{}).warnings.empty());
  tiny.write("exhibit.toml", "[[object]]\nrigid = true\nmodel = \"pyramid.obj\"\n");
  const ServiceInput input = read_service(files, relight::Plan{});
  EXPECT_EQ(input.exhibit.objects.size(), 1u);
  ASSERT_EQ(input.warnings.size(), 1u);
  EXPECT_NE(input.warnings[0].find("exhibit.toml:2: object.0.rigid"), std::string::npos) << input.warnings[0];
}

TEST(ServiceConfig, FormerKeysAreReadWithAWarning) {
  const TinySession tiny("former");
  tiny.write("kiosk.toml", "session = \".\"\n[plan]\nfollow_scene = 0\n");
  ServiceFiles files;
  files.config = tiny.folder / "kiosk.toml";
  const ServiceInput named = read_service(files, relight::Plan{});
  EXPECT_EQ(named.plan.adaptive, 0);
  ASSERT_EQ(named.warnings.size(), 1u);
  EXPECT_NE(named.warnings[0].find("kiosk.toml:3: plan.follow_scene: is now named adaptive"), std::string::npos)
      << named.warnings[0];
  files = {.config = {}, .session = tiny.folder, .exhibit = {}, .overrides = {"plan.follow_scene=0"}};
  const ServiceInput set = read_service(files, relight::Plan{});
  EXPECT_EQ(set.plan.adaptive, 0);
  ASSERT_EQ(set.warnings.size(), 1u);
  EXPECT_NE(set.warnings[0].find("plan.follow_scene: is now named adaptive"), std::string::npos) << set.warnings[0];
  files.overrides = {"plan.adaptive=0"};
  EXPECT_TRUE(read_service(files, relight::Plan{}).warnings.empty());
}

TEST(ServiceConfig, TheProjectsOwnConfigurationIsReadable) {
  if (!std::filesystem::exists(LUMIGRAFT_SOURCE_DIR "/recordings/tabletop/session.toml")) {
    GTEST_SKIP() << "recordings/tabletop is not there";
  }
  ServiceFiles files;
  files.config = LUMIGRAFT_SOURCE_DIR "/configs/kiosk.toml";
  EXPECT_EQ(error_of(files), "");
}

TEST(ServiceConfig, TheGalleryIsReadAndEverythingInItIsDrawn) {
  ServiceFiles files;
  files.session = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  files.exhibit = LUMIGRAFT_SOURCE_DIR "/recordings/gallery/exhibit.toml";
  const ServiceInput input = read_service(files, relight::Plan{});
  EXPECT_TRUE(input.warnings.empty()) << input.warnings[0];
  EXPECT_EQ(input.exhibit.objects.size(), 6u);
  for (const relight::VirtualObject& object : input.exhibit.objects) {
    EXPECT_EQ(object.visible, object.name == "owl");
    EXPECT_TRUE(object.model->not_drawn.empty()) << object.model->not_drawn[0];
  }
}

TEST(ServiceConfig, ErrorsSayWhere) {
  const TinySession tiny("errors");
  ServiceFiles files;
  files.session = tiny.folder / "none";
  EXPECT_NE(error_of(files).find("no such folder"), std::string::npos) << error_of(files);
  files.session = tiny.folder;
  for (const char* wrong :
       {"server.listen=8080", "server.listen=localhost:99999", "server.listen=kiosk:80", "server.listen=::1:80",
        "server.max_viewers=0", "server.max_field_memory_mb=63", "server.backend=metal", "server.port=8080",
        "plan.volume=77", "color.wide=4", "nonsense=1"}) {
    files.overrides = {wrong};
    const std::string error = error_of(files);
    EXPECT_NE(error.find(std::string(wrong).substr(0, std::string(wrong).find('='))), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST(ServiceConfig, WhatWasSavedReplacesWhatTheExhibitSays) {
  const TinySession tiny("saved");
  tiny.write("exhibit.toml", R"(# stays as it is
reset_after_s = 60
[[object]]
model = "pyramid.obj"
size_m = 0.2
[object.material]
metallic = 1
[[object.motion]]
time_s = 1
position_m = [1, 1, 1]
[[object]]
name = "second"
model = "pyramid.obj"
)");
  const std::string written = tiny.read("exhibit.toml");
  ServiceFiles files;
  files.session = tiny.folder;
  files.with_saved = true;
  const ServiceInput before = read_service(files, interactive_plan());
  EXPECT_TRUE(before.warnings.empty());
  ExhibitState board(before.exhibit, before.limits);
  const auto apply = [&](const char* text) { board.apply(std::get<ObjectCommand>(parse_command(text))); };
  apply(R"({"type":"object","index":0,"position_m":[0.1,0.2,0.3],"material":{"metallic":null,"roughness":0.25}})");
  apply(R"({"type":"object","index":1,"visible":false,"yaw_degrees":90})");
  board.save();
  EXPECT_EQ(tiny.read("exhibit.toml"), written);

  const ServiceInput after = read_service(files, interactive_plan());
  ASSERT_EQ(after.warnings.size(), 1u);
  EXPECT_NE(after.warnings[0].find("exhibit.saved.toml is shown"), std::string::npos) << after.warnings[0];
  ASSERT_EQ(after.exhibit.objects.size(), 2u);
  EXPECT_EQ(after.limits.reset_after_s, 60);
  for (std::size_t i = 0; i < 2; ++i) {
    const relight::VirtualObject &is = after.exhibit.objects[i], &was = board.newest()->objects[i];
    EXPECT_EQ(is.name, was.name);
    EXPECT_EQ(is.position_m, was.position_m);
    EXPECT_TRUE(is.rotation.isApprox(was.rotation));
    EXPECT_EQ(is.scale, was.scale);
    EXPECT_EQ(is.visible, was.visible);
    EXPECT_EQ(is.material, was.material);
    EXPECT_TRUE(is.motion.empty());
  }
  EXPECT_FALSE(after.exhibit.objects[1].visible);
  EXPECT_EQ(after.exhibit.objects[0].material.roughness, 0.25f);
  EXPECT_FALSE(after.exhibit.objects[0].material.metallic);

  files.with_saved = false;
  EXPECT_EQ(read_service(files, replay_plan()).exhibit.objects[0].motion.size(), 1u)
      << "replay shows the exhibit's file";
}

TEST(ServiceConfig, ASavedFileThatDoesNotFitIsNamedAndNotUsed) {
  const TinySession tiny("saved-misfit");
  ServiceFiles files;
  files.session = tiny.folder;
  files.with_saved = true;
  tiny.write("exhibit.saved.toml", "[[object]]\nname = \"gone\"\nvisible = false\n");
  const ServiceInput gone = read_service(files, interactive_plan());
  EXPECT_TRUE(gone.exhibit.objects[0].visible);
  ASSERT_EQ(gone.warnings.size(), 2u);
  EXPECT_NE(gone.warnings[1].find("object \"gone\" is not in the exhibit any more"), std::string::npos);
  for (const char* text : {"not toml", "[[object]]\nname = \"pyramid\"\nvariant = \"red\"\n"}) {
    tiny.write("exhibit.saved.toml", text);
    const ServiceInput input = read_service(files, interactive_plan());
    ASSERT_EQ(input.exhibit.objects.size(), 1u);
    EXPECT_TRUE(input.exhibit.objects[0].visible);
    ASSERT_EQ(input.warnings.size(), 1u);
    EXPECT_NE(input.warnings[0].find("exhibit.saved.toml is not used: "), std::string::npos) << input.warnings[0];
  }
  tiny.write("exhibit.toml", "[[object]]\nmodel = 1\n");
  EXPECT_NE(error_of(files).find("exhibit.toml:2: "), std::string::npos) << "with its own lines";
}

}  // namespace
}  // namespace lumigraft::server
