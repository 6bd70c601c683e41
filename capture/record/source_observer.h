#pragma once
// Passes the items of sources also to a listener: a recording during live operation.
#include <functional>
#include <memory>
#include <mutex>

#include "capture/sync/pairing_reader.h"

namespace lumigraft::capture {

class SourceObserver {
 public:
  using Listener = std::function<void(const SourceItem&)>;

  SourceObserver();
  /// The same sources, observed. They remain valid after this object is gone.
  PairedSources on(const PairedSources& sources) const;
  /// Sets the listener; an empty one ends listening. The previous listener is not called any more after this returns.
  void listen(Listener listener);

 private:
  struct Shared {
    std::mutex mutex;
    Listener listener;
  };
  class ObservedSource;

  std::shared_ptr<Shared> shared_;
};

}  // namespace lumigraft::capture
