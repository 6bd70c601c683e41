#include "capture/record/source_observer.h"

#include <map>
#include <utility>

namespace lumigraft::capture {

class SourceObserver::Tapped : public Source {
 public:
  Tapped(std::shared_ptr<Source> source, std::shared_ptr<Ear> ear) : source_(std::move(source)), ear_(std::move(ear)) {}

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    std::optional<SourceItem> item = source_->next(timeout);
    if (item) {
      const std::lock_guard lock(ear_->mutex);
      if (ear_->listener) {
        ear_->listener(*item);
      }
    }
    return item;
  }
  bool finished() const override { return source_->finished(); }
  void rewind() override { source_->rewind(); }
  std::string fault() const override { return source_->fault(); }
  std::string take_warning() override { return source_->take_warning(); }
  bool on_host_clock() const override { return source_->on_host_clock(); }
  bool bracket_goes_on() const override { return source_->bracket_goes_on(); }

 private:
  std::shared_ptr<Source> source_;
  std::shared_ptr<Ear> ear_;
};

SourceObserver::SourceObserver() : ear_(std::make_shared<Ear>()) {}

PairedSources SourceObserver::on(const PairedSources& sources) const {
  std::map<Source*, std::shared_ptr<Source>> tapped;  // a depth camera may be two of them
  const auto of = [&](const std::shared_ptr<Source>& source) -> std::shared_ptr<Source> {
    std::shared_ptr<Source>& one = tapped[source.get()];
    if (source && !one) {
      one = std::make_shared<Tapped>(source, ear_);
    }
    return one;
  };
  PairedSources out = sources;
  out.color = of(sources.color);
  out.depth = of(sources.depth);
  out.fisheye = of(sources.fisheye);
  return out;
}

void SourceObserver::listen(Listener listener) {
  const std::lock_guard lock(ear_->mutex);
  ear_->listener = std::move(listener);
}

}  // namespace lumigraft::capture
