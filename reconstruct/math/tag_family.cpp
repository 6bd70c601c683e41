#include "reconstruct/math/tag_family.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include "capture/error.h"

namespace lumigraft::reconstruct {
namespace {

constexpr TagFamily kFamilies[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag36h10", tag36h10_create, tag36h10_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
    {"tagCircle49h12", tagCircle49h12_create, tagCircle49h12_destroy},
    {"tagCustom48h12", tagCustom48h12_create, tagCustom48h12_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy},
};

}  // namespace

const TagFamily& family_named(const std::string& name) {
  std::string allowed;
  for (const TagFamily& family : kFamilies) {
    if (name == family.name) return family;
    allowed += allowed.empty() ? "" : ", ";
    allowed += family.name;
  }
  throw capture::InputError("tag.family: found \"" + name + "\", allowed: " + allowed);
}

double print_edge_m(const capture::Tag& tag) {
  const TagFamily& functions = family_named(tag.family);
  apriltag_family_t* family = functions.create();
  const double cells = family->total_width, square_cells = family->width_at_border;
  functions.destroy(family);
  return tag.size_m * cells / square_cells;
}

}  // namespace lumigraft::reconstruct
