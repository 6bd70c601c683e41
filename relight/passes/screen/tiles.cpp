#include "relight/passes/screen/tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
namespace {

/// Whether objects inside the sphere can change a pixel; the bound of in_footprint() in influence_mask.glsl, for a
/// surface facing them.
class Bound {
 public:
  Bound(const shader::FrameParams& params, const Tiles::Choice& choice)
      : p_(params),
        lamp_shadows_(choice.lamp_shadows),
        glossy_(choice.glossy),
        min_codes_(choice.min_code_change),
        facing_(choice.glossy.empty() ? 1.0f : 4.0f) {
    for (std::size_t code = 0; code < codes_.size(); ++code) {
      // Change of the pixel value, with the slope of the sRGB curve above its linear part.
      const float root = std::max((static_cast<float>(code) / 255 + 0.055f) / 1.055f, 0.1f);
      const float brighter = 1 + params.exposure.w() / std::pow(root, 2.4f);
      codes_[code] = 255.0f * 1.055f / 2.4f * root * brighter;
    }
  }

  /// `code`: pixel value of the brightest channel.
  bool can_change(const Eigen::Vector3f& at, std::uint8_t code) const {
    const float r2 = p_.sphere.w() * p_.sphere.w(), far2 = (p_.sphere.head<3>() - at).squaredNorm();
    if (far2 < 1.5f * r2) return true;
    return codes_[code] * r2 * facing_ > min_codes_ * far2;
  }

  /// Minimum blur of the objects' reflection by gloss at this point, in pixels (shaders/screen/mirror_blur.glsl); none
  /// if there is no glossy surface.
  std::optional<float> blur_px(const Eigen::Vector3f& at) const {
    std::optional<float> min_blur;
    const float near = std::max((p_.sphere.head<3>() - at).norm() - p_.sphere.w(), 0.0f);
    const float far = (p_.T_tag_camera.topRightCorner<3, 1>() - at).norm();
    for (const GlossyBounds& g : glossy_) {
      if (!g.box.contains(at)) continue;
      const float blur = 2 * g.alpha * near * p_.pinhole.x() / (near + far);
      min_blur = std::min(min_blur.value_or(blur), blur);
    }
    return min_blur;
  }

  /// Whether the objects may occlude a lamp here.
  bool can_shade(const Eigen::Vector3f& at) const {
    if (lamp_shadows_) return lamp_shadows_->shades(at);
    const Eigen::Vector3f centre = p_.sphere.head<3>();
    const float far2 = (centre - at).squaredNorm(), far = std::sqrt(far2);
    for (int i = 0; i < p_.counts.x(); ++i) {  // does the ray to the lamp hit the sphere, plus penumbra?
      const Eigen::Vector3f to_lamp = p_.lamps[i].position_radius.head<3>() - at;
      const float l = to_lamp.norm(), along = (centre - at).dot(to_lamp) / l;
      const float reach = p_.sphere.w() + far * p_.lamps[i].position_radius.w() / l;
      const float half = reach * reach - far2 + along * along;
      if (half > 0 && along + std::sqrt(half) > 0 && along - std::sqrt(half) < l) return true;
    }
    return false;
  }

 private:
  const shader::FrameParams& p_;
  const LampShadows* lamp_shadows_;
  const std::vector<GlossyBounds>& glossy_;
  float min_codes_, facing_;
  std::array<float, 256> codes_{};  ///< by pixel value, how far the objects change it at a distance of their radius
};

}  // namespace

Tiles::Tiles(gpu::Device& device, int width_px, int height_px, int shadow_scale, int trace_scale, int ambient_scale,
             int fine_step)
    : width_(width_px),
      height_(height_px),
      columns_((width_px + kTile_px - 1) / kTile_px),
      rows_((height_px + kTile_px - 1) / kTile_px),
      shadow_scale_(shadow_scale),
      trace_scale_(trace_scale),
      ambient_scale_(ambient_scale),
      fine_step_(fine_step) {
  const std::size_t bytes = sizeof(std::uint32_t) * columns_ * rows_;
  for (TileList* list : {&views_, &changed_, &objects_, &fine_, &smooth_, &ambients_, &shaded_, &shadows_, &traces_,
                         &glossy_, &blurred_, &sharp_}) {
    list->buffer = device.create_buffer(bytes, "tiles");
  }
}

void Tiles::choose(gpu::Device& device, const shader::FrameParams& params, const Picture& picture,
                   const std::vector<PlacedObject>& objects, const Choice& choice) {
  const auto tile_count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  std::vector<char> changed(tile_count, choice.all), shaded(changed), covered(changed);
  std::vector<char> glossy(tile_count, choice.all && !choice.glossy.empty()), sharp(glossy);
  const auto considered = [&](std::size_t tile) { return choice.only == nullptr || (*choice.only)[tile]; };

  const Bound bound(params, choice);
  const Eigen::Matrix3f turn = params.T_tag_camera.topLeftCorner<3, 3>();
  const Eigen::Vector3f eye = params.T_tag_camera.topRightCorner<3, 1>();
  for (int v = 0; v < height_ && !choice.all; v += kPasses.tested_px) {
    for (int u = 0; u < width_; u += kPasses.tested_px) {
      const std::size_t place = tile_of(u, v);
      char &tile = changed[place], &shade = shaded[place];
      if ((tile && shade && (choice.glossy.empty() || sharp[place])) || !considered(place)) continue;
      const std::size_t i = static_cast<std::size_t>(v) * width_ + u;
      const float z = picture.depth_m != nullptr ? picture.depth_m->data[i] : 0.0f;
      if (z <= 0) {
        tile = shade = 1;  // a hole: the field gives the surface's position later
        glossy[place] = sharp[place] = !choice.glossy.empty();
        continue;
      }
      const Eigen::Vector3f at = eye + turn * Eigen::Vector3f(picture.rays[2 * i] * z, picture.rays[2 * i + 1] * z, z);
      const std::uint8_t* code = &picture.codes.data[3 * i];
      shade = shade || bound.can_shade(at);
      tile = tile || shade || bound.can_change(at, std::max({code[0], code[1], code[2]}));
      if (const std::optional<float> blur_px = bound.blur_px(at)) {
        glossy[place] = 1;
        sharp[place] |= *blur_px < kPasses.blur_px;
      }
    }
  }

  cover(params, objects, &covered);
  for (std::size_t i = 0; i < tile_count; ++i) covered[i] = covered[i] && considered(i);

  std::vector<char> blurred(glossy);
  for (std::size_t i = 0; i < tile_count; ++i) {
    glossy[i] = glossy[i] && changed[i];
    blurred[i] = glossy[i] && !sharp[i];
    sharp[i] = glossy[i] && sharp[i];
  }
  send(device, glossy_, glossy, 1);
  send(device, blurred_, blurred, kPasses.blurred_px);
  send(device, sharp_, sharp, 1);

  std::vector<char> views(changed);
  for (std::size_t i = 0; i < tile_count; ++i) views[i] |= covered[i];
  view_places_ = send(device, views_, views, 1);
  send(device, changed_, changed, 1);
  send(device, objects_, covered, 1);
  send(device, ambients_, covered, ambient_scale_);
  for (std::size_t i = 0; i < tile_count; ++i) covered[i] |= glossy[i];
  object_places_ = places(covered, 1);
  // A lamp's highlight may be visible from any direction, and its light may reach any point by way of mirrors.
  if (!choice.glossy.empty() && choice.lamp_shadows == nullptr) shaded = changed;
  send(device, shaded_, shaded, 1);
  std::vector<char> fine(shaded), shaded_alone(shaded), smooth(views);
  for (std::size_t i = 0; i < tile_count; ++i) {
    fine[i] = shaded[i] || covered[i];
    shaded_alone[i] = shaded[i] && !covered[i];
    smooth[i] = smooth[i] && !shaded[i] && !covered[i];
  }
  send(device, fine_, fine, fine_step_);
  shaded_alone_places_ = places(shaded_alone, 1);
  send(device, smooth_, smooth, kPasses.smooth_px);
  smooth_places_ = places(smooth, 1);
  send(device, shadows_, shaded, shadow_scale_);
  send(device, traces_, changed, trace_scale_);
}

/// The projected outline of every object's box.
void Tiles::cover(const shader::FrameParams& params, const std::vector<PlacedObject>& objects,
                  std::vector<char>* covered) {
  for (const PlacedObject& object : objects) {
    Eigen::AlignedBox2f outline;
    bool in_front = true;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3f tag = object.bounds.box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner));
      const Eigen::Vector3f p = (params.T_camera_tag * tag.homogeneous()).head<3>();
      in_front &= p.z() > params.camera.y();
      outline.extend(Eigen::Vector2f(params.pinhole.x() * p.x() / p.z() + params.pinhole.z(),
                                     params.pinhole.y() * p.y() / p.z() + params.pinhole.w()));
    }
    // Behind the camera or with lens distortion the projected corners do not bound the box.
    if (!in_front || params.distortion != Eigen::Vector4f::Zero() || params.camera.x() != 0) {
      std::fill(covered->begin(), covered->end(), 1);
      break;
    }
    const auto clamp_to = [](float x, int size) { return std::clamp(static_cast<int>(x), 0, size - 1); };
    if (outline.max().x() < -kPasses.margin_px || outline.max().y() < -kPasses.margin_px ||
        outline.min().x() > static_cast<float>(width_ + kPasses.margin_px) ||
        outline.min().y() > static_cast<float>(height_ + kPasses.margin_px)) {
      continue;
    }
    for (int v = clamp_to(outline.min().y() - kPasses.margin_px, height_) / kTile_px;
         v <= clamp_to(outline.max().y() + kPasses.margin_px, height_) / kTile_px; ++v) {
      for (int u = clamp_to(outline.min().x() - kPasses.margin_px, width_) / kTile_px;
           u <= clamp_to(outline.max().x() + kPasses.margin_px, width_) / kTile_px; ++u) {
        (*covered)[tile_of(u * kTile_px, v * kTile_px)] = 1;
      }
    }
  }
  covered_.setEmpty();
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      if ((*covered)[tile_of(column * kTile_px, row * kTile_px)]) covered_.extend(Eigen::Vector2i(column, row));
    }
  }
}

std::vector<std::uint32_t> Tiles::places(const std::vector<char>& marked, int scale) const {
  std::vector<std::uint32_t> places;
  for (int row = 0; row < rows_; row += scale) {
    for (int column = 0; column < columns_; column += scale) {
      bool any = false;
      for (int v = row; v < std::min(row + scale, rows_); ++v) {
        for (int u = column; u < std::min(column + scale, columns_); ++u) {
          any |= marked[static_cast<std::size_t>(v) * columns_ + u] != 0;
        }
      }
      if (any)
        places.push_back(static_cast<std::uint32_t>(column / scale) | static_cast<std::uint32_t>(row / scale) << 16);
    }
  }
  return places;
}

std::vector<std::uint32_t> Tiles::send(gpu::Device& device, TileList& list, const std::vector<char>& marked,
                                       int scale) const {
  std::vector<std::uint32_t> chosen = places(marked, scale);
  list.count = static_cast<int>(chosen.size());
  if (!chosen.empty()) device.upload(*list.buffer, 0, std::as_bytes(std::span(chosen)));
  return chosen;
}

}  // namespace lumigraft::relight
