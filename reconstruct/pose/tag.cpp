#include "reconstruct/pose/tag.h"

#include <apriltag/apriltag.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>

#include "capture/error.h"
#include "reconstruct/math/tag_family.h"

namespace lumigraft::reconstruct {
namespace {

TagPattern pattern_of(apriltag_family_t* family, int id) {
  // image_u8_destroy is not exported; the image consists of two plain allocations.
  image_u8_t* picture = apriltag_to_image(family, id);
  TagPattern pattern;
  pattern.cells = picture->width;
  pattern.square_cells = family->width_at_border;
  for (int y = 0; y < picture->height; ++y)
    for (int x = 0; x < picture->width; ++x) pattern.white.push_back(picture->buf[y * picture->stride + x] > 127);
  std::free(picture->buf);
  std::free(picture);
  return pattern;
}

}  // namespace

bool TagPattern::white_at(int column, int row) const {
  column = std::clamp(column, 0, cells - 1);
  row = std::clamp(row, 0, cells - 1);
  return white[static_cast<std::size_t>(row) * cells + column] != 0;
}

struct TagFinder::Detector {
  explicit Detector(const capture::Tag& tag) : family_functions(family_named(tag.family)), ids{tag.id} {
    for (const capture::ExtraTag& extra : tag.extra) ids.push_back(extra.id);
    family = family_functions.create();
    for (const int id : ids) {
      if (id >= 0 && id < static_cast<int>(family->ncodes)) continue;
      const auto count = family->ncodes;
      family_functions.destroy(family);
      throw capture::InputError("tag.id: found " + std::to_string(id) + ", allowed: 0 to " + std::to_string(count - 1) +
                                " in " + tag.family);
    }
    detector = apriltag_detector_create();
    apriltag_detector_add_family_bits(detector, family, 1);
    detector->nthreads = 1;
    detector->refine_edges = true;
  }
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;
  ~Detector() {
    apriltag_detector_destroy(detector);
    family_functions.destroy(family);
  }

  const TagFamily& family_functions;
  std::vector<int> ids;
  apriltag_family_t* family = nullptr;
  apriltag_detector_t* detector = nullptr;
};

TagFinder::TagFinder(const capture::Tag& tag) : detector_(std::make_unique<Detector>(tag)) {
  for (const int id : detector_->ids) patterns_.push_back(pattern_of(detector_->family, id));
}

TagFinder::~TagFinder() = default;

std::vector<TagSighting> TagFinder::find(const capture::Image<std::uint8_t>& grey, int decimate) {
  detector_->detector->quad_decimate = static_cast<float>(decimate);
  image_u8_t picture = {grey.width, grey.height, grey.width, const_cast<std::uint8_t*>(grey.data.data())};
  zarray_t* detections = apriltag_detector_detect(detector_->detector, &picture);

  std::vector<TagSighting> found;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, i, &detection);
    const std::vector<int>& ids = detector_->ids;
    if (std::find(ids.begin(), ids.end(), detection->id) == ids.end()) continue;
    // The library's pixel (0, 0) spans [0, 1]; ours is centred at 0. Its corners start at the bottom left and are in
    // counter-clockwise order around the tag.
    TagSighting& sighting = found.emplace_back();
    sighting.id = detection->id;
    for (int c = 0; c < 4; ++c) sighting.corners[c] = {detection->p[c][0] - 0.5, detection->p[c][1] - 0.5};
    sighting.decision_margin = detection->decision_margin;
  }
  apriltag_detections_destroy(detections);

  std::ranges::stable_sort(found, std::greater(), &TagSighting::decision_margin);
  return found;
}

}  // namespace lumigraft::reconstruct
