#include "capture/camera/response.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

TEST(Response, SrgbAndLinear) {
  for (int code = 0; code < 256; ++code) {
    const auto value = static_cast<std::uint8_t>(code);
    for (int c = 0; c < 3; ++c) EXPECT_EQ(Response::srgb().to_linear(value, c), srgb_to_linear(value / 255.0f));
    EXPECT_EQ(Response::linear().to_linear(value), value / 255.0f);
  }
}

class ResponseFile : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    path_ = folder_ / "response.txt";
  }
  void write(const std::function<std::string(int)>& line, int lines = 256) {
    std::ofstream out(path_);
    out << "# measured\n\n";
    for (int i = 0; i < lines; ++i) {
      out << line(i) << "\n";
    }
  }
  std::string error() {
    try {
      Response::from_file(path_);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }
  std::filesystem::path path_;
};

TEST_F(ResponseFile, OneOrThreeColumns) {
  write([](int i) { return std::to_string(i / 255.0 * i / 255.0); });
  EXPECT_NEAR(Response::from_file(path_).to_linear(128, 2), 128.0 * 128.0 / 255.0 / 255.0, 1e-6);
  write([](int i) { return std::to_string(i / 255.0) + " " + std::to_string(i / 510.0) + " 1 # three"; });
  EXPECT_NE(error(), "no error") << "the blue column is constant";
  write([](int i) {
    return std::to_string(i / 255.0) + " " + std::to_string(i / 510.0) + " " + std::to_string(i / 1020.0);
  });
  EXPECT_NEAR(Response::from_file(path_).to_linear(255, 0), 1.0, 1e-6);
  EXPECT_NEAR(Response::from_file(path_).to_linear(255, 1), 0.5, 1e-6);
  EXPECT_NEAR(Response::from_file(path_).to_linear(255, 2), 0.25, 1e-6);
}

TEST_F(ResponseFile, BadTablesAreRefusedWithTheirLine) {
  const auto ramp = [](int i) { return std::to_string(i / 255.0); };
  EXPECT_NE(error().find("no readable file"), std::string::npos);
  write(ramp, 255);
  EXPECT_NE(error().find("found 255 lines"), std::string::npos);
  write(ramp, 257);
  EXPECT_NE(error().find(":259: found a 257th line"), std::string::npos);
  write([&](int i) { return i == 100 ? "0.1" : ramp(i); });
  EXPECT_NE(error().find(":103: found 0.100000, which decreases"), std::string::npos);
  write([&](int i) { return i == 100 ? "nan" : ramp(i); });
  EXPECT_NE(error().find(":103: found"), std::string::npos);
  write([&](int i) { return i == 255 ? "1.5" : ramp(i); });
  EXPECT_NE(error().find(":258: found 1.5"), std::string::npos);
  write([&](int i) { return i == 3 ? "0.01 0.01" : ramp(i); });
  EXPECT_NE(error().find(":6: found 2 numbers"), std::string::npos);
  write([&](int i) { return i == 3 ? "zero" : ramp(i); });
  EXPECT_NE(error().find(":6: found text"), std::string::npos);
}

}  // namespace
}  // namespace lumigraft::capture
