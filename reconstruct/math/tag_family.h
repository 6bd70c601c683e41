#pragma once
// The families of AprilTags that libapriltag generates, and the size of their prints.
#include <string>

#include "capture/session/session.h"

struct apriltag_family;

namespace lumigraft::reconstruct {

struct TagFamily {
  const char* name;
  apriltag_family* (*create)();
  void (*destroy)(apriltag_family*);
};

/// Throws InputError for a family that does not exist.
const TagFamily& family_named(const std::string& name);

/// Edge of the whole print: the black square and the white border that the family has around it. Throws InputError for
/// a family that does not exist.
double print_edge_m(const capture::Tag& tag);

}  // namespace lumigraft::reconstruct
