#include "capture/session/config.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "capture/error.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

/// The message of the InputError that `action` must throw.
template <typename Action>
std::string error_of(Action action) {
  try {
    action();
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "not on one line: " << e.what();
    return e.what();
  }
  return "no error";
}

ConfigTable parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return ConfigTable::parse(text, "kiosk.toml", overrides);
}

TEST(Config, ReadsEveryType) {
  const ConfigTable root =
      parse("a = 1\nb = 2.5\nc = true\nd = \"x\"\ne = [1, 2.5]\n[t]\nf = 3\n[[u]]\ng = 1\n[[u]]\ng = 2\n");
  EXPECT_EQ(root.integer("a", 0, 10), 1);
  EXPECT_EQ(root.number("a", 0, 10), 1.0);
  EXPECT_EQ(root.number("b", 0, 10), 2.5);
  EXPECT_TRUE(root.flag("c", false));
  EXPECT_EQ(root.text("d"), "x");
  EXPECT_EQ(root.choice("d", {"x", "y"}, "y"), "x");
  EXPECT_EQ(root.numbers("e", 2), (std::vector<double>{1, 2.5}));
  EXPECT_EQ(root.table("t").integer("f", 0, 10), 3);
  const std::vector<ConfigTable> us = root.tables("u");
  ASSERT_EQ(us.size(), 2u);
  EXPECT_EQ(us[1].integer("g", 0, 10), 2);
  EXPECT_EQ(us[0].integer("g", 0, 10), 1);
  EXPECT_NO_THROW(root.finish());
}

TEST(Config, DefaultsReplaceAbsentKeys) {
  const ConfigTable root = parse("");
  EXPECT_EQ(root.integer("a", 0, 10, 7), 7);
  EXPECT_EQ(root.number("b", 0, 10, 1.5), 1.5);
  EXPECT_TRUE(root.flag("c", true));
  EXPECT_EQ(root.text("d", "z"), "z");
  EXPECT_EQ(root.choice("e", {"x"}, "x"), "x");
  EXPECT_FALSE(root.optional_table("t"));
  EXPECT_TRUE(root.tables("u").empty());
  EXPECT_FALSE(root.has("a"));
}

TEST(Config, ErrorsSayFileLineKeyFoundAllowed) {
  const ConfigTable root = parse("\n[color]\nwidth = \"wide\"\nfx = nan\nfy = inf\ncx = 12\nd = [0, nan]\nname = 3\n");
  const ConfigTable color = root.table("color");
  EXPECT_EQ(error_of([&] { color.integer("width", 1, 16384); }),
            "kiosk.toml:3: color.width: found \"wide\", allowed: an integer from 1 to 16384");
  EXPECT_EQ(error_of([&] { color.number("fx", 1, 100); }),
            "kiosk.toml:4: color.fx: found nan, allowed: a number from 1 to 100");
  EXPECT_EQ(error_of([&] { color.number("fy", 1, std::numeric_limits<double>::infinity()); }),
            "kiosk.toml:5: color.fy: found inf, allowed: a finite number");
  EXPECT_EQ(error_of([&] { color.integer("cx", 1, 10); }),
            "kiosk.toml:6: color.cx: found 12, allowed: an integer from 1 to 10");
  EXPECT_EQ(error_of([&] { color.numbers("d", 2); }),
            "kiosk.toml:7: color.d: found nan in the array, allowed: an array of 2 finite numbers");
  EXPECT_EQ(error_of([&] { color.text("name"); }), "kiosk.toml:8: color.name: found 3, allowed: a string");
  EXPECT_EQ(error_of([&] { color.text("source"); }), "kiosk.toml:2: color.source: found nothing, allowed: a string");
  EXPECT_EQ(error_of([&] { root.table("depth"); }), "kiosk.toml: depth: found nothing, allowed: a table [depth]");
}

TEST(Config, ANumberOutsideOfIntIsRefused) {
  const ConfigTable root = parse("a = 4294967297\nb = 1.5\n");
  EXPECT_EQ(error_of([&] { root.integer("a", 1, 10); }),
            "kiosk.toml:1: a: found 4294967297, allowed: an integer from 1 to 10");
  EXPECT_EQ(error_of([&] { root.integer("b", 1, 10); }),
            "kiosk.toml:2: b: found 1.5, allowed: an integer from 1 to 10");
}

TEST(Config, UnknownKeysAreRefusedEverywhere) {
  const ConfigTable root = parse("a = 1\n[color]\nwidth = 1\nwidht = 2\n");
  root.integer("a", 0, 10);
  root.table("color").integer("width", 0, 10);
  EXPECT_EQ(error_of([&] { root.finish(); }), "kiosk.toml:4: color.widht: found an unknown key, allowed: width");

  const ConfigTable table = parse("[colour]\nwidth = 1\n");
  table.optional_table("color");
  EXPECT_EQ(error_of([&] { table.finish(); }), "kiosk.toml:1: colour: found an unknown key, allowed: color");

  const ConfigTable array = parse("[[object]]\nx = 1\n[[object]]\ny = 1\n");
  for (const ConfigTable& t : array.tables("object")) {
    t.integer("x", 0, 10, 0);
  }
  EXPECT_EQ(error_of([&] { array.finish(); }), "kiosk.toml:4: object.1.y: found an unknown key, allowed: x");
}

TEST(Config, ObsoleteKeysAreAcceptedWithAWarning) {
  const ConfigTable root = parse("a = 1\n[color]\nold = 2\n");
  root.integer("a", 0, 10);
  root.obsolete("never_given");
  root.table("color").obsolete("old");
  EXPECT_NO_THROW(root.finish());
  EXPECT_EQ(root.warnings(), std::vector<std::string>{"kiosk.toml:3: color.old: has no effect any more"});
}

TEST(Config, TwoReadersOfOneTableShareWhatWasRead) {
  const ConfigTable root = parse("[color]\nwidth = 1\nheight = 2\n");
  root.table("color").integer("width", 0, 10);
  root.table("color").integer("height", 0, 10);
  EXPECT_NO_THROW(root.finish());
}

TEST(Config, OverridesReplaceTheFile) {
  const ConfigTable root = parse("[fisheye]\nsource = \"images:fisheye.txt\"\n[[object]]\nscale = 1.0\n",
                                 {"fisheye.source=images:fisheye-ldr.txt", "plan.trace_scale=4", "object.0.scale=2",
                                  "plan.name=\"quoted\"", "plan.list=[1, 2]", "plan.empty=", "plan.trace_scale=8"});
  EXPECT_EQ(root.table("fisheye").text("source"), "images:fisheye-ldr.txt");
  EXPECT_EQ(root.table("plan").integer("trace_scale", 1, 16), 8);
  EXPECT_EQ(root.table("plan").text("name"), "quoted");
  EXPECT_EQ(root.table("plan").text("empty"), "");
  EXPECT_EQ(root.table("plan").numbers("list", 2), (std::vector<double>{1, 2}));
  EXPECT_EQ(root.tables("object")[0].number("scale", 0, 10), 2.0);
  EXPECT_NO_THROW(root.finish());
}

TEST(Config, ErrorsInOverridesNameTheOverride) {
  const ConfigTable root = parse("[color]\nwidth = 1\n", {"color.width=wide", "plan.x.y=1"});
  EXPECT_EQ(error_of([&] { root.table("color").integer("width", 1, 9); }),
            "--set color.width: found \"wide\", allowed: an integer from 1 to 9");
  EXPECT_EQ(error_of([&] { root.finish(); }), "--set plan: found an unknown key, allowed: color");
  EXPECT_EQ(error_of([&] { parse("", {"novalue"}); }), "--set \"novalue\": found no '=', allowed: KEY=VALUE");
  EXPECT_NE(error_of([&] { parse("", {"=1"}); }).find("empty key"), std::string::npos);
  EXPECT_NE(error_of([&] { parse("", {"a..b=1"}); }).find("empty key"), std::string::npos);
  EXPECT_NE(error_of([&] { parse("", {"a.=1"}); }).find("empty key"), std::string::npos);
  EXPECT_EQ(error_of([&] { parse("a = 1\n", {"a.b=1"}); }),
            "--set a.b: found 1 in place of a table, allowed: a key of a table");
  EXPECT_EQ(error_of([&] { parse("a = 1\n", {"a.b.c=1"}); }),
            "--set a.b.c: found 1 on the way to \"b\", allowed: a table");
  EXPECT_EQ(error_of([&] { parse("[[o]]\n", {"o.7.c=1"}); }),
            "--set o.7.c: found no element \"7\", allowed: an index below 1");
}

TEST(Config, AnOverrideSetsOneKeyOnly) {
  const ConfigTable root = parse("", {"a=1\nb = 2"});
  EXPECT_EQ(root.text("a"), "1\nb = 2");
  EXPECT_FALSE(root.has("b"));
}

TEST(Config, RigidTransforms) {
  const auto refused = [](const std::string& rows) {
    return error_of([&] { parse("T = " + rows + "\n").rigid_transform("T"); });
  };
  EXPECT_EQ(parse("T = [[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]\n").rigid_transform("T"),
            (std::vector<double>{0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}));
  EXPECT_NE(refused("[[1,0,0,nan],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("kiosk.toml:1: T: found nan"),
            std::string::npos);
  EXPECT_NE(refused("[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("not orthonormal"), std::string::npos);
  EXPECT_NE(refused("[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("mirrors"), std::string::npos);
  EXPECT_NE(refused("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]").find("last row"), std::string::npos);
  EXPECT_NE(refused("[[1,0,0,0],[0,1,0,0],[0,0,1,0]]").find("found an array of 3"), std::string::npos);
  EXPECT_NE(refused("[[1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("found an array of 3 as a row"), std::string::npos);
  EXPECT_NE(refused("[[\"x\",0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("found \"x\""), std::string::npos);
}

class ConfigFile : public test::ScratchFolder {};

TEST_F(ConfigFile, FilesMustExist) {
  const std::filesystem::path& folder = folder_;
  std::ofstream(folder / "mesh.ply") << "ply\n";
  std::ofstream(folder / "s.toml") << "mesh = \"mesh.ply\"\nother = \"none.ply\"\nhere = \".\"\nodd = \"a\\u0000b\"\n";
  const ConfigTable root = ConfigTable::load(folder / "s.toml");
  EXPECT_EQ(root.existing_file("mesh"), folder / "mesh.ply");
  EXPECT_NE(error_of([&] { root.existing_file("other"); }).find("s.toml:2: other: found \"none.ply\""),
            std::string::npos);
  EXPECT_NE(error_of([&] { root.existing_file("here"); }).find("which is no file"), std::string::npos);
  EXPECT_NE(error_of([&] { root.existing_file("odd"); }).find("which is no file"), std::string::npos);
  EXPECT_NE(error_of([&] { ConfigTable::load(folder / "none.toml"); }).find("no readable file"), std::string::npos);
  EXPECT_NE(error_of([&] { ConfigTable::load(folder); }).find("no readable file"), std::string::npos);
}

TEST(Config, TomlErrorsNameTheLine) {
  EXPECT_NE(error_of([] { parse("a = 1\nb = = 2\n"); }).find("kiosk.toml:2: found a TOML error"), std::string::npos);
  EXPECT_NE(error_of([] { parse("a = \"\xff\"\n"); }).find("kiosk.toml"), std::string::npos);
  EXPECT_NE(error_of([] { parse("a = " + std::string(100000, '[')); }).find("kiosk.toml"), std::string::npos);
}

}  // namespace
}  // namespace lumigraft::capture
