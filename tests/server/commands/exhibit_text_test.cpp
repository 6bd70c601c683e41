#include "server/commands/exhibit_text.h"

#include <gtest/gtest.h>

#include "capture/error.h"

namespace lumigraft::server {
namespace {

constexpr const char* kVase = "models/vase.glb";

TEST(ExhibitText, TheObjectsOfAModelGoAndNothingElse) {
  EXPECT_EQ(without_objects_of("# the hall\n"
                               "bounds_m = [[-1, -1, 0], [1, 1, 1]]\n"
                               "\n"
                               "[[object]]  # uploaded on the page\n"
                               "name = \"vase\"\n"
                               "model = \"models/vase.glb\"\n"
                               "# by the window\n"
                               "note = \"\"\"\n"
                               "[[object]]\n"
                               "\"\"\"\n"
                               "[object.material]\n"
                               "roughness = 0.5\n"
                               "[[object.motion]]\n"
                               "time_s = 0\n"
                               "\n"
                               "# the curator's own\n"
                               "[[object]]\n"
                               "model = 'statue.glb'\n"
                               "material = { roughness = 0.5 }\n"
                               "\n"
                               "[[object]]\n"
                               "model = \"models/vase.glb\"\n",
                               kVase),
            "# the hall\n"
            "bounds_m = [[-1, -1, 0], [1, 1, 1]]\n"
            "\n"
            "# the curator's own\n"
            "[[object]]\n"
            "model = 'statue.glb'\n"
            "material = { roughness = 0.5 }\n");
}

TEST(ExhibitText, WithoutTheModelItStays) {
  const std::string text = "[[object]]\nmodel = \"models/vase2.glb\"  # no newline at the end";
  EXPECT_EQ(without_objects_of(text, kVase), text);
  EXPECT_EQ(without_objects_of("object = [{ model = \"models/vase2.glb\" }]", kVase),
            "object = [{ model = \"models/vase2.glb\" }]");
  EXPECT_THROW(without_objects_of("[[object]\n", kVase), capture::InputError);
}

}  // namespace
}  // namespace lumigraft::server
