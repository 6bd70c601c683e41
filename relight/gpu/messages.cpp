#include "relight/gpu/messages.h"

#include <cstdio>

#include "relight/gpu/device.h"

namespace lumigraft::relight::gpu {

Messages::~Messages() {
  for (const std::string& text : texts_) std::fprintf(stderr, "%s: %s\n", speaker_.c_str(), text.c_str());
}

void Messages::add(std::string text) {
  const std::lock_guard lock(mutex_);
  texts_.push_back(std::move(text));
}

std::string Messages::take() {
  const std::lock_guard lock(mutex_);
  if (texts_.empty()) return "";
  std::string all = speaker_ + ":";
  for (const std::string& text : texts_) all += "\n" + text;
  texts_.clear();
  return all;
}

void Messages::throw_if_any() {
  if (const std::string all = take(); !all.empty()) throw GpuError(all);
}

}  // namespace lumigraft::relight::gpu
