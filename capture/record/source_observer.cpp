#include "capture/record/source_observer.h"

#include <map>
#include <utility>

namespace lumigraft::capture {

class SourceObserver::ObservedSource : public ForwardingSource {
 public:
  ObservedSource(std::shared_ptr<Source> source, std::shared_ptr<Shared> shared)
      : ForwardingSource(std::move(source)), shared_(std::move(shared)) {}

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    std::optional<SourceItem> item = source_->next(timeout);
    if (item) {
      const std::lock_guard lock(shared_->mutex);
      if (shared_->listener) shared_->listener(*item);
    }
    return item;
  }

 private:
  std::shared_ptr<Shared> shared_;
};

SourceObserver::SourceObserver() : shared_(std::make_shared<Shared>()) {}

PairedSources SourceObserver::on(const PairedSources& sources) const {
  std::map<Source*, std::shared_ptr<Source>> observed;  // one device may deliver both colour and depth
  const auto of = [&](const std::shared_ptr<Source>& source) -> std::shared_ptr<Source> {
    std::shared_ptr<Source>& one = observed[source.get()];
    if (source && !one) one = std::make_shared<ObservedSource>(source, shared_);
    return one;
  };
  PairedSources out = sources;
  out.color = of(sources.color);
  out.depth = of(sources.depth);
  out.fisheye = of(sources.fisheye);
  return out;
}

void SourceObserver::listen(Listener listener) {
  const std::lock_guard lock(shared_->mutex);
  shared_->listener = std::move(listener);
}

}  // namespace lumigraft::capture
