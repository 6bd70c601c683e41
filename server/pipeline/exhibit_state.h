#pragma once
// The exhibit as viewers have left it. Any thread.
#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

class ExhibitState {
 public:
  explicit ExhibitState(relight::Exhibit exhibit);

  std::shared_ptr<const relight::Exhibit> newest() const;
  /// What is wrong with the command, if anything. An object that is moved or turned by hand leaves its key frames.
  std::optional<std::string> apply(const ObjectCommand& command);
  /// The objects as a JSON array, as `hello` and `state` carry them.
  std::string objects_json() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const relight::Exhibit> exhibit_;
  std::vector<Eigen::Quaterniond> rest_;  ///< attitudes before any viewer turned anything
  std::vector<double> yaw_degrees_;
};

}  // namespace lumigraft::server
