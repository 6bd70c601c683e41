#pragma once
// Selects the 8 × 8 pixel blocks that the objects can change or cover. Software devices execute every branch of a
// shader, so work that is not needed must not be dispatched.
#include <Eigen/Geometry>
#include <vector>

#include "capture/frame.h"
#include "relight/gpu/device.h"
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/lamp_shadows.h"
#include "relight/shaders/common/interop.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// Bounding sphere of a glossy real surface of known material, tag frame, with a margin for its uncertainty.
struct GlossyBounds {
  Eigen::AlignedBox3f box;
  float alpha = 1;  ///< GGX roughness
};

class Tiles {
 public:
  Tiles(gpu::Device& device, int width_px, int height_px, int shadow_scale, int trace_scale, int ambient_scale,
        int fine_step);

  struct Picture {
    const std::vector<float>& rays;        ///< x/z and y/z per pixel
    const capture::Image<float>* depth_m;  ///< null: none
    const capture::Image<std::uint8_t>& codes;
  };
  struct Choice {
    float min_code_change = 0;                  ///< as in quality.h
    const std::vector<GlossyBounds>& glossy;    ///< where glossy real surfaces of known material may be
    const LampShadows* lamp_shadows = nullptr;  ///< null: shadows of the sphere around the objects
    bool all = false;                           ///< select every block
    const std::vector<char>* only = nullptr;    ///< null: select among all blocks, else among those that are not 0
  };
  void choose(gpu::Device& device, const shader::FrameParams& params, const Picture& picture,
              const std::vector<PlacedObject>& objects, const Choice& choice);

  const TileList& views() const { return views_; }  ///< changed or covered
  /// The same as column | row << 16.
  const std::vector<std::uint32_t>& view_places() const { return view_places_; }
  /// The changed blocks in two parts: objects and shadows, on the grid of one sample per `fine_step` pixels along each
  /// axis, and all other changes, on that of smooth_px; the lists overlap at their borders.
  const TileList& fine() const { return fine_; }
  const TileList& smooth() const { return smooth_; }
  /// views() in three parts: blocks drawn per pixel (inside the objects' bounds, and glossy ones); of the others those
  /// with shadows; and the rest. As column | row << 16 of the pixel grid.
  const std::vector<std::uint32_t>& object_places() const { return object_places_; }
  const std::vector<std::uint32_t>& shaded_alone_places() const { return shaded_alone_places_; }
  const std::vector<std::uint32_t>& smooth_places() const { return smooth_places_; }
  const Eigen::AlignedBox2i& covered() const { return covered_; }  ///< bounding box of objects(), in blocks
  const TileList& changed() const { return changed_; }
  const TileList& objects() const { return objects_; }    ///< inside the objects' bounds
  const TileList& ambients() const { return ambients_; }  ///< the same, on the grid of ambient cells
  const TileList& shaded() const { return shaded_; }      ///< where objects may occlude a lamp
  const TileList& shadows() const { return shadows_; }    ///< the same, on the grid of shadow cells
  const TileList& traces() const { return traces_; }      ///< on the grid of traced cells
  /// Of changed(), those that may show glossy real surfaces of known material.
  const TileList& glossy() const { return glossy_; }
  /// The same in two parts: where gloss blurs the objects' reflection over so many pixels that one sample per
  /// blurred_px pixels along each axis suffices, on the grid of these; and the rest. The first overlaps the rest.
  const TileList& blurred() const { return blurred_; }
  const TileList& sharp() const { return sharp_; }

 private:
  std::size_t tile_of(int u, int v) const { return static_cast<std::size_t>(v / kTile_px) * columns_ + u / kTile_px; }
  std::vector<std::uint32_t> places(const std::vector<char>& marked, int scale) const;
  std::vector<std::uint32_t> send(gpu::Device& device, TileList& list, const std::vector<char>& marked,
                                  int scale) const;
  void cover(const shader::FrameParams& params, const std::vector<PlacedObject>& objects, std::vector<char>* covered);

  int width_, height_, columns_, rows_, shadow_scale_, trace_scale_, ambient_scale_, fine_step_;
  TileList views_, changed_, objects_, ambients_, shaded_, shadows_, traces_, fine_, smooth_, glossy_, blurred_, sharp_;
  std::vector<std::uint32_t> view_places_, object_places_, shaded_alone_places_, smooth_places_;
  Eigen::AlignedBox2i covered_;
};

}  // namespace lumigraft::relight
