// Reads the inputs that libFuzzer has found, without libFuzzer.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/targets.h"

namespace lumigraft::test {
namespace {

/// Peak memory of this process or of its children.
long largest_mb(int whose) {
  rusage used{};
  getrusage(whose, &used);
  return used.ru_maxrss / 1024;
}

int play(const char* corpus, void (*target)(fuzz::Bytes)) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(LUMIGRAFT_SOURCE_DIR "/tests/fuzz/corpus/") + corpus)) {
    SCOPED_TRACE(entry.path());
    std::ifstream in(entry.path(), std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    EXPECT_NO_THROW(target({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
    ++files;
  }
  EXPECT_LT(largest_mb(RUSAGE_SELF), 500);
  EXPECT_LT(largest_mb(RUSAGE_CHILDREN), 1200) << "memory of the helper for OpenNI2 recordings";
  return files;
}

TEST(FuzzCorpus, Recordings) { EXPECT_GT(play("mkv", fuzz::mkv), 10); }
TEST(FuzzCorpus, Sessions) { EXPECT_GT(play("session", fuzz::session), 10); }
TEST(FuzzCorpus, Calibrations) { EXPECT_GT(play("calibration", fuzz::calibration), 10); }
TEST(FuzzCorpus, Models) { EXPECT_GT(play("gltf", fuzz::gltf), 10); }
TEST(FuzzCorpus, PlyModels) { EXPECT_GT(play("ply", fuzz::ply), 2); }
TEST(FuzzCorpus, ObjModels) { EXPECT_GT(play("obj", fuzz::obj), 2); }
TEST(FuzzCorpus, Pictures) { EXPECT_GT(play("picture", fuzz::picture), 10); }
TEST(FuzzCorpus, PictureLists) { EXPECT_GT(play("picture_list", fuzz::picture_list), 10); }
TEST(FuzzCorpus, Responses) { EXPECT_GT(play("response", fuzz::response), 5); }
TEST(FuzzCorpus, Exhibits) { EXPECT_GT(play("exhibit", fuzz::exhibit), 2); }
TEST(FuzzCorpus, Configurations) { EXPECT_GT(play("service", fuzz::service), 2); }
TEST(FuzzCorpus, Commands) { EXPECT_GT(play("command", fuzz::command), 10); }
TEST(FuzzCorpus, Requests) { EXPECT_GT(play("http", fuzz::http), 10); }
TEST(FuzzCorpus, WebsocketMessages) { EXPECT_GT(play("websocket", fuzz::websocket), 10); }
TEST(FuzzCorpus, OpenNiRecordings) { EXPECT_GT(play("oni", fuzz::oni), 10); }

}  // namespace
}  // namespace lumigraft::test
