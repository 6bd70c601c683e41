#include "relight/exhibit/exhibit.h"

#include <gtest/gtest.h>

#include <numbers>

#include "capture/error.h"
#include "relight/animation/pose.h"
#include "tests/relight/exhibit/gltf/animated_files.h"
#include "tests/relight/exhibit/gltf/variant_files.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::relight {
namespace {

using test::TemporaryFolder;

class ReadExhibit : public ::testing::Test {
 protected:
  ReadExhibit() {
    folder_.write("square.ply", test::ply_square());
    folder_.write("triangle.gltf", test::GltfFile().gltf());
    test::GltfFile moving = test::moving_triangle();
    moving.json["animations"].push_back(test::channel_animation(moving, "scale", {0, 4}, {1, 1, 1, 2, 2, 2}, "VEC3"));
    folder_.write("moving.gltf", moving.gltf());
    folder_.write("variants.gltf", test::grey_red_or_blue().gltf());
    folder_.write("no_triangles.ply",
                  "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
    folder_.write("two.mtl", "newmtl red\nKd 0.6 0.1 0.1\nnewmtl green\nKd 0.1 0.6 0.1\n");
    folder_.write("two.obj", "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl green\nf 1 3 2\n");
  }

  Exhibit read(const std::string& toml) {
    const capture::ConfigTable root = capture::ConfigTable::load(folder_.write("exhibit.toml", toml));
    Exhibit exhibit = read_exhibit(root);
    root.finish();
    return exhibit;
  }

  std::string error_of(const std::string& toml) {
    try {
      read(toml);
    } catch (const capture::InputError& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
};

TEST_F(ReadExhibit, AVariantIsChosenByName) {
  const std::string object = "[[object]]\nmodel = \"variants.gltf\"\nsize_m = 0.5\n";
  const VirtualObject own = read(object).objects[0], blue = read(object + "variant = \"blue\"").objects[0];
  ASSERT_NE(own.default_model, nullptr);
  EXPECT_EQ(own.model, own.default_model);
  EXPECT_EQ(own.variant, std::nullopt);
  EXPECT_EQ(blue.variant, 1u);
  EXPECT_EQ(blue.model, blue.default_model->variants[1].model);
  EXPECT_EQ(blue.scale, own.scale);
  const std::string unknown = error_of(object + "variant = \"green\"");
  EXPECT_NE(unknown.find(":4: object.0.variant: found \"green\", allowed: \"red\", \"blue\""), std::string::npos)
      << unknown;
  const std::string none = error_of("[[object]]\nmodel = \"triangle.gltf\"\nvariant = \"red\"");
  EXPECT_NE(none.find("variant: found \"red\", allowed: none"), std::string::npos) << none;
}

TEST_F(ReadExhibit, ACoatOfTheMaterial) {
  const std::string object = "[[object]]\nmodel = \"square.ply\"\n[object.material]\n";
  const MaterialOverride lacquer = read(object + "clearcoat = 0.75\nclearcoat_roughness = 0.25").objects[0].material;
  EXPECT_EQ(lacquer.clearcoat, 0.75f);
  EXPECT_EQ(lacquer.clearcoat_roughness, 0.25f);
  EXPECT_EQ(lacquer.over({}).clearcoat, 0.75f);
  EXPECT_EQ(read(object).objects[0].material.clearcoat, std::nullopt);
  EXPECT_NE(error_of(object + "clearcoat = 2").find("clearcoat: "), std::string::npos);
}

TEST_F(ReadExhibit, AllKeys) {
  const Exhibit exhibit = read(R"(
[[object]]
name = "statue"
model = "square.ply"
position_m = [0.05, 0.25, -0.0002]
rotation_wxyz = [2, 0, 0, 2]
scale = 0.5
up = "z"

[object.material]
base_color = [0.72, 0.68, 0.6]
metallic = 0.25
roughness = 0.5
specular = 0.0
emission = [3, 2, 0.5]
transmission = 0.5
ior = 1.33
thin_walled = true
attenuation_color = [0.5, 1, 0]
attenuation_distance_m = 0.25
)");
  ASSERT_EQ(exhibit.objects.size(), 1u);
  const VirtualObject& object = exhibit.objects[0];
  EXPECT_EQ(object.name, "statue");
  EXPECT_TRUE(object.visible);
  EXPECT_FLOAT_EQ(object.material.base_color.value().y(), 0.68f);
  EXPECT_FLOAT_EQ(object.material.metallic.value(), 0.25f);
  EXPECT_FLOAT_EQ(object.material.roughness.value(), 0.5f);
  EXPECT_FLOAT_EQ(object.material.specular.value(), 0.0f);
  EXPECT_EQ(object.material.emission.value(), Eigen::Vector3f(3, 2, 0.5f));
  EXPECT_EQ(object.material.transmission.value(), 0.5f);
  EXPECT_EQ(object.material.ior.value(), 1.33f);
  EXPECT_TRUE(object.material.thin_walled.value());
  EXPECT_EQ(object.material.attenuation_color.value(), Eigen::Vector3f(0.5f, 1, 0));
  EXPECT_EQ(object.material.attenuation_distance_m.value(), 0.25f);
  const Material over = object.material.over({});
  EXPECT_EQ(over.transmission, 0.5f);
  EXPECT_EQ(over.ior, 1.33f);
  EXPECT_TRUE(over.thin_walled);
  EXPECT_EQ(over.attenuation_color.z(), 0);
  EXPECT_EQ(over.attenuation_distance_m, 0.25f);
  EXPECT_NEAR(object.rotation.norm(), 1.0, 1e-12);
  // Scaled by half, turned by 90° about z, moved.
  const Eigen::Vector3d p = object.T_tag_model(7.0) * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((p - Eigen::Vector3d(0.05, 0.75, -0.0002)).norm(), 1e-12);
}

TEST_F(ReadExhibit, Defaults) {
  const Exhibit exhibit = read("[[object]]\nmodel = \"square.ply\"\n[[object]]\nmodel = \"triangle.gltf\"\n");
  ASSERT_EQ(exhibit.objects.size(), 2u);
  EXPECT_EQ(exhibit.objects[0].name, "square");
  EXPECT_TRUE(exhibit.objects[0].material.empty());
  EXPECT_TRUE(exhibit.objects[0].T_tag_model(0).isApprox(Eigen::Affine3d::Identity()));
  // PLY is z up, so the square lies flat; glTF is y up, so the triangle in its plane z = 0 is vertical.
  for (const auto& p : exhibit.objects[0].model->positions_m) EXPECT_EQ(p.z(), 0.0f);
  for (const auto& p : exhibit.objects[1].model->positions_m) EXPECT_EQ(p.y(), 0.0f);
  EXPECT_TRUE(read("").objects.empty());
}

TEST_F(ReadExhibit, ObjectsMayBeHiddenAndStandOnTheTable) {
  const std::vector<VirtualObject> objects = read(R"(
[[object]]
model = "two.obj"
[[object]]
name = "hidden"
model = "two.obj"
visible = false
on = "table"
)")
                                                 .objects;
  EXPECT_TRUE(objects[0].visible);
  EXPECT_FALSE(objects[0].stands);
  EXPECT_FALSE(objects[1].visible);
  EXPECT_TRUE(objects[1].stands);
}

TEST_F(ReadExhibit, AnObjectOfASizeStandsAtItsPosition) {
  const VirtualObject object = read(R"(
[[object]]
model = "two.obj"
position_m = [0.1, 0.2, 0.05]
rotation_wxyz = [1, 0, 0, 1]
size_m = 0.3
)")
                                   .objects[0];
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : object.model->positions_m) box.extend(object.T_tag_model(0) * p.cast<double>());
  EXPECT_NEAR(box.sizes().maxCoeff(), 0.3, 1e-6);
  EXPECT_NEAR(box.min().z(), 0.05, 1e-6);
  EXPECT_NEAR(box.center().x(), 0.1, 1e-6);
  EXPECT_NEAR(box.center().y(), 0.2, 1e-6);
}

// The key never had an effect, but existing files contain it.
TEST_F(ReadExhibit, RigidIsAcceptedAndSaidToHaveNoEffect) {
  const capture::ConfigTable root =
      capture::ConfigTable::load(folder_.write("exhibit.toml", "[[object]]\nmodel = \"square.ply\"\nrigid = false\n"));
  EXPECT_EQ(read_exhibit(root).objects.size(), 1u);
  EXPECT_NO_THROW(root.finish());
  ASSERT_EQ(root.warnings().size(), 1u);
  EXPECT_NE(root.warnings()[0].find("exhibit.toml:3: object.0.rigid: has no effect"), std::string::npos);
}

TEST_F(ReadExhibit, OneModelIsLoadedOnce) {
  const Exhibit exhibit =
      read("[[object]]\nname = \"a\"\nmodel = \"square.ply\"\n[[object]]\nname = \"b\"\nmodel = \"square.ply\"\n");
  EXPECT_EQ(exhibit.objects[0].model, exhibit.objects[1].model);
}

TEST_F(ReadExhibit, IncompleteMaterialKeepsTheRest) {
  for (const char* file : {"square.ply", "two.obj"}) {
    const VirtualObject object =
        read("[[object]]\nmodel = \"" + std::string(file) + "\"\n[object.material]\nroughness = 0.3\n").objects[0];
    MaterialOverride expected;
    expected.roughness = 0.3f;
    EXPECT_EQ(object.material, expected) << file;
    for (const Model::Part& part : object.model->parts) {
      const Material material = object.material.over(part.material);
      EXPECT_FLOAT_EQ(material.roughness, 0.3f);
      EXPECT_EQ(material.base_color, part.material.base_color);
      EXPECT_EQ(material.metallic, part.material.metallic);
      EXPECT_EQ(material.specular, part.material.specular);
    }
  }
}

TEST_F(ReadExhibit, MotionIsInterpolatedAndHeldAtItsEnds) {
  const VirtualObject object = read(R"(
[[object]]
model = "square.ply"
position_m = [9, 9, 9]
[[object.motion]]
time_s = 1
position_m = [0, 0, 0]
[[object.motion]]
time_s = 3
position_m = [2, 0, 0]
rotation_wxyz = [1, 0, 0, 1]
[[object.motion]]
time_s = 3
position_m = [5, 0, 0]
)")
                                   .objects[0];
  ASSERT_EQ(object.motion.size(), 3u);
  const auto origin_x = [&](double t) { return (object.T_tag_model(t) * Eigen::Vector3d::Zero()).x(); };
  EXPECT_DOUBLE_EQ(origin_x(-10), 0.0);
  EXPECT_DOUBLE_EQ(origin_x(1), 0.0);
  EXPECT_DOUBLE_EQ(origin_x(1.5), 0.5);
  EXPECT_NEAR(origin_x(2.999), 1.999, 1e-12);
  EXPECT_DOUBLE_EQ(origin_x(3), 5.0);  // two key frames at one time: a jump
  EXPECT_DOUBLE_EQ(origin_x(100), 5.0);
  // Halfway to 90° about z is 45°.
  const Eigen::Vector3d x = object.T_tag_model(2).linear() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(x.y(), x.x()), std::numbers::pi / 4, 1e-12);
}

TEST_F(ReadExhibit, TheFirstAnimationLoopsUnlessOtherwiseStated) {
  const Exhibit exhibit = read(R"(
[[object]]
name = "loops"
model = "moving.gltf"
[[object]]
name = "once"
model = "moving.gltf"
[object.animation]
name = "scale"
loop = false
at_s = 1
[[object]]
name = "held"
model = "moving.gltf"
[object.animation]
playing = false
at_s = 0.5
[[object]]
model = "square.ply"
)");
  const Rig& rig = *exhibit.objects[0].model->rig;
  EXPECT_EQ(exhibit.objects[0].pose(10.25), pose_at(rig, 0, 0.25));
  EXPECT_EQ(exhibit.objects[1].pose(0), pose_at(rig, 1, 1));
  EXPECT_EQ(exhibit.objects[1].pose(9), pose_at(rig, 1, 4));
  EXPECT_EQ(exhibit.objects[2].pose(9), pose_at(rig, 0, 0.5));
  EXPECT_TRUE(exhibit.objects[3].pose(9).at_rest());
}

TEST_F(ReadExhibit, BadInput) {
  struct Case {
    const char *toml, *where, *found;
  };
  for (const Case& c : {
           Case{"[[object]]\n", "object.0.model: ", "found nothing"},
           Case{"[[object]]\nmodel = \"missing.ply\"", ":2: object.0.model: ", "missing.ply"},
           Case{"[[object]]\nmodel = \"exhibit.toml\"", ":2: object.0.model: ", "allowed: .gltf, .glb, .ply or .obj"},
           Case{"[[object]]\nmodel = \"no_triangles.ply\"", ":2: object.0.model: ", "no triangles"},
           Case{"[[object]]\nmodel = \"square.ply\"\nscale = 0", ":3: object.0.scale: ", "found 0"},
           Case{"[[object]]\nmodel = \"square.ply\"\nscale = -1", ":3: object.0.scale: ", "found -1"},
           Case{"[[object]]\nmodel = \"square.ply\"\nup = \"w\"", ":3: object.0.up: ", "found \"w\""},
           Case{"[[object]]\nmodel = \"square.ply\"\nrotation_wxyz = [0, 0, 0, 0]",
                ":3: object.0.rotation_wxyz: ", "normalised"},
           Case{"[[object]]\nmodel = \"square.ply\"\nrotation_wxyz = [1, 0, 0, nan]",
                ":3: object.0.rotation_wxyz: ", "nan"},
           Case{"[[object]]\nmodel = \"square.ply\"\nposition_m = [0, 0]", ":3: object.0.position_m: ", "array of 2"},
           Case{"[[object]]\nmodel = \"square.ply\"\ncolour = 3", ":3: object.0.colour: ", ""},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nroughness = 2",
                ":4: object.0.material.roughness: ", "found 2"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nbase_color = [0.5, 0.5, 1.5]",
                ":4: object.0.material.base_color: ", "outside 0 to 1"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nemission = [0, -1, 0]",
                ":4: object.0.material.emission: ", "outside 0 to 100000"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nior = 0.9",
                ":4: object.0.material.ior: ", "found 0.9"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nattenuation_color = [0, 2, 0]",
                ":4: object.0.material.attenuation_color: ", "outside 0 to 1"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.material]\nattenuation_distance_m = 0",
                ":4: object.0.material.attenuation_distance_m: ", "found 0"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[[object.motion]]\nposition_m = [0, 0, 0]",
                "object.0.motion.0.time_s: ", "found nothing"},
           Case{"[[object]]\nmodel = \"square.ply\"\n[[object.motion]]\ntime_s = 2\n[[object.motion]]\ntime_s = 1",
                ":6: object.0.motion.1.time_s: ", "no earlier"},
           Case{"[[object]]\nname = \"a\"\nmodel = \"square.ply\"\n[[object]]\nname = \"a\"\nmodel = \"square.ply\"",
                ":5: object.1.name: ", "second object named \"a\""},
           Case{"[[object]]\nmodel = \"square.ply\"\nsize_m = 1\nscale = 2",
                ":3: object.0.size_m: ", "together with scale"},
           Case{"[[object]]\nmodel = \"square.ply\"\non = \"wall\"", ":3: object.0.on: ", "found \"wall\""},
           Case{"[[object]]\nmodel = \"moving.gltf\"\n[object.animation]\nname = \"walk\"",
                ":4: object.0.animation.name: ", "found \"walk\", allowed: \"translation\", \"scale\""},
           Case{"[[object]]\nmodel = \"moving.gltf\"\n[object.animation]\nat_s = -1",
                ":4: object.0.animation.at_s: ", "found -1"},
           Case{"[[object]]\nmodel = \"moving.gltf\"\n[object.animation]\nspeed = 2",
                ":4: object.0.animation.speed: ", ""},
           Case{"[[object]]\nmodel = \"square.ply\"\n[object.animation]\nloop = true",
                "object.0.animation: ", "found a model without animations"},
           Case{"object = 3", ":1: object: ", "found 3"},
       }) {
    const std::string message = error_of(c.toml);
    EXPECT_TRUE(message.starts_with((folder_.path() / "exhibit.toml").string())) << c.toml << " -> " << message;
    EXPECT_NE(message.find(c.where), std::string::npos) << c.toml << " -> " << message;
    EXPECT_NE(message.find(c.found), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace lumigraft::relight
