#pragma once
// Moves depth from the depth camera's pixels to the colour camera's pixels.
//
// RegistrationStage is a stage of the pipeline, so frames that are dropped before it are not registered.
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

  /// Converts counts of the depth camera to metres along the colour camera's z. If the device does not register depth,
  /// every depth pixel is drawn as the rectangle that it covers in the colour image, the nearest in front, and holes
  /// between two neighbouring measurements (an effect of resampling, not of the sensor) are filled with their mean.
  Image<float> operator()(const Image<std::uint16_t>& counts) const;

 private:
  Image<float> reproject(const Image<std::uint16_t>& counts) const;

  DepthCamera depth_;
  CameraModel color_;
  std::vector<Eigen::Vector3d> rays_;  ///< per depth pixel in the depth frame, z = 1; NaN outside the image circle
};

class RegistrationStage {
 public:
  explicit RegistrationStage(const Session& session);
  /// The frame with `depth`, if it has raw_depth and the session has a depth camera. Equal raw_depth pointers give the
  /// same `depth` pointer.
  FrameSet register_depth(const FrameSet& frame);

 private:
  std::optional<DepthRegistration> registration_;
  std::shared_ptr<const RawDepth> last_raw_;
  std::shared_ptr<const DepthFrame> last_;
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
  std::vector<std::string> faults() const override { return reader_->faults(); }

 private:
  RegistrationStage stage_;
  std::unique_ptr<FrameReader> reader_;
};

}  // namespace lumigraft::capture
