#include "reconstruct/fusion/brick_pages.h"

#include <sys/mman.h>

#include <new>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

constexpr std::size_t kChunk_bytes = std::size_t{2} << 20, kLine_bytes = 64;
/// A brick and what a shared pointer keeps beside it.
constexpr std::size_t kPlace_bytes = (sizeof(FieldBrick) + 2 * kLine_bytes - 1) / kLine_bytes * kLine_bytes;

/// Each brick holds on to the pages that it lies in.
template <typename Value>
struct InPages {
  using value_type = Value;
  std::shared_ptr<BrickPages> pages;

  explicit InPages(std::shared_ptr<BrickPages> in) : pages(std::move(in)) {}
  template <typename Other>
  InPages(const InPages<Other>& other) : pages(other.pages) {}  // NOLINT: allocators turn into another

  Value* allocate(std::size_t) {
    static_assert(sizeof(Value) <= kPlace_bytes && alignof(Value) <= kLine_bytes);
    return static_cast<Value*>(pages->take());
  }
  void deallocate(Value* place, std::size_t) { pages->give_back(place); }
  template <typename Other>
  bool operator==(const InPages<Other>& other) const {
    return pages == other.pages;
  }
};

}  // namespace

BrickPages::BrickPages(std::size_t place_bytes) : place_bytes_(place_bytes) {}

void* BrickPages::take() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) {
    void* chunk = std::aligned_alloc(kChunk_bytes, kChunk_bytes);
    if (!chunk) throw std::bad_alloc();
    chunks_.emplace_back(chunk);
    ::madvise(chunk, kChunk_bytes, MADV_HUGEPAGE);  // a wish: where it is not granted all works as before
    const std::size_t places = kChunk_bytes / place_bytes_;
    free_.reserve(chunks_.size() * places);
    for (std::size_t i = places; i-- > 0;) free_.push_back(static_cast<std::byte*>(chunk) + i * place_bytes_);
  }
  void* place = free_.back();
  free_.pop_back();
  return place;
}

void BrickPages::give_back(void* place) {
  const std::lock_guard lock(mutex_);
  free_.push_back(place);  // there is room for all
}

FieldBrickMaker::FieldBrickMaker() : pages_(std::make_shared<BrickPages>(kPlace_bytes)) {}

std::shared_ptr<const FieldBrick> FieldBrickMaker::copy(const FieldBrick& brick) const {
  return std::allocate_shared<FieldBrick>(InPages<FieldBrick>(pages_), brick);
}

}  // namespace lumigraft::reconstruct
