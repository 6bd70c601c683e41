#include "server/commands/viewer_text.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

TEST(ViewerText, HasNoFolders) {
  EXPECT_EQ(without_folders("/var/lib/lumigraft/a.toml: line 3"), "a.toml: line 3");
  EXPECT_EQ(without_folders("cannot copy file: No space left [/a/b/c.csv] [/d/e]"),
            "cannot copy file: No space left [c.csv] [e]");
  EXPECT_EQ(without_folders("found \"/a/b\", and '/c/d/'"), "found \"b\", and ''");
  for (const char* same : {"", "/", "12 W/m2 and/or / 3", "see /metrics", "color.mkv: File too large", "a/b/c"}) {
    EXPECT_EQ(without_folders(same), same);
  }
}

}  // namespace
}  // namespace lumigraft::server
