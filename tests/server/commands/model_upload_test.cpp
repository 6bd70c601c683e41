#include "server/commands/model_upload.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

constexpr double kMax_mb = 1, kMinFree_gb = 0.001;

/// Writes `bytes` to where a file of this name is received, and hands it over.
WebReply send(const ModelUpload& upload, const std::string& name, const std::string& bytes) {
  const auto begun = upload.begin(name, bytes.size());
  if (const auto* refused = std::get_if<WebReply>(&begun)) return *refused;
  const fs::path file = std::get<UploadHandlers::Place>(begun).file;
  std::ofstream(file, std::ios::binary) << bytes;
  WebReply reply = upload.received(file, name);
  fs::remove(file);
  return reply;
}

/// A binary glTF file of one triangle.
std::string triangle() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,)"
      R"("count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}]})";
  while (json.size() % 4 != 0) json += ' ';
  const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::string body(reinterpret_cast<const char*>(corners), sizeof corners);
  const auto number = [](std::uint32_t n) { return std::string(reinterpret_cast<const char*>(&n), 4); };
  const auto chunk = [&](const std::string& kind, const std::string& content) {
    return number(static_cast<std::uint32_t>(content.size())) + kind + content;
  };
  const std::string chunks = chunk("JSON", json) + chunk(std::string("BIN") + '\0', body);
  return "glTF" + number(2) + number(static_cast<std::uint32_t>(12 + chunks.size())) + chunks;
}

TEST(ModelUpload, AModelIsAddedToTheExhibit) {
  const TinySession tiny("upload");
  tiny.write("exhibit.toml", "# by hand\n");
  int reloads = 0;
  const ModelUpload upload(tiny.folder / "exhibit.toml", kMax_mb, kMinFree_gb, [&] { ++reloads; });
  EXPECT_EQ(send(upload, "my-vase_2.glb", triangle()).status, 201u);
  EXPECT_EQ(reloads, 1);
  EXPECT_EQ(tiny.read("exhibit.toml"),
            "# by hand\n\n[[object]]  # uploaded on the page\nname = \"my-vase_2\"\nmodel = \"models/my-vase_2.glb\"\n"
            "on = \"table\"\n");
  EXPECT_EQ(tiny.read("models/my-vase_2.glb"), triangle());
  const WebReply again = send(upload, "my-vase_2.glb", triangle());
  EXPECT_EQ(again.status, 409u);
  EXPECT_EQ(again.body, "found a model of this name, allowed: a name that is not there yet\n");
}

TEST(ModelUpload, WhatCannotBeUsedChangesNothing) {
  const TinySession tiny("upload-refused");
  tiny.write("exhibit.toml", "# by hand\n");
  const fs::path exhibit = tiny.folder / "exhibit.toml";
  const ModelUpload upload(exhibit, kMax_mb, kMinFree_gb, [] { throw std::runtime_error("no room for it"); });
  for (const char* name : {"", ".glb", "a.gltf", "../a.glb", "a b.glb", "a%2f.glb", "\"a.glb"})
    EXPECT_EQ(send(upload, name, triangle()).status, 400u) << name;
  EXPECT_EQ(send(upload, std::string(65, 'a') + ".glb", triangle()).status, 400u);
  const WebReply large = send(upload, "a.glb", std::string(2 << 20, 'x'));
  EXPECT_EQ(large.status, 413u);
  EXPECT_EQ(large.body, "found a model of 2 MB, allowed: at most 1 MB (server.max_upload_mb)\n");
  const WebReply broken = send(upload, "a.glb", "not a model");
  EXPECT_EQ(broken.status, 422u);
  EXPECT_EQ(broken.body.find(tiny.folder.string()), std::string::npos) << broken.body;
  const WebReply not_shown = send(upload, "a.glb", triangle());
  EXPECT_EQ(not_shown.status, 422u);
  EXPECT_NE(not_shown.body.find("no room for it"), std::string::npos);
  EXPECT_EQ(tiny.read("exhibit.toml"), "# by hand\n");
  EXPECT_TRUE(fs::is_empty(tiny.folder / "models"));
  EXPECT_EQ(send(ModelUpload(exhibit, kMax_mb, 1e9, [] {}), "a.glb", triangle()).status, 507u) << "too little disk";
  EXPECT_EQ(send(ModelUpload({}, kMax_mb, kMinFree_gb, [] {}), "a.glb", triangle()).status, 409u) << "no exhibit";
}

TEST(ModelUpload, AModelIsRemovedWithItsObject) {
  const TinySession tiny("upload-remove");
  tiny.write("exhibit.toml", "# by hand\n");
  const ModelUpload upload(tiny.folder / "exhibit.toml", kMax_mb, kMinFree_gb, [] {});
  ASSERT_EQ(send(upload, "vase.glb", triangle()).status, 201u);
  ASSERT_EQ(send(upload, "bowl.glb", triangle()).status, 201u);
  EXPECT_EQ(upload.remove("vase.glb").status, 200u);
  EXPECT_EQ(tiny.read("exhibit.toml"),
            "# by hand\n\n[[object]]  # uploaded on the page\nname = \"bowl\"\nmodel = \"models/bowl.glb\"\n"
            "on = \"table\"\n");
  EXPECT_FALSE(fs::exists(tiny.folder / "models/vase.glb"));
  EXPECT_TRUE(fs::exists(tiny.folder / "models/bowl.glb"));
  EXPECT_EQ(upload.remove("vase.glb").body, "found no model of this name, allowed: one that was uploaded\n");
  EXPECT_EQ(send(upload, "vase.glb", triangle()).status, 201u) << "the name is free again";
}

TEST(ModelUpload, WhatCannotBeRemovedStays) {
  const TinySession tiny("upload-stays");
  tiny.write("exhibit.toml", "# by hand\n");
  tiny.write("secret.glb", "x");
  const fs::path exhibit = tiny.folder / "exhibit.toml";
  ASSERT_EQ(send(ModelUpload(exhibit, kMax_mb, kMinFree_gb, [] {}), "a.glb", triangle()).status, 201u);
  const std::string before = tiny.read("exhibit.toml");
  const ModelUpload upload(exhibit, kMax_mb, kMinFree_gb, [] { throw std::runtime_error("another object needs it"); });
  const WebReply kept = upload.remove("a.glb");
  EXPECT_EQ(kept.status, 422u);
  EXPECT_NE(kept.body.find("another object needs it"), std::string::npos);
  for (const char* name : {"../secret.glb", "..%2fsecret.glb", "", ".glb", "a.toml"})
    EXPECT_EQ(upload.remove(name).status, 400u) << name;
  EXPECT_EQ(upload.remove("secret.glb").status, 404u);
  EXPECT_EQ(tiny.read("exhibit.toml"), before);
  EXPECT_EQ(tiny.read("models/a.glb"), triangle());
  EXPECT_EQ(ModelUpload({}, kMax_mb, kMinFree_gb, [] {}).remove("a.glb").status, 404u) << "no exhibit";
}

}  // namespace
}  // namespace lumigraft::server
