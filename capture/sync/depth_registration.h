#pragma once
// Depth on the depth camera's pixels becomes depth on the colour camera's pixels.
//
// A stage of the pipeline (RegistrationStage): frames that nobody takes need no registration.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "capture/source.h"

namespace lumigraft::capture {

class DepthRegistration {
 public:
  DepthRegistration(const DepthCamera& depth, const CameraModel& color);

  /// Counts of the depth camera to metres along the colour camera's z. Where not registered, every depth pixel is
  /// drawn as the rectangle it covers on the colour picture, the nearest winning, and holes that lie between two
  /// neighbouring measurements (an effect of resampling, not of the sensor) are filled with their mean.
  Image<float> operator()(const Image<std::uint16_t>& counts) const;

 private:
  Image<float> reproject(const Image<std::uint16_t>& counts) const;

  DepthCamera depth_;
  CameraModel color_;
  std::vector<Eigen::Vector3d> rays_;  ///< per depth pixel in the depth frame, z = 1; NaN where the lens sees nothing
};

class RegistrationStage {
 public:
  explicit RegistrationStage(const Session& session);
  /// The frame with `depth`, where it has raw_depth and the session a depth camera. The same picture again for the same
  /// raw_depth.
  FrameSet register_depth(const FrameSet& frame);

 private:
  std::optional<DepthRegistration> registration_;
  std::shared_ptr<const RawDepth> last_raw_;
  std::shared_ptr<const DepthPicture> last_;
};

/// A reader's frames with depth registered.
class RegisteredFrames : public FrameReader {
 public:
  RegisteredFrames(const Session& session, std::unique_ptr<FrameReader> reader)
      : stage_(session), reader_(std::move(reader)) {}

  std::optional<FrameSet> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return reader_->finished(); }
  void rewind() override { reader_->rewind(); }
  bool live() const override { return reader_->live(); }
  std::vector<std::string> troubles() const override { return reader_->troubles(); }

 private:
  RegistrationStage stage_;
  std::unique_ptr<FrameReader> reader_;
};

}  // namespace lumigraft::capture
