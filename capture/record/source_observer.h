#pragma once
// Sources whose items somebody else hears too, while they pass: a recording beside the live picture.
#include <functional>
#include <memory>
#include <mutex>

#include "capture/sync/pairing_reader.h"

namespace lumigraft::capture {

class SourceObserver {
 public:
  using Listener = std::function<void(const SourceItem&)>;

  SourceObserver();
  /// The same sources, heard by this tap, which may go before them.
  PairedSources on(const PairedSources& sources) const;
  /// From now on; an empty one ends it. After it returns the former one is not called any more.
  void listen(Listener listener);

 private:
  struct Ear {
    std::mutex mutex;
    Listener listener;
  };
  class Tapped;

  std::shared_ptr<Ear> ear_;
};

}  // namespace lumigraft::capture
