#pragma once
// Which 8 × 8 blocks of pixels the objects can change or cover. Software devices run every branch of a shader, so work
// that is not needed must not be dispatched.
#include <memory>
#include <vector>

#include "capture/frame.h"
#include "relight/gpu/device.h"
#include "relight/object_store.h"
#include "relight/passes/dispatch.h"
#include "relight/shaders/interop.h"

namespace lumigraft {

constexpr int kTile_px = 8;
constexpr int kSmoothStep = 4;  ///< pixels along each axis that one stands for where all that changes is smooth

class Tiles {
 public:
  Tiles(gpu::Device& device, int width_px, int height_px, int shadow_scale, int trace_scale, int ambient_scale);

  /// `rays` holds x/z and y/z of every pixel; `least_codes` as in quality.h; `all` takes every block.
  void choose(gpu::Device& device, const shader::FrameParams& params, const std::vector<float>& rays,
              const Image<float>* depth_m, const Image<float>& radiance, const std::vector<PlacedObject>& objects,
              float least_codes, bool glossy, bool all);

  const TileList& views() const { return views_; }  ///< changed or covered
  /// The same as column | row << 16.
  const std::vector<std::uint32_t>& view_places() const { return view_places_; }
  /// The views in two parts: every pixel where objects are seen or can stand before a lamp, and elsewhere one pixel of
  /// 2 × 2, since what else changes is smooth. The second list is of the grid of such blocks, and reaches into the
  /// first.
  const TileList& fine() const { return fine_; }
  const TileList& smooth() const { return smooth_; }
  const TileList& smooth_views() const { return smooth_views_; }  ///< the same, of the grid of pixels
  const TileList& changed() const { return changed_; }
  const TileList& objects() const { return objects_; }    ///< inside the objects' bounds
  const TileList& ambients() const { return ambients_; }  ///< the same, of the grid of ambient cells
  const TileList& shaded() const { return shaded_; }      ///< where objects can stand before a lamp
  const TileList& shadows() const { return shadows_; }    ///< the same, of the grid of shadow cells
  const TileList& traces() const { return traces_; }      ///< of the grid of traced cells

 private:
  std::vector<std::uint32_t> send(gpu::Device& device, TileList& list, const std::vector<char>& marked,
                                  int scale) const;

  int width_, height_, columns_, rows_, shadow_scale_, trace_scale_, ambient_scale_;
  TileList views_, changed_, objects_, ambients_, shaded_, shadows_, traces_, fine_, smooth_, smooth_views_;
  std::vector<std::uint32_t> view_places_;
};

}  // namespace lumigraft
